"""The line that a multicopter really flies through mission items, as its autopilot reads them.

ArduPilot's conventions: a take-off rises over home whatever its coordinates say; latitude and longitude
0, 0 (or not given) keep the present place and an altitude that is stored as 0 cm keeps the present
height; a landing item with coordinates is approached at the present height. PX4 differs in flying on
to a take-off item's coordinates and in taking an altitude of 0 as it is.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.mav_cmd import AMSL_FRAMES, HOME_FRAMES, TERRAIN_FRAMES, MavCmd
from planning.basics.plan_model import FlownLine, Mission, MissionItem, Unjudged
from planning.certificate.commands import BENT, OTHER_UNJUDGED, STRAIGHT, TAKEOFFS, UNKNOWN, stays
from planning.errors import MissionError
from planning.terrain.dsm import Dsm
from planning.terrain.vertical_datum import is_amsl

STORED_ALTITUDE_M = 0.01
"""ArduPilot keeps whole centimetres and cuts the rest off."""
LARGEST_STORED_M = 80_000.0
"""Beyond it centimetres do not fit the vehicle's 24 bits: no flight, left as it is for the judge to refuse."""
HOME_TOLERANCE_M = 1.0
RELATIVE = "Give the height above home (frame 3) instead."
PLACED = STRAIGHT | TAKEOFFS | frozenset(BENT) | {MavCmd.NAV_LAND}


def flown_line(mission: Mission, dsm: Dsm, *, begins_in_air: bool = False) -> FlownLine:
    """The polyline flown through a mission's items, in the surface model's CRS and vertical datum.

    ``begins_in_air``: the vehicle hovers at the first item's place, and there is no take-off.
    Items that cannot be judged are named in ``unjudged``, never skipped in silence; the line then shows
    the straight line to their place where they have one. Raises MissionError when home or an item
    cannot be placed at all, or nothing is flown.
    """
    xy_m = _item_places(mission, dsm)
    flight = _Flight(mission, dsm, xy_m, begins_in_air=begins_in_air)
    for index, item in enumerate(mission.items):
        flight.fly(index, item)
    return flight.line()


def _item_places(mission: Mission, dsm: Dsm) -> F64:
    """(N, 2) projected places; NaN where an item gives none."""
    asked = [_coordinates(i, item) if item.command in PLACED else None for i, item in enumerate(mission.items)]
    return _projected([(math.nan, math.nan) if at is None else at for at in asked], dsm)


def _projected(lat_lon_deg: list[tuple[float, float]], dsm: Dsm) -> F64:
    given = np.array(lat_lon_deg, dtype=np.float64).reshape(-1, 2)
    xy_m = np.full(given.shape, np.nan)
    known = ~np.isnan(given[:, 0])
    xy_m[known] = dsm.xy_from_lat_lon(given[known])
    lost = known & ~np.isfinite(xy_m).all(axis=1)
    if lost.any():
        lat, lon = given[np.argmax(lost)]
        raise MissionError(
            f"{lat:.7f}, {lon:.7f} cannot be placed in the surface model's CRS ({dsm.crs.name}).",
            advice="Check that the mission belongs to this surface model.",
        )
    return xy_m


def _coordinates(index: int, item: MissionItem) -> tuple[float, float] | None:
    """(lat_deg, lon_deg), None when the item keeps the present place."""
    return _given(item.lat_deg, item.lon_deg, f"Item {index + 1}")


def _given(lat_deg: float, lon_deg: float, where: str) -> tuple[float, float] | None:
    if (math.isnan(lat_deg) and math.isnan(lon_deg)) or (lat_deg == 0.0 and lon_deg == 0.0):
        return None
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
        raise MissionError(
            f"{lat_deg}, {lon_deg} is not a place on Earth.",
            where=where,
            advice="Latitude lies in -90..90, longitude in -180..180 degrees.",
        )
    return lat_deg, lon_deg


def _stored_m(alt_m: float) -> float:
    """What ArduPilot makes of an altitude: it comes as float32 and is cut to whole centimetres, towards zero."""
    if abs(alt_m) > LARGEST_STORED_M:
        return alt_m
    return math.trunc(float(np.float32(alt_m) * np.float32(100.0))) / 100.0


