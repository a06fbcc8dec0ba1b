"""Alerts that stand, as ROS 2's diagnostics count them: one status for each sensor, by the worst of all that stand."""

from __future__ import annotations

from telemetry.topics.obstacles import ObstacleAlert

OK, ERROR, STALE = 0, 2, 3
"""Of diagnostic_msgs/DiagnosticStatus."""
SILENT_S = 5.0
"""Without a sign of the station, which gives one a second: what stood last is not known to stand, nor to be over."""
MOST_TOLD = 20
"""Of one sensor's alerts; further ones are counted."""
Status = tuple[int, str, str, str, dict[str, str]]
"""Level, name, message, hardware, values."""


class StandingAlerts:
    """Pure: times are monotonic ones of whoever asks."""

    def __init__(self, now_s: float) -> None:
        self._standing: dict[str, dict[str, ObstacleAlert]] = {}
        """By sensor and id, those that were told last behind."""
        self._last: dict[str, tuple[float, str]] = {}
        """By sensor: when it was told of last, and the words of what has ended."""
        self._alive_s = now_s
        self.is_silent = False

    def take(self, alert: ObstacleAlert, now_s: float) -> None:
        standing = self._standing.setdefault(alert.sensor, {})
        standing.pop(alert.id, None)
        if alert.phase != "ends":
            standing[alert.id] = alert
        self._last[alert.sensor] = now_s, alert.text

    def alive(self, now_s: float) -> None:
        """The station gave a sign."""
        self._alive_s = now_s

    def turned(self, now_s: float) -> bool:
        """Whether the station has fallen silent, or is back, since this was asked last."""
        before, self.is_silent = self.is_silent, now_s - self._alive_s >= SILENT_S
        return before != self.is_silent

    def statuses(self, now_s: float) -> list[Status]:
        """Of the station itself, and of all sensors of which anything was told."""
        words = f"The station has given no sign for {SILENT_S:.0f} s." if self.is_silent else "The station runs."
        station: Status = (STALE if self.is_silent else OK, "hedgehop: station", words, "station", {})
        return [station, *(self._status(sensor, now_s) for sensor in sorted(self._standing))]

    def _status(self, sensor: str, now_s: float) -> Status:
        standing, (told_s, ended) = list(self._standing[sensor].values()), self._last[sensor]
        level, words = OK, ended
        if standing:
            worst = min(standing, key=_distance_m)
            level, words = ERROR, worst.text
            if len(standing) > 1:
                words = f"{len(standing)} stand: {words}"
        if self.is_silent and now_s - told_s >= SILENT_S:
            level, words = STALE, f"Told last, and the station is silent since: {words}"
        values = {"standing": str(len(standing))}
        if standing:
            values |= _values(min(standing, key=_distance_m))
        values |= {f"alert {each.id}": each.text for each in sorted(standing, key=_distance_m)[:MOST_TOLD]}
        return level, f"hedgehop: {sensor}", words, sensor, values


def _distance_m(alert: ObstacleAlert) -> float:
    """What is of no place comes first: it is of the sensor or of avoidance as a whole."""
    return -1.0 if alert.obstacle is None else alert.obstacle.distance_m


def _values(alert: ObstacleAlert) -> dict[str, str]:
    values = {"id": alert.id, "kind": alert.kind, "phase": alert.phase}
    if (obstacle := alert.obstacle) is None:
        return values
    values |= {
        "region": obstacle.region,
        "distance_m": f"{obstacle.distance_m:.2f}",
        "bearing_deg": f"{obstacle.bearing_deg:.1f}",
        "height_difference_m": f"{obstacle.height_difference_m:.2f}",
    }
    if obstacle.time_to_contact_s is not None:
        values["time_to_contact_s"] = f"{obstacle.time_to_contact_s:.2f}"
    if obstacle.lat_deg is not None and obstacle.lon_deg is not None:
        values |= {"lat_deg": f"{obstacle.lat_deg:.7f}", "lon_deg": f"{obstacle.lon_deg:.7f}"}
    return values
