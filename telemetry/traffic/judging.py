"""One aircraft held against the vehicle: where it is by now, how near it comes; at the worse end, whether too near."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mapping.geometry.frames import moved_deg, offset_m
from planning.following.zones import Zone, closest, first_inside
from telemetry.topics.traffic import OLD_S, Aircraft, TrafficSettings, Trust
from telemetry.traffic.memory import Heard
from telemetry.traffic.own import Own
from telemetry.traffic.report import Position

VEER_SHARE = 0.2
"""Of its speed: so much farther from where it should be an aircraft may get in each second by turning."""
UNTOLD_M = 200.0
"""Horizontal error of a position that comes without one."""
CREWED_M_S, DRONE_M_S = 129.0, 45.0
"""Where none is told: 250 kt, the limit below 10,000 ft, and 100 mph, that of drones in the USA."""
CLIMB_SPREAD_M_S, UNTOLD_CLIMB_M_S = 2.5, 10.0
"""By what a climb may change, and what it may be where none is told (2,000 ft/min)."""
PRESSURE_M, PRESSURE_SHARE = 550.0, 0.15
"""What a barometer's height may be off by: the pressure at sea level lies between 950 and 1050 hPa, and the air may be
colder or warmer by a seventh of its absolute temperature than the standard's."""
GEOID_M = 110.0
"""The sea's level lies no farther from the ellipsoid anywhere (EGM96: -107 to 86 m)."""
UNTOLD_ALT_M = 30.0
AWAY_SHARE = 0.25
"""Of the warning distance: what is farther and going away is no conflict."""


@dataclass(frozen=True, slots=True)
class Height:
    """Above the vehicle."""

    up_m: float
    within_m: float


def judged(
    heard: Heard,
    position: Position,
    own: Own | None,
    settings: TrafficSettings,
    now_s: float,
    *,
    own_numbers: frozenset[str] = frozenset(),
) -> Aircraft:
    """``own_numbers``: keys and names under which the vehicle itself is told of. Alone where ``own`` is unknown."""
    age_s = max(0.0, now_s - heard.at_s)
    velocity = _velocity(position)
    v_east, v_north = velocity or (0.0, 0.0)
    lat_deg, lon_deg = _wrapped(moved_deg((position.lat_deg, position.lon_deg), v_east * age_s, v_north * age_s))
    spread_m_s = _spread_m_s(heard, position)
    within_m = (UNTOLD_M if position.within_m is None else position.within_m) + spread_m_s * age_s
    alone = Aircraft(
        key=heard.key,
        source=heard.source,
        name=heard.name or heard.key.partition(" ")[2],
        kind=heard.kind,
        trust="other",
        on_ground=position.on_ground,
        emergency=position.emergency,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        age_s=age_s,
        within_m=within_m,
        velocity_enu_m_s=velocity,
        climb_m_s=position.climb_m_s,
        alt_m=position.alt_m,
        alt_datum=position.alt_datum,
        operator_deg=heard.operator_deg,
    )
    if own is None:
        return replace(alone, trust="own" if heard.says_own else "other")
    trust = _trust(heard, position, own, own_numbers, age_s)
    return _against(replace(alone, trust=trust), position, own, settings, spread_m_s)


