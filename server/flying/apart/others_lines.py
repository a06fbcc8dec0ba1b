"""The lines that other stations' vehicles fly, as they are told: used only of one that is on its line, and heard."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import MEAN_RADIUS_M
from server.heard.plan_follower import Ahead
from telemetry.errors import StationsError
from telemetry.stations.plan_lines import PlanLine, line_id, unpacked
from telemetry.topics.station_vehicles import OtherVehicle, StationsStatus

_AGREES_M_S, _AROUND_S = 2.5, 3.0
"""So near its velocity has to be to that of the line, at some time that is so near."""
_SHORTEST_S = 0.1


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


def flies_along(line: PlanLine, line_s: float, v_enu_m_s: tuple[float, float, float] | None) -> bool:
    """Whether it moves as the line says around that time: who stands on it, or crosses it, does not fly it now."""
    if v_enu_m_s is None:
        return False
    steps_m, took_s = _steps(line)
    near = (line.t_s[1:] >= line_s - _AROUND_S) & (line.t_s[:-1] <= line_s + _AROUND_S)
    off_m_s = np.linalg.norm(steps_m[near] / took_s[near, None] - np.array(v_enu_m_s), axis=1)
    return bool((off_m_s <= _AGREES_M_S).any())


def _steps(line: PlanLine) -> tuple[F64, F64]:
    """(N - 1, 3) east, north, up from point to point, and the seconds that they take."""
    lat_rad, lon_rad = np.radians(line.lat_lon_deg).T
    east_m = MEAN_RADIUS_M * np.cos(lat_rad[:-1]) * np.diff(lon_rad)
    steps_m = np.column_stack([east_m, MEAN_RADIUS_M * np.diff(lat_rad), np.diff(line.alt_amsl_m)])
    return steps_m, np.maximum(np.diff(line.t_s), _SHORTEST_S)


def _fastest_m_s(line: PlanLine) -> float:
    steps_m, took_s = _steps(line)
    return float(np.max(np.linalg.norm(steps_m, axis=1) / took_s, initial=0.0))
