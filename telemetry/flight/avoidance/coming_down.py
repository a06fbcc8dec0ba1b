"""From where the vehicle is onto a line that was planned a moment ago: level to a place ahead, then straight down."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

from mapping.geometry.frames import offset_m
from mapping.perceiving.braking import Braking
from telemetry.errors import NotAllowedError
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.vehicle import VehicleState

BESIDE_M = 3.0
"""Farther from the line than this it is another flight's."""


def joined(targets: tuple[GuidedTarget, ...], state: VehicleState, braking: Braking) -> tuple[GuidedTarget, ...]:
    """What is left of the line, joined as far ahead as the vehicle needs to stop: it descends over one place only.

    Straight down onto a line that is clear everything is clear: what stands is widest at its foot. Raises
    NotAllowedError for a vehicle that is not over the line.
    """
    lat_deg, lon_deg, alt_m = state.lat_deg, state.lon_deg, state.alt_rel_home_m
    if lat_deg is None or lon_deg is None or alt_m is None:
        raise NotAllowedError("Where the vehicle is, is not known.", advice="Wait for its position.")
    places = [offset_m((lat_deg, lon_deg), t.lat_deg, t.lon_deg) for t in targets]
    along_m, away_m = _nearest(places)
    if away_m > BESIDE_M:
        what = f"The vehicle is {away_m:.0f} m beside the line that was planned for it."
        raise NotAllowedError(what, advice="It is planned again.")
    leg, share = _at(places, along_m + braking.distance_m(state.ground_speed_m_s or 0.0))
    if leg is None:
        raise NotAllowedError("The line that was planned is almost flown.", advice="It stays higher.")
    low = between(targets[leg], targets[leg + 1], share)
    over = replace(low, alt_rel_home_m=max(alt_m, low.alt_rel_home_m))
    return (over, low, *targets[leg + 1 :])


def between(a: GuidedTarget, b: GuidedTarget, share: float) -> GuidedTarget:
    """A place on the line from ``a`` to ``b``, flown to as ``b`` is; nothing is waited for there."""
    return replace(
        b,
        lat_deg=a.lat_deg + share * (b.lat_deg - a.lat_deg),
        lon_deg=a.lon_deg + share * (b.lon_deg - a.lon_deg),
        alt_rel_home_m=a.alt_rel_home_m + share * (b.alt_rel_home_m - a.alt_rel_home_m),
        loiter_s=0.0,
    )


def _nearest(places: list[tuple[float, float]]) -> tuple[float, float]:
    """(metres along the line, metres away) of its place nearest to the vehicle, over ground."""
    best, passed_m = (0.0, math.hypot(*places[0])), 0.0
    for (e0, n0), (e1, n1) in pairwise(places):
        length_m = math.dist((e0, n0), (e1, n1))
        de, dn = e1 - e0, n1 - n0
        share = 0.0 if length_m == 0 else min(1.0, max(0.0, -(e0 * de + n0 * dn) / length_m**2))
        away_m = math.hypot(e0 + share * de, n0 + share * dn)
        if away_m < best[1] - 1e-6:
            best = passed_m + share * length_m, away_m
        passed_m += length_m
    return best


def _at(places: list[tuple[float, float]], along_m: float) -> tuple[int | None, float]:
    """The leg so far along, and the share of it; None beyond the end."""
    for leg, (a, b) in enumerate(pairwise(places)):
        length_m = math.dist(a, b)
        if length_m > 0 and along_m <= length_m:
            return leg, along_m / length_m
        along_m -= length_m
    return None, 0.0
