"""A judged way in hand: as it is told, flown to its end, looked along and judged again."""

from __future__ import annotations

import math
import secrets
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import apart_m, offset_m
from planning.guided.guided_model import RETURNS, Rally
from server.flying.apart.way_apart import Apart
from server.flying.in_flight.way_task import WayAsked, WayJudged
from server.heard.led_way import Places
from server.obstacles.surroundings import returns_from
from server.schemas import ReasonDoc, WayBody, WayDoc
from telemetry.flight.certified_way import way_notes
from telemetry.flight.guided.beginning import BEGINS_M
from telemetry.flight.home_watch import HomePlace
from telemetry.topics.messages import FlightStatus
from telemetry.topics.vehicle import VehicleState

SAME_M = 0.1
"""Two ways whose places are that near are the same."""
TAKE_OFF_M = 1.0
"""A climb that strays no farther to the side is the take-off."""
DOWN_M_S = 2.5
"""No landing here is faster."""


@dataclass(frozen=True, slots=True)
class InHand:
    doc: WayDoc
    judged: WayJudged
    judged_mono_s: float
    home: HomePlace | None
    """From which its heights count."""
    asked: WayAsked
    """What it was judged by."""
    apart: Apart
    flies_since_utc_s: float | None = None


def way_doc(judged: WayJudged, body: WayBody, over: str, notes: list[str], apart: Apart) -> WayDoc:
    way = judged.way
    problem = way.problem if way.problem == "way" or not apart.reasons else "others"
    reasons = [ReasonDoc(code=reason.code, text=reason.text, mend=reason.mend) for reason in way.certificate.reasons]
    return WayDoc(
        id=secrets.token_hex(8),
        action=body.action,
        problem=problem,
        notes=[*way_notes(way), *notes, *apart.notes],
        reasons=[*apart.reasons, *reasons] if problem == "others" else [*reasons, *apart.reasons],
        clearance_m=way.clearance_m if math.isfinite(way.clearance_m) else None,
        required_m=way.certificate.required_clearance_m,
        length_m=way.length_m,
        seconds=way.seconds,
        lands=isinstance(judged.wish, RETURNS),
        speed_m_s=judged.speed_m_s,
        most_m_s=judged.most_m_s,
        terrain_name=over,
        has_seen=judged.has_seen,
    )


def required_m(judged: WayJudged) -> float:
    return judged.way.certificate.required_clearance_m


def looked_along(judged: WayJudged, home: HomePlace | None) -> list[tuple[float, float]]:
    """(lat_deg, lon_deg) along the way, and along each return from anywhere on it that is certified with it."""
    places = [place[:2] for place in judged.way.places]
    ends = [] if home is None else [(home.lat_deg, home.lon_deg)]
    if judged.way.problem is None and not isinstance(judged.wish, RETURNS):
        return returns_from(places, [*ends, *judged.rally_deg], required_m(judged))
    return [*places, *ends]


def to_its_end(judged: WayJudged) -> tuple[Places, F64]:
    """Its places and the seconds until it is there; of one that lands, with the way down."""
    way, wish = judged.way, judged.wish
    if not isinstance(wish, RETURNS):
        return way.places, way.t_s
    lat_deg, lon_deg, up_m = way.places[-1]
    ground_m = up_m - wish.height_m - way.raised_m if isinstance(wish, Rally) else 0.0
    down_s = max(0.0, up_m - ground_m) / DOWN_M_S
    return (*way.places, (lat_deg, lon_deg, min(up_m, ground_m))), np.append(way.t_s, way.t_s[-1] + down_s)


def is_same_way(one: WayJudged, other: WayJudged) -> bool:
    """Place by place, at the same speeds, and with nothing more that speaks against it."""
    a, b = np.array(one.way.places), np.array(other.way.places)
    if (one.speed_m_s, one.most_m_s, one.way.problem) != (other.speed_m_s, other.most_m_s, other.way.problem):
        return False
    reasons, known = ({reason.code for reason in each.way.certificate.reasons} for each in (one, other))
    if a.shape != b.shape or not reasons <= known:
        return False
    begins_deg = float(a[0, 0]), float(a[0, 1])
    east_m, north_m = offset_m(begins_deg, a[:, 0], a[:, 1])
    other_east_m, other_north_m = offset_m(begins_deg, b[:, 0], b[:, 1])
    off_m = np.sqrt((east_m - other_east_m) ** 2 + (north_m - other_north_m) ** 2 + (a[:, 2] - b[:, 2]) ** 2)
    return bool((off_m <= SAME_M).all())


def asked_again(then: WayAsked, now: WayAsked) -> WayAsked:
    """By what is seen now, all else as it was shown; from the same place, as long as it only wanders there."""
    before, state = then.state, now.state
    off_m, up_m = math.inf, math.inf
    if before.lat_deg is not None and before.lon_deg is not None and state.lat_deg is not None:
        off_m = apart_m((before.lat_deg, before.lon_deg), (state.lat_deg, state.lon_deg or 0.0))
        up_m = abs((state.alt_rel_home_m or 0.0) - (before.alt_rel_home_m or 0.0))
    if max(off_m, up_m) <= BEGINS_M:
        place = {name: getattr(before, name) for name in ("lat_deg", "lon_deg", "alt_rel_home_m", "alt_amsl_m")}
        state = replace(state, **place)
    return replace(now, state=state, terrain=then.terrain, document=then.document, flown=then.flown)


def flown_places(states: list[VehicleState]) -> tuple[tuple[float, float, float], ...]:
    """(lat_deg, lon_deg, alt_rel_home_m) from the top of the take-off on: what lies below is its own column."""
    places = [
        (state.lat_deg, state.lon_deg, state.alt_rel_home_m)
        for state in states
        if state.landed != "on_ground"
        and state.lat_deg is not None
        and state.lon_deg is not None
        and state.alt_rel_home_m is not None
    ]
    left = next((k for k, place in enumerate(places) if apart_m(place[:2], places[0][:2]) > TAKE_OFF_M), len(places))
    return tuple(places[max(0, left - 1) :])


def is_over(flight: FlightStatus) -> bool:
    return flight.is_flown or flight.way != "guided" or flight.phase in ("idle", "landed", "interrupted")
