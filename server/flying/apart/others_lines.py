"""The lines that other stations' vehicles fly, as they are told: used only of one that is on its line, and heard."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import MEAN_RADIUS_M, offset_m
from server.heard.plan_follower import OFF_LINE_M, Ahead
from telemetry.errors import StationsError
from telemetry.stations.plan_lines import MOST_ERROR_M, PlanLine, line_id, unpacked
from telemetry.topics.station_vehicles import FleetVehicle, OtherVehicle, StationsStatus

_SHORTEST_S = 0.1


class OthersLines:
    """Each is read once. Belongs to the event loop."""

    def __init__(self) -> None:
        self._read: dict[bytes, tuple[int, PlanLine] | None] = {}
        self._of: dict[tuple[str, int], tuple[int, PlanLine]] = {}

    def on_status(self, status: StationsStatus) -> None:
        """Only what it tells stays known."""
        read = dict[bytes, tuple[int, PlanLine] | None]()
        of = dict[tuple[str, int], tuple[int, PlanLine]]()
        for line in status.lines:
            known = self._read[line.packed] if line.packed in self._read else _read(line.packed)
            read[line.packed] = known
            if known is not None:
                of[line.station, line.number] = known
        self._read, self._of = read, of

    def of(self, other: OtherVehicle) -> PlanLine | None:
        """What it flies now; None: not known, or it is not on it, or holds."""
        known = self._of.get((other.station, other.it.number))
        if known is None or other.it.line_s is None or known[0] != other.it.line:
            return None
        return None if off_line_m(known[1], other.it) is None else known[1]


def _read(payload: bytes) -> tuple[int, PlanLine] | None:
    """None: of a node of another version, or so wrong that it says nothing; its vehicle only flies straight on."""
    try:
        line = unpacked(payload)
    except StationsError:
        return None
    return (line_id(payload), line) if line.error_m <= MOST_ERROR_M else None


def off_line_m(line: PlanLine, it: FleetVehicle) -> float | None:
    """From where it is told to be to where its line is at that time, by place and height above the sea; None: either is
    not known, or it is farther off than one that flies it can be."""
    if it.line_s is None or it.lat_deg is None or it.lon_deg is None or it.alt_amsl_m is None:
        return None
    lat_deg, lon_deg = (float(np.interp(it.line_s, line.t_s, line.lat_lon_deg[:, axis])) for axis in (0, 1))
    up_m = float(np.interp(it.line_s, line.t_s, line.alt_amsl_m)) - it.alt_amsl_m
    off_m = math.hypot(*offset_m((it.lat_deg, it.lon_deg), lat_deg, lon_deg), up_m)
    return off_m if off_m <= OFF_LINE_M + line.error_m else None


def ahead_of(line: PlanLine, line_s: float) -> tuple[Ahead, float] | None:
    """What is left of it, with heights above the sea, and its highest speed; None: nothing is left."""
    first = int(np.searchsorted(line.t_s, line_s, side="right"))
    if first >= len(line.t_s):
        return None
    left = Ahead(line.lat_lon_deg[first:], line.alt_amsl_m[first:], line.t_s[first:] - line_s)
    return left, _fastest_m_s(line)


def _steps(line: PlanLine) -> tuple[F64, F64]:
    """(N - 1, 3) east, north, up from point to point, and the seconds that they take."""
    lat_rad, lon_rad = np.radians(line.lat_lon_deg).T
    east_m = MEAN_RADIUS_M * np.cos(lat_rad[:-1]) * np.diff(lon_rad)
    steps_m = np.column_stack([east_m, MEAN_RADIUS_M * np.diff(lat_rad), np.diff(line.alt_amsl_m)])
    return steps_m, np.maximum(np.diff(line.t_s), _SHORTEST_S)


def _fastest_m_s(line: PlanLine) -> float:
    steps_m, took_s = _steps(line)
    return float(np.max(np.linalg.norm(steps_m, axis=1) / took_s, initial=0.0))
