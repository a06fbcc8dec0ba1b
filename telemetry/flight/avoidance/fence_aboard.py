"""The fence on board, as the last read-back told it: no way of avoidance's own leads beyond it.

Distances are horizontal and as the autopilot counts them: in metres on a sphere around the vehicle, edges straight in
latitude and longitude, circles taken as much worse as the certificate takes them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import get_args

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from planning.basics.plan_model import Firmware
from planning.errors import FormatError
from planning.fence.distance import one_to_polygon, to_circle
from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, LatLon
from planning.fence.judge import CIRCLE_SHARE, named_shapes
from planning.formats.fence_items import fence_of
from telemetry.flight.fence_actions import CEILING_BIT, CIRCLE_BIT, is_switched_on
from telemetry.flight.fence_heights import ABOVE_HOME, heights_aboard
from telemetry.flight.fence_kinds import KindsSeen
from telemetry.flight.fence_radius import NAMES as RADIUS_NAMES
from telemetry.flight.fence_radius import circle_aboard, radius_aboard_m
from telemetry.mavlink.items import mission_items
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.onboard_lists import Item
from telemetry.topics.vehicle import VehicleState

PARAMETERS = (
    *("FENCE_ENABLE", "FENCE_AUTOENABLE", "FENCE_TYPE", "FENCE_ALT_MAX", "FENCE_ALT_MIN", "FENCE_ALT_MAX_TP"),
    *("FENCE_RADIUS", "GF_ACTION", "GF_MAX_VER_DIST", "GF_MAX_HOR_DIST"),
)
"""ArduPilot's and PX4's: a vehicle has those of one."""
FIRMWARES: tuple[Firmware, ...] = get_args(Firmware)
AUTOENABLE, COUNTED = "FENCE_AUTOENABLE", "FENCE_ALT_MAX_TP"
"""Not every ArduPilot has them: to be asked and told nothing is to be told."""
_MEANS = {
    AUTOENABLE: "whether it comes on by itself",
    "FENCE_TYPE": "its kinds",
    "FENCE_ALT_MAX": "its ceiling",
    COUNTED: "what its ceiling counts from",
    "FENCE_RADIUS": "its circle around home",
    "GF_MAX_VER_DIST": "its ceiling",
    "GF_MAX_HOR_DIST": "its circle around home",
}
SAME_M = 0.01
"""Who is nearer than the margin already may go on so near."""


@dataclass(frozen=True, slots=True)
class _Shape:
    name: str
    lat_lon_deg: F64
    """(N, 2) corners, or (1, 2) the centre of a circle."""
    inclusion: bool
    radius_m: float | None

    def distance_m(self, triangle_deg: Sequence[LatLon]) -> float:
        """From a triangle to what is forbidden; 0 within it."""
        origin = triangle_deg[0]
        triangle_m = np.array([offset_m(origin, *place) for place in triangle_deg])
        places_m = np.column_stack(offset_m(origin, *self.lat_lon_deg.T))
        if self.radius_m is None:
            return one_to_polygon(triangle_m, places_m, inclusion=self.inclusion)
        found = to_circle(triangle_m[None], places_m[0], self.radius_m, inclusion=self.inclusion)
        return float(found.distance_m[0])

    def is_come_back_to(self, here: LatLon, triangle: Sequence[LatLon], margin_m: float) -> bool:
        """From beyond a circle that is not to be left a way that only comes closer to its middle until it is well
        inside: every part of the triangle, each of whose edges may be flown."""
        if self.radius_m is None or not self.inclusion:
            return False
        middle = (float(self.lat_lon_deg[0, 0]), float(self.lat_lon_deg[0, 1]))
        here_m, *places_m = [np.array(offset_m(middle, *place)) for place in (here, *triangle)]
        if max(float(np.hypot(*place_m)) for place_m in places_m) > float(np.hypot(*here_m)) + SAME_M:
            return False
        inside_m = self.radius_m - margin_m
        ends = ((0, 1), (1, 2), (0, 2))
        return all(
            float(np.hypot(*places_m[b])) <= inside_m
            or float(np.dot(places_m[b] - places_m[a], places_m[b])) <= SAME_M * SAME_M
            for a, b in ends
        )


class FenceAboard:
    """``margin_m``: how far the vehicle's outermost point may be from where it is said to be."""

    def __init__(self) -> None:
        self.margin_m = 0.0
        self.unknown = "has not been read back"
        """Why nobody knows the fence; empty once it is known."""
        self._shapes: tuple[_Shape, ...] = ()
        self._parameters: dict[str, float | None] = {}
        self.kinds = KindsSeen()

    def read_back(self, items: tuple[Item, ...]) -> None:
        try:
            fence = fence_of(mission_items(items), "the fence on board", [])
        except FormatError as error:
            self.forget(f"is not understood: {error.where}: {error.what}".rstrip("."))
            return
        self.unknown, self._shapes = "", _shapes(fence)

    def forget(self, why: str) -> None:
        self.unknown, self._shapes = why, ()

    def take(self, parameters: Mapping[str, float | None]) -> None:
        """Any that were read or written: its ceiling and its circle around home are among them."""
        self.kinds.take(parameters)
        told = {name: parameters[name] for name in PARAMETERS if name in parameters}
        self._parameters |= {n: None if v is None or not math.isfinite(v) else v for n, v in told.items()}

    def unread(self, state: VehicleState | None) -> str:
        """What its parameters do not tell, in words; empty: its ceiling and its circle around home are known."""
        for firmware in FIRMWARES:
            if is_switched_on(self._parameters, firmware) is not None:
                return self._unread_of(firmware, state)
        return "What the fence on board does by its parameters (ceiling, circle around home) has not been read"

    def _unread_of(self, firmware: Firmware, state: VehicleState | None) -> str:
        found: list[str] = []
        if missing := self._missing(firmware):
            names = ", ".join(f"{_MEANS[name]} ({name})" for name in missing)
            found.append(f"Of the fence on board was not read: {names}")
        if self._acts(firmware, CEILING_BIT) and (from_where := self._parameters.get(COUNTED)) not in (
            None,
            ABOVE_HOME,
        ):
            found.append(f"The ceiling of the fence on board does not count from home ({COUNTED} {from_where:g})")
        if radius_aboard_m(self._parameters, firmware) is not None and (state is None or _home(state) is None):
            found.append("Home, and with it the circle around it of the fence on board, is not known")
        return "; ".join(found)

    def _missing(self, firmware: Firmware) -> list[str]:
        """What has to be told besides to know its ceiling and its circle; only what acts is needed."""
        told = self._parameters
        if firmware == "px4":
            names = ("GF_MAX_VER_DIST", "GF_MAX_HOR_DIST") if told["GF_ACTION"] else ()
            return [name for name in names if told.get(name) is None]
        missing: list[str] = []
        if not is_switched_on(told, firmware):
            if AUTOENABLE in told:
                return []
            missing.append(AUTOENABLE)
        if told.get("FENCE_TYPE") is None:
            return [*missing, "FENCE_TYPE"]
        kinds = int(told["FENCE_TYPE"] or 0)
        needs = {"FENCE_ALT_MAX": CEILING_BIT, "FENCE_RADIUS": CIRCLE_BIT}
        missing += [name for name, bit in needs.items() if kinds & bit and told.get(name) is None]
        return missing + ([COUNTED] if kinds & CEILING_BIT and COUNTED not in told else [])

    def _acts(self, firmware: Firmware, bit: int) -> bool:
        """Of ArduPilot's kinds."""
        on = firmware == "ardupilot" and is_switched_on(self._parameters, firmware)
        return bool(on) and bool(int(self._parameters.get("FENCE_TYPE") or 0) & bit)

    @property
    def highest_m(self) -> float:
        """Above home, with the margin; inf where no ceiling is known to act."""
        found = (heights_aboard(self._parameters, firmware).ceiling_rel_home_m for firmware in FIRMWARES)
        return min((top_m - self.margin_m for top_m in found if top_m is not None), default=math.inf)

    def why_not_along(self, state: VehicleState, places: Sequence[GuidedTarget]) -> str:
        """Why a way from where the vehicle is would breach it, leg by leg; empty: it keeps inside."""
        here = _here(state)
        if here is None or not places:
            return ""
        way = [here, *((place.lat_deg, place.lon_deg) for place in places)]
        too_high = self.why_not_at(max(place.alt_rel_home_m for place in places))
        return too_high or next(filter(None, (self.why_not(state, (a, b, b)) for a, b in pairwise(way))), "")

    def why_not_at(self, alt_rel_home_m: float) -> str:
        if alt_rel_home_m <= self.highest_m + SAME_M:
            return ""
        return f"It would lead to {alt_rel_home_m:.1f} m; the fence on board allows {self.highest_m:.1f} m above home."

    def why_not(self, state: VehicleState, triangle: Sequence[LatLon]) -> str:
        """``triangle``: everything between three places, the way there included; ``state``: of the vehicle."""
        here = _here(state)
        if here is None:
            return ""
        for shape in (*self._shapes, *self._around(_home(state))):
            away_m = shape.distance_m(triangle)
            if away_m >= self.margin_m:
                continue
            here_m = shape.distance_m((here, here, here))
            if here_m <= 0.0 and shape.is_come_back_to(here, triangle, self.margin_m):
                continue
            if here_m <= 0.0:
                return f"The vehicle is beyond {shape.name} of the fence on board."
            if away_m <= 0.0:
                return f"It would {'leave' if shape.inclusion else 'enter'} {shape.name} of the fence on board."
            if away_m < here_m - SAME_M:
                what = f"It would come within {away_m:.1f} m of {shape.name} of the fence on board"
                return f"{what}; {self.margin_m:.1f} m are kept."
        return ""

    def _around(self, home: LatLon | None) -> tuple[_Shape, ...]:
        """The circle around the vehicle's home, by parameters."""
        found: list[_Shape] = []
        for firmware in FIRMWARES:
            name = f"the circle around home ({RADIUS_NAMES[firmware]})"
            found += [_shape(name, each) for each in circle_aboard(self._parameters, firmware, home).circles]
        return tuple(found)


def _shapes(fence: Fence) -> tuple[_Shape, ...]:
    return tuple(_shape(name, each) for name, each in named_shapes(fence))


def _shape(name: str, each: FencePolygon | FenceCircle) -> _Shape:
    if isinstance(each, FencePolygon):
        return _Shape(name, np.array(each.corners_lat_lon_deg), each.inclusion, None)
    share = -CIRCLE_SHARE if each.inclusion else CIRCLE_SHARE
    return _Shape(name, np.array([each.centre_lat_lon_deg]), each.inclusion, each.radius_m * (1.0 + share))


def _here(state: VehicleState) -> LatLon | None:
    return None if state.lat_deg is None or state.lon_deg is None else (state.lat_deg, state.lon_deg)


def _home(state: VehicleState) -> LatLon | None:
    lat_deg, lon_deg = state.home_lat_deg, state.home_lon_deg
    return None if lat_deg is None or lon_deg is None else (lat_deg, lon_deg)
