"""The lines that other stations' vehicles fly, as they are told: used only of one that is on its line, and heard."""

from __future__ import annotations

import numpy as np

from mapping.geometry.frames import MEAN_RADIUS_M
from server.heard.plan_follower import Ahead
from telemetry.errors import StationsError
from telemetry.stations.plan_lines import PlanLine, line_id, unpacked
from telemetry.topics.station_vehicles import OtherVehicle, StationsStatus


class OthersLines:
    """Each is read once. Belongs to the event loop."""

    def __init__(self) -> None:
        self._read: dict[bytes, tuple[int, PlanLine]] = {}
        self._of: dict[tuple[str, int], tuple[int, PlanLine]] = {}

    def on_status(self, status: StationsStatus) -> None:
        """Only what it tells stays known."""
        read = dict[bytes, tuple[int, PlanLine]]()
        of = dict[tuple[str, int], tuple[int, PlanLine]]()
        for line in status.lines:
            try:
                known = self._read.get(line.packed) or (line_id(line.packed), unpacked(line.packed))
            except StationsError:
                continue  # of a node of another version: its vehicle is taken to fly straight on
            read[line.packed] = of[line.station, line.number] = known
        self._read, self._of = read, of

    def of(self, other: OtherVehicle) -> PlanLine | None:
        """What it flies now; None: not known, or it has left it, or holds."""
        known = self._of.get((other.station, other.it.number))
        if known is None or other.it.line_s is None or known[0] != other.it.line:
            return None
        return known[1]


def ahead_of(line: PlanLine, line_s: float) -> tuple[Ahead, float] | None:
    """What is left of it, with heights above the sea, and its highest speed; None: nothing is left."""
    first = int(np.searchsorted(line.t_s, line_s, side="right"))
    if first >= len(line.t_s):
        return None
    left = Ahead(line.lat_lon_deg[first:], line.alt_amsl_m[first:], line.t_s[first:] - line_s)
    return left, _fastest_m_s(line)


def _fastest_m_s(line: PlanLine) -> float:
    lat_rad = np.radians(line.lat_lon_deg[:, 0])
    steps_m = MEAN_RADIUS_M * np.hypot(
        np.diff(lat_rad), np.cos(lat_rad[:-1]) * np.diff(np.radians(line.lat_lon_deg[:, 1]))
    )
    took_s = np.maximum(np.diff(line.t_s), 0.1)
    return float(np.max(np.hypot(steps_m, np.diff(line.alt_amsl_m)) / took_s, initial=0.0))