def _against(it: Aircraft, position: Position, own: Own, settings: TrafficSettings, spread_m_s: float) -> Aircraft:
    east_m, north_m = offset_m((own.lat_deg, own.lon_deg), it.lat_deg, it.lon_deg)
    distance_m = math.hypot(east_m, north_m)
    height = _height(it, position, own)
    up_m = 0.0 if height is None else height.up_m
    v_east, v_north = it.velocity_enu_m_s or (0.0, 0.0)
    closing_m_s = closest_m = closest_in_s = None
    if it.velocity_enu_m_s is not None and own.v_east_m_s is not None and own.v_north_m_s is not None:
        relative = (v_east - own.v_east_m_s, v_north - own.v_north_m_s, 0.0)
        closest_m, closest_in_s = closest((east_m, north_m, 0.0), relative)
        closing_m_s = -(east_m * relative[0] + north_m * relative[1]) / distance_m if distance_m > 0 else 0.0
    # The vehicle may turn at its next waypoint: it is somewhere in a ball that grows with its speed.
    own_m = own.within_m + own.age_s * own.speed_m_s
    own_climb_m_s = CLIMB_SPREAD_M_S if own.climb_m_s is None else abs(own.climb_m_s)
    zone = Zone(
        settings.warn_distance_m + it.within_m + own_m,
        math.inf if height is None else settings.warn_height_m + height.within_m,
        spread_m_s + own.speed_m_s,
        _climb_spread_m_s(position) + own_climb_m_s,
    )
    inside_s = first_inside(
        (east_m, north_m, up_m), (v_east, v_north, it.climb_m_s or 0.0), zone, settings.look_ahead_s
    )
    is_away = closing_m_s is not None and closing_m_s < 0 and it.age_s <= OLD_S
    is_clear = is_away and distance_m > AWAY_SHARE * settings.warn_distance_m
    return replace(
        it,
        distance_m=distance_m,
        bearing_deg=math.degrees(math.atan2(east_m, north_m)) % 360.0,
        height_m=None if height is None else height.up_m,
        height_within_m=0.0 if height is None else height.within_m,
        closing_m_s=closing_m_s,
        closest_m=closest_m,
        closest_in_s=closest_in_s,
        conflict=it.trust == "other" and not it.on_ground and inside_s is not None and not is_clear,
    )


def shown(it: Aircraft, settings: TrafficSettings) -> bool:
    """What may come too near in any case; what is unknown of the rest counts as near."""
    if it.conflict:
        return True
    is_near = it.distance_m is None or it.distance_m <= settings.show_distance_m
    is_level = it.height_m is None or abs(it.height_m) - it.height_within_m <= settings.show_height_m
    return is_near and is_level


def _velocity(position: Position) -> tuple[float, float] | None:
    if position.speed_m_s == 0:
        return 0.0, 0.0
    if position.speed_m_s is None or position.course_rad is None:
        return None
    return position.speed_m_s * math.sin(position.course_rad), position.speed_m_s * math.cos(position.course_rad)


def _spread_m_s(heard: Heard, position: Position) -> float:
    if position.speed_m_s is None:
        return CREWED_M_S if heard.is_crewed else DRONE_M_S
    return (VEER_SHARE if _velocity(position) is not None else 1.0) * position.speed_m_s


def _climb_spread_m_s(position: Position) -> float:
    return UNTOLD_CLIMB_M_S if position.climb_m_s is None else CLIMB_SPREAD_M_S


def _height(it: Aircraft, position: Position, own: Own) -> Height | None:
    """None where either height is unknown."""
    if position.alt_m is None or own.alt_amsl_m is None:
        return None
    up_m = position.alt_m - own.alt_amsl_m
    within_m = own.alt_within_m + (UNTOLD_ALT_M if position.alt_within_m is None else position.alt_within_m)
    match position.alt_datum, own.geoid_m:
        case "ellipsoid", None:
            within_m += GEOID_M
        case "ellipsoid", geoid_m:
            up_m -= geoid_m or 0.0
        case "gnss", None:
            within_m += GEOID_M
        case "gnss", geoid_m:
            # Half way between what it would be from either level.
            up_m -= (geoid_m or 0.0) / 2
            within_m += abs(geoid_m or 0.0) / 2
        case _:
            within_m += PRESSURE_M + PRESSURE_SHARE * max(0.0, position.alt_m)
    within_m += _climb_spread_m_s(position) * it.age_s
    return Height(up_m + (position.climb_m_s or 0.0) * it.age_s, within_m)


def _trust(heard: Heard, position: Position, own: Own, own_numbers: frozenset[str], age_s: float) -> Trust:
    has_own_number = heard.says_own or bool({heard.key, heard.name} & own_numbers)
    if has_own_number and own.is_here(position, age_s):
        return "own"
    return "echo" if heard.always_here and heard.places > 0 else "other"


def _wrapped(place_deg: tuple[float, float]) -> tuple[float, float]:
    """Led on across a pole or the date line."""
    lat_deg, lon_deg = place_deg
    return min(90.0, max(-90.0, lat_deg)), (lon_deg + 180.0) % 360.0 - 180.0