class _Flight:
    """Where the vehicle is, and the line so far, while the items are gone through."""

    def __init__(self, mission: Mission, dsm: Dsm, item_xy_m: F64, *, begins_in_air: bool) -> None:
        self.ardupilot = mission.firmware == "ardupilot"
        self.item_xy_m, self.begins_in_air = item_xy_m, begins_in_air
        self.absolute = is_amsl(dsm.vertical_datum)
        self.datum = dsm.vertical_datum or "unknown"
        self.unjudged: list[Unjudged] = []
        self.notes: list[str] = []
        self.fence, self.rally = mission.fence, mission.rally
        self.home_xy_m = self._home_place(mission, dsm)
        self.home_alt_m = self._home_altitude(mission, dsm)
        self.points: list[tuple[float, float, float]] = []
        self.leg_item: list[int] = []
        self.first_item = 0
        self.ended_by: int | None = None
        self.landing_xy_m: tuple[float, float] | None = None

    def _home_place(self, mission: Mission, dsm: Dsm) -> tuple[float, float]:
        home = _given(mission.home.lat_deg, mission.home.lon_deg, "Home")
        if home is not None:
            x, y = _projected([home], dsm)[0]
            return float(x), float(y)
        placed = np.flatnonzero(~np.isnan(self.item_xy_m[:, 0]))
        if len(placed) == 0:
            raise MissionError("The mission names neither a home nor a place.", advice="Add a home position.")
        self.notes.append(f"The mission names no home: the place of item {placed[0] + 1} was taken for it.")
        x, y = self.item_xy_m[placed[0]]
        return float(x), float(y)

    def _home_altitude(self, mission: Mission, dsm: Dsm) -> float:
        ground_m = float(dsm.elevation_at(np.array([self.home_xy_m]))[0])
        home = mission.home
        same_datum = home.vertical_datum is not None and (
            home.vertical_datum == dsm.vertical_datum or (self.absolute and is_amsl(home.vertical_datum))
        )
        known = same_datum and math.isfinite(home.alt_dsm_m)
        if not math.isfinite(ground_m):
            if not known:
                raise MissionError(
                    "Home lies outside the surface model or on unknown terrain: nothing tells its altitude.",
                    advice="Choose a home on known terrain, or check that mission and surface model belong together.",
                )
            self.notes.append("The surface model does not know home: its altitude is the mission's.")
            return home.alt_dsm_m
        if known and abs(home.alt_dsm_m - ground_m) > HOME_TOLERANCE_M:
            self.notes.append(
                f"The mission puts home at {home.alt_dsm_m:.2f} m, the surface model at {ground_m:.2f} m:"
                " altitudes relative to home were placed on the surface model."
            )
        return ground_m

    def fly(self, index: int, item: MissionItem) -> None:
        if stays(item.command):
            return
        if self.ended_by is not None:
            number = self.ended_by + 1
            self._cannot_judge(
                index,
                item,
                f"comes after item {number}, which ends the flight",
                f"Remove what comes after item {number}.",
            )
        elif item.command in TAKEOFFS:
            self._take_off(index, item)
        elif item.command in STRAIGHT:
            self._go(index, item)
        elif item.command in BENT:
            what, mend = BENT[item.command]
            self._cannot_judge(index, item, f"{what}, which is no straight line", mend)
            self._go(index, item)
        elif item.command in (MavCmd.NAV_LAND, MavCmd.NAV_RETURN_TO_LAUNCH):
            self._end(index, item)
        else:
            self._cannot_judge(index, item, *OTHER_UNJUDGED.get(item.command, UNKNOWN))

    def _take_off(self, index: int, item: MissionItem) -> None:
        if self.points or self.begins_in_air:
            self._cannot_judge(index, item, "is a take-off in flight", "Remove it: one take-off begins the mission.")
            return
        alt_m = self._altitude(index, item, present_m=self.home_alt_m)
        if alt_m <= self.home_alt_m:
            what = "is a take-off to a height that is not above home"
            self._cannot_judge(index, item, what, "Give it the height above home to climb to.")
        self.points.append((*self.home_xy_m, alt_m))
        self.first_item = index
        if not self.ardupilot and not math.isnan(self.item_xy_m[index, 0]):
            self._leg(index, self._place(index), alt_m)

    def _go(self, index: int, item: MissionItem) -> None:
        if not self.points and self.begins_in_air and not math.isnan(self.item_xy_m[index, 0]):
            self.points.append((*self._place(index), self._altitude(index, item, present_m=self.home_alt_m)))
            self.first_item = index
            return
        if not self.points:
            what = "comes before any take-off: how the vehicle gets there is unknown"
            self._cannot_judge(index, item, what, "Begin the mission with a take-off.")
            alt_m = self._altitude(index, item, present_m=self.home_alt_m)
            self.points.append((*self.home_xy_m, alt_m))
            self.first_item = index
        else:
            alt_m = self._altitude(index, item, present_m=self._present_m)
        self._leg(index, self._place(index), alt_m)

    def _end(self, index: int, item: MissionItem) -> None:
        self.ended_by = index
        if item.command == MavCmd.NAV_LAND and self.points:
            self.landing_xy_m = self._place(index)
            self._leg(index, self.landing_xy_m, self._present_m)

    def _place(self, index: int) -> tuple[float, float]:
        x, y = self.item_xy_m[index]
        return self.points[-1][:2] if math.isnan(x) else (float(x), float(y))

    @property
    def _present_m(self) -> float:
        return self.points[-1][2]

    def _altitude(self, index: int, item: MissionItem, *, present_m: float) -> float:
        """Altitude in the surface model's datum; the present one, and a reason, where it cannot be told."""
        if not math.isfinite(item.alt_m):
            raise MissionError(
                f"The altitude is {item.alt_m}.", where=f"Item {index + 1}", advice="Every place needs an altitude."
            )
        if item.frame in TERRAIN_FRAMES:
            what = "follows the autopilot's own terrain data (frame above terrain)"
            self._cannot_judge(index, item, what, RELATIVE)
        elif item.frame in AMSL_FRAMES and not self.absolute:
            what = f"is given above mean sea level, but the surface model's vertical datum is {self.datum}"
            self._cannot_judge(
                index, item, what, "Name the model's vertical datum, or give heights above home (frame 3)."
            )
        elif item.frame not in AMSL_FRAMES + HOME_FRAMES:
            self._cannot_judge(index, item, f"uses frame {item.frame}", RELATIVE)
        elif not (self.ardupilot and abs(item.alt_m) < STORED_ALTITUDE_M):
            alt_m = _stored_m(item.alt_m) if self.ardupilot else item.alt_m
            return alt_m if item.frame in AMSL_FRAMES else self.home_alt_m + alt_m
        return present_m

    def _cannot_judge(self, index: int, item: MissionItem, why: str, mend: str) -> None:
        self.unjudged.append(Unjudged(f"{why}.", mend, index, item.command))

    def _leg(self, index: int, xy_m: tuple[float, float], alt_m: float) -> None:
        point = (*xy_m, alt_m)
        if point != self.points[-1]:
            self.points.append(point)
            self.leg_item.append(index)

    def line(self) -> FlownLine:
        if not self.points:
            raise MissionError("The mission never leaves the ground.", advice="Add a take-off and a waypoint.")
        takeoff_alt_m = self.points[0][2]
        if not self.leg_item:  # up and down again: one leg without length at the top of the column
            self.points.append(self.points[0])
            self.leg_item.append(self.first_item)
        return FlownLine(
            points_m=np.array(self.points, dtype=np.float64),
            leg_item=np.array(self.leg_item, dtype=np.int64),
            home_xy_m=self.home_xy_m,
            home_alt_dsm_m=self.home_alt_m,
            takeoff_alt_dsm_m=takeoff_alt_m,
            ends_with_rtl=self.ended_by is not None and self.landing_xy_m is None,
            unjudged=tuple(self.unjudged),
            landing_xy_m=self.landing_xy_m,
            notes=tuple(self.notes),
            fence=self.fence,
            rally=self.rally,
            returns_above_rally=not self.ardupilot,
        )
