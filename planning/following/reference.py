"""The line that a flight is held against: where the mission leads, and when the vehicle should be there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from affine import Affine
from pyproj import CRS

from mapping.geometry.arrays import F64, I64
from mapping.geometry.polyline import along_m
from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import FlownLine, Mission, VehicleProfile
from planning.certificate.unjudged import unjudged_words
from planning.errors import MissionError
from planning.flight_time.predict import WAYPOINT_RADIUS_M, PredictedTime, predict_duration
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm


@dataclass(frozen=True, slots=True)
class Reference:
    """The planned line of a mission from the top of the take-off to the last waypoint, with its predicted times."""

    points_m: F64
    """(K, 3) x, y, alt_dsm, in the surface model's CRS and datum."""
    s_m: F64
    """(K,) horizontal distance flown up to each point."""
    leg_item: I64
    """(K - 1,) index into ``Mission.items`` of the item that each leg flies to."""
    arrive_s: F64
    """(K,) predicted seconds since lift-off at which each point is reached; NaN where nothing predicts it."""
    leave_s: F64
    """(K,) the same for leaving it, once a hold is over."""
    takeoff_s: float
    """Predicted from lift-off to leaving the first waypoint; NaN when unknown."""
    flight_s: float
    """Predicted from the first waypoint to the last; NaN when unknown."""
    total_s: float
    """Predicted from lift-off to touchdown; NaN when unknown."""
    home_xy_m: tuple[float, float]
    home_alt_dsm_m: float
    first_item: int
    """Index of the first item that is a place to fly to, and of the last one."""
    last_item: int
    first_m: tuple[float, float, float]
    """x, y, alt_dsm of the first waypoint: where what is judged begins."""
    whole: bool = True
    """False: the line ends at a waypoint that is not the mission's last."""
    notes: tuple[str, ...] = ()
    """What had to be assumed, and why there are no times if there are none."""

    @property
    def length_m(self) -> float:
        return float(self.s_m[-1])

    def ending_at(self, item: int) -> Reference:
        """The line up to an item: of a flight that was never led on from there. The same when none leads there."""
        legs = np.flatnonzero(self.leg_item == item)
        if not len(legs) or legs[-1] + 1 == len(self.leg_item):
            return self
        end = int(legs[-1]) + 1
        return replace(
            self,
            points_m=self.points_m[: end + 1],
            s_m=self.s_m[: end + 1],
            leg_item=self.leg_item[:end],
            arrive_s=self.arrive_s[: end + 1],
            leave_s=self.leave_s[: end + 1],
            flight_s=float(self.leave_s[end] - self.takeoff_s),
            last_item=item,
            whole=False,
        )


def reference_line(
    mission: Mission,
    dsm: Dsm,
    profile: VehicleProfile,
    *,
    waypoint_radius_m: float = WAYPOINT_RADIUS_M,
    begins_in_air: bool = False,
) -> Reference:
    """The reference of a mission over a surface model. Raises MissionError when no line can be told from it.

    ``begins_in_air``: it was taken up in flight, and begins at its first item's place.
    Times are left unknown, with a note, when the mission's duration cannot be predicted.
    """
    line = flown_line(mission, dsm, begins_in_air=begins_in_air)
    notes = [*line.notes, *(text for text, _ in unjudged_words(line.unjudged))]
    predicted: PredictedTime | None = None
    try:
        placed = replace(mission, home=replace(mission.home, alt_dsm_m=line.home_alt_dsm_m))
        predicted = predict_duration(placed, profile, dsm, waypoint_radius_m=waypoint_radius_m)
    except MissionError as error:
        notes.append(f"The plan's times are not known: {error.what}")
    arrive_s, leave_s = _times(mission, line, predicted)
    first_item, first_m = _first_waypoint(mission, line)
    return Reference(
        points_m=line.points_m,
        s_m=along_m(line.points_m[:, :2]),
        leg_item=line.leg_item,
        arrive_s=arrive_s,
        leave_s=leave_s,
        takeoff_s=predicted.takeoff_s if predicted else math.nan,
        flight_s=predicted.flight_s if predicted else math.nan,
        total_s=predicted.total_s if predicted else math.nan,
        home_xy_m=line.home_xy_m,
        home_alt_dsm_m=line.home_alt_dsm_m,
        first_item=first_item,
        last_item=int(line.leg_item[-1]),
        first_m=first_m,
        notes=tuple(notes),
    )


def level_model(mission: Mission) -> Dsm:
    """A level stand-in for a surface model nobody has, around home: distances along the ground are true in it.

    Its height is the home altitude where the mission gives one, else 0.
    """
    lat_deg, lon_deg = mission.home.lat_deg, mission.home.lon_deg
    if not (math.isfinite(lat_deg) and math.isfinite(lon_deg)):
        raise MissionError("The mission names no home.", advice="Add a home position.")
    alt_m = mission.home.alt_dsm_m if math.isfinite(mission.home.alt_dsm_m) else 0.0
    crs = CRS.from_proj4(f"+proj=tmerc +lat_0={lat_deg} +lon_0={lon_deg} +k=1 +datum=WGS84 +units=m +type=crs")
    cells = np.full((2, 2), alt_m, dtype=np.float32)
    return Dsm(cells, Affine(1.0, 0.0, -1.0, 0.0, -1.0, 1.0), crs, mission.home.vertical_datum, "")


def _times(mission: Mission, line: FlownLine, predicted: PredictedTime | None) -> tuple[F64, F64]:
    """(K,) arrival and departure; what was predicted of waypoint to waypoint, put on the line's points."""
    arrive_s, leave_s = np.full((2, len(line.points_m)), math.nan)
    if predicted is None:
        return arrive_s, leave_s
    waypoints = [k for k, item in enumerate(mission.items) if item.command == MavCmd.NAV_WAYPOINT]
    gone_s = predicted.takeoff_s + np.concatenate([[0.0], np.cumsum(predicted.per_leg_s)])
    point = {int(item): k + 1 for k, item in enumerate(line.leg_item)}
    at = 0
    for item, left_s in zip(waypoints, gone_s.tolist(), strict=False):
        at = point.get(item, at)  # no leg leads to a waypoint at the place before it: only the stay there is longer
        hold_s = max(0.0, mission.items[item].params[0])
        if math.isnan(arrive_s[at]):
            arrive_s[at] = left_s - hold_s
        leave_s[at] = left_s
    if math.isnan(arrive_s[0]):
        arrive_s[0] = leave_s[0] = 0.0
    return arrive_s, leave_s


def _first_waypoint(mission: Mission, line: FlownLine) -> tuple[int, tuple[float, float, float]]:
    """The first item that is flown to after the take-off, and its place on the line."""
    first = next(
        (k for k, item in enumerate(mission.items) if item.command == MavCmd.NAV_WAYPOINT), int(line.leg_item[0])
    )
    legs_to = np.flatnonzero(line.leg_item == first)
    x, y, alt_m = line.points_m[legs_to[0] + 1 if len(legs_to) else 0]
    return first, (float(x), float(y), float(alt_m))
