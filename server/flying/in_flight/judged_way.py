"""A judged way as it is told, flown to its end and looked along."""

from __future__ import annotations

import math
import secrets

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from planning.guided.guided_model import RETURNS, GuidedWay, Rally
from server.flying.apart.way_apart import Apart
from server.flying.in_flight.way_task import WayJudged
from server.heard.led_way import Places
from server.obstacles.surroundings import returns_from
from server.schemas import ReasonDoc, TerrainDoc, WayBody, WayDoc
from telemetry.flight.certified_way import way_notes
from telemetry.flight.home_watch import HomePlace

WANDERED_M = 1.0
"""By so much a vehicle that hovers may be elsewhere when it is asked again."""
DOWN_M_S = 2.5
"""No landing here is faster."""


def way_doc(judged: WayJudged, body: WayBody, terrain: TerrainDoc, notes: list[str], apart: Apart) -> WayDoc:
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
        terrain_name=terrain.name,
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


def is_same_way(one: GuidedWay, other: GuidedWay) -> bool:
    """Place by place, but for what the vehicle wandered since."""
    a, b = np.array(one.places), np.array(other.places)
    if a.shape != b.shape:
        return False
    east_m, north_m = offset_m((float(a[0, 0]), float(a[0, 1])), a[:, 0], a[:, 1])
    other_east_m, other_north_m = offset_m((float(a[0, 0]), float(a[0, 1])), b[:, 0], b[:, 1])
    off_m = np.sqrt((east_m - other_east_m) ** 2 + (north_m - other_north_m) ** 2 + (a[:, 2] - b[:, 2]) ** 2)
    return bool((off_m <= WANDERED_M).all())
