"""Where the map lies, and where the vehicle is in it: from vehicle states to metres east, north and up of home."""

from __future__ import annotations

import math

from mapping.geometry.frames import LocalFrame, apart_m
from telemetry.perception.convert import frame_of
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.vehicle import VehicleState

NEW_HOME_M, NEW_HEIGHT_M = 1.0, 0.5
"""Home is another one when it has moved by more than this; less is a receiver's breathing."""
_NO_FIX = frozenset({"no_fix", "2d"})
_FIX_COUNTS_S = 3.0
_CLEAR_OF_GROUND_M = 1.0


class Whereabouts:
    """Of one vehicle. ``origin`` is None until a home is known."""

    def __init__(self) -> None:
        self.origin: MapOrigin | None = None
        self.frame: LocalFrame | None = None
        self.position: tuple[float, float, float] | None = None
        """The last one, east, north and up."""
        self.speed_m_s = 0.0
        self._home_alt_amsl_m = 0.0

    def on_state(self, state: VehicleState) -> bool:
        """Whether home has become another one."""
        home = home_of(state)
        if home is None:
            return False
        self._home_alt_amsl_m = home.alt_amsl_m
        if self.origin is not None and not _differ(self.origin, home):
            return False
        self.origin, self.frame = home, frame_of(home)
        return True

    def position_enu_m(self, state: VehicleState) -> tuple[float, float, float] | None:
        """East and north from the coordinates, up from the height above home."""
        if self.frame is None or self.origin is None or state.lat_deg is None or state.lon_deg is None:
            return None
        if state.alt_rel_home_m is not None:
            up_m = state.alt_rel_home_m + self._home_alt_amsl_m - self.origin.alt_amsl_m
        elif state.alt_amsl_m is not None:
            up_m = state.alt_amsl_m - self.origin.alt_amsl_m
        else:
            return None
        east, north, _ = self.frame.to_enu(state.lat_deg, state.lon_deg, self.origin.alt_amsl_m)[0]
        self.speed_m_s = state.ground_speed_m_s or 0.0
        self.position = (float(east), float(north), up_m)
        return self.position


def home_of(state: VehicleState) -> MapOrigin | None:
    """As the vehicle reports it; its height, where it reports none, from the two heights that it flies at."""
    lat, lon, alt = state.home_lat_deg, state.home_lon_deg, state.home_alt_amsl_m
    if alt is None and state.alt_amsl_m is not None and state.alt_rel_home_m is not None:
        alt = state.alt_amsl_m - state.alt_rel_home_m
    if lat is None or lon is None or alt is None or not all(map(math.isfinite, (lat, lon, alt))):
        return None
    return MapOrigin(lat, lon, alt)


def velocity_enu_m_s(state: VehicleState) -> tuple[float, float, float] | None:
    east, north, down = state.v_east_m_s, state.v_north_m_s, state.v_down_m_s
    return None if east is None or north is None or down is None else (east, north, -down)


def has_fix(state: VehicleState) -> bool:
    """Whether the receiver vouches for the position; a vehicle that says nothing of its receiver is believed."""
    told, position = state.gnss_t_mono_s, state.position_t_mono_s
    if told is None or position is None or position - told > _FIX_COUNTS_S:
        return True
    return state.gnss_fix not in _NO_FIX


def is_flying(state: VehicleState) -> bool:
    """Clear of the ground: while it takes off and lands, everything that stands around is near."""
    if not state.armed:
        return False
    if state.landed is None:
        return (state.alt_rel_home_m or 0.0) > _CLEAR_OF_GROUND_M
    return state.landed == "in_air"


def _differ(one: MapOrigin, other: MapOrigin) -> bool:
    away_m = apart_m((one.lat_deg, one.lon_deg), (other.lat_deg, other.lon_deg))
    return away_m > NEW_HOME_M or abs(other.alt_amsl_m - one.alt_amsl_m) > NEW_HEIGHT_M
