"""One aircraft that is heard by ADS-B and by remote ID: listed once, where both tell of the same flight."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import NamedTuple

from mapping.geometry.frames import offset_m
from telemetry.topics.traffic import OLD_S, Aircraft

NEAR_M, NEAR_S = 30.0, 1.5
"""Two positions of one aircraft differ by no more than this, and by what it flies in so long: ADS-B receivers tell an
age in whole seconds."""
ALIKE_M_S, ALIKE_SHARE, ALIKE_CLIMB_M_S = 3.0, 0.05, 2.5
"""Two velocities of one aircraft differ by no more, and by that share of its speed; two climbs by the last."""
PICTURES = 10
"""So many in a row agree before two of different numbers are one."""
APART = 2.0
"""What was one is two again where it differs by so many times that."""
_SHORTEST_ID = 4


class Joined(NamedTuple):
    aircraft: tuple[Aircraft, ...]
    same: dict[str, str]
    """By the key that is not listed: the key under which the aircraft is."""


class Joining:
    """Where anything is unsure, both stay: what is not told, what is old, and one that agrees with several."""

    def __init__(self) -> None:
        self._agreed: dict[tuple[str, str], int] = {}
        """Pictures in a row, by the keys of both."""

    def on_picture(self, aircraft: tuple[Aircraft, ...]) -> Joined:
        adsb = [it for it in aircraft if it.source == "adsb" and it.trust == "other"]
        remote = [it for it in aircraft if it.source == "remote_id" and it.trust == "other"]
        agree = [(a, b) for a in adsb for b in remote if self._agree(a, b)]
        self._agreed = {(a.key, b.key): self._agreed.get((a.key, b.key), 0) + 1 for a, b in agree}
        partners = Counter(it.key for pair in agree for it in pair)
        pairs = [
            (a, b)
            for a, b in agree
            if partners[a.key] == partners[b.key] == 1
            and (_has_same_id(a, b) or self._agreed[a.key, b.key] >= PICTURES)
        ]
        one = {a.key: _one(a, b) for a, b in pairs}
        same = {b.key: a.key for a, b in pairs}
        return Joined(tuple(one.get(it.key, it) for it in aircraft if it.key not in same), same)

    def _agree(self, a: Aircraft, b: Aircraft) -> bool:
        was_one = self._agreed.get((a.key, b.key), 0) >= PICTURES
        return _are_alike(a, b, APART if was_one or _has_same_id(a, b) else 1.0)


def _are_alike(a: Aircraft, b: Aircraft, times: float) -> bool:
    if max(a.age_s, b.age_s) > OLD_S or a.velocity_enu_m_s is None or b.velocity_enu_m_s is None:
        return False
    if a.height_m is None or b.height_m is None or a.on_ground != b.on_ground:
        return False
    if abs(a.height_m - b.height_m) > a.height_within_m + b.height_within_m:
        return False
    has_climbs = a.climb_m_s is not None and b.climb_m_s is not None
    if has_climbs and abs((a.climb_m_s or 0.0) - (b.climb_m_s or 0.0)) > times * ALIKE_CLIMB_M_S:
        return False
    speed_m_s = math.hypot(*a.velocity_enu_m_s)
    if math.dist(a.velocity_enu_m_s, b.velocity_enu_m_s) > times * (ALIKE_M_S + ALIKE_SHARE * speed_m_s):
        return False
    apart_m = math.hypot(*offset_m((a.lat_deg, a.lon_deg), b.lat_deg, b.lon_deg))
    return apart_m <= times * (NEAR_M + NEAR_S * speed_m_s)


def _has_same_id(a: Aircraft, b: Aircraft) -> bool:
    """The remote ID is the registration that the other calls itself by, or its ICAO address."""
    told = _plain(b.name)
    return len(told) >= _SHORTEST_ID and told in (_plain(a.name), _plain(a.key.partition(" ")[2]))


def _plain(name: str) -> str:
    return "".join(c for c in name.upper() if c.isalnum())


def _one(a: Aircraft, b: Aircraft) -> Aircraft:
    """Where the nearer of both is, under the first's key; warned of where either is to be."""
    nearer = min(a, b, key=lambda it: math.inf if it.distance_m is None else it.distance_m)
    return replace(
        nearer,
        key=a.key,
        source=a.source,
        name=a.name if _has_same_id(a, b) else f"{a.name} ({b.name})",
        kind=a.kind or b.kind,
        emergency=a.emergency or b.emergency,
        operator_deg=b.operator_deg,
        conflict=a.conflict or b.conflict,
    )
