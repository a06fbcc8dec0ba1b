"""Position and velocity along the line, many times a second, for an ArduCopter that does not fly straight legs itself.

Sent a place alone, ArduCopter shapes height and place apart and leaves the straight leg by up to 1.7 m (recorded).
Sent a place with its velocity (SET_POSITION_TARGET_GLOBAL_INT, type mask 3520: "Copter Commands in Guided Mode" of
ArduPilot's developer documentation) it moves that place on at that velocity by itself and follows it, corrected by its
square-root controllers, accelerated no faster than WPNAV_ACCEL and PSC_JERK allow. So the place is led along the leg
with less than these, slowly round corners, and with the velocity that it will have a little later, since a difference
of velocity is taken up with the time constant acceleration / jerk.

It moves on for GUID_TIMEOUT when nothing more is heard. The feed is never faster than that a link that falls silent
would carry the vehicle off the line by about ``Feed.off_line_m``, well within the following error of the certificate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from mapping.geometry.frames import offset_m
from telemetry.flight.guided.orders import Place
from telemetry.topics.messages import GuidedTarget

Vec3 = tuple[float, float, float]
SHORTEST_M = 0.05
"""Shorter legs are none."""
PATIENT_M, PATIENT_S = 1.0, 0.5
"""So far behind the fed place, and so long at its speed, the vehicle may be before the place waits for it."""
CATCH_UP_M = 2.0
STOPS_S = 0.5
"""So long at its speed it goes on beyond a place that has stopped, and comes back."""
CREEPING_M_S = 0.1
"""At which it comes to a leg's end, where it stands."""


@dataclass(frozen=True, slots=True)
class Feed:
    """How the place is led. Halves of ArduCopter's defaults, so that the other halves are left for corrections."""

    period_s: float = 0.1
    silent_s: float = 3.0
    """GUID_TIMEOUT."""
    accel_m_s2: float = 1.25
    vertical_accel_m_s2: float = 0.5
    climb_m_s: float = 2.5
    descent_m_s: float = 1.5
    """WPNAV_SPEED_UP and _DN."""
    lead_s: float = 0.5
    vertical_lead_s: float = 0.2
    """WPNAV_ACCEL and WPNAV_ACCEL_Z over PSC_JERK."""
    turn_m_s: float = 0.4
    vertical_turn_m_s: float = 0.25
    """Change of velocity at a corner."""
    off_line_m: float = 1.0
    """Beyond a corner, when the link is silent."""


@dataclass(frozen=True, slots=True)
class SetPoint:
    place: Place
    v_neu_m_s: Vec3


@dataclass(frozen=True, slots=True)
class Bounds:
    """Of one leg."""

    unit: Vec3
    """North, east, up; zeros for a leg that is none."""
    length_m: float
    speed_m_s: float
    accel_m_s2: float
    out_m_s: float
    """Speed at its end."""
    room_m: float
    """That the vehicle may fly on straight beyond its end before it is off the line."""


def bounds_of(start: Place, targets: Sequence[GuidedTarget], feed: Feed) -> list[Bounds]:
    """Of the legs from ``start`` through the targets; the last one's end is stood at."""
    places = [(start.lat_deg, start.lon_deg, start.alt_rel_home_m)]
    places += [(target.lat_deg, target.lon_deg, target.alt_rel_home_m) for target in targets]
    legs = [_leg(a, b) for a, b in pairwise(places)]
    found: list[Bounds] = []
    for k in reversed(range(len(targets))):
        unit, length_m = legs[k]
        limits = _limits(unit, targets[k].speed_m_s, feed)
        out_m_s = 0.0
        if found and targets[k].loiter_s == 0.0:
            onward = found[-1]
            out_m_s = min(
                _corner_m_s(_change(unit, onward.unit), feed), limits[0], onward.speed_m_s, _entry_m_s(onward)
            )
        found.append(Bounds(unit, length_m, *limits, out_m_s, _room_m(unit, legs[k + 1 :], feed)))
    return found[::-1]


def _room_m(unit: Vec3, onward: Sequence[tuple[Vec3, float]], feed: Feed) -> float:
    """Straight on, beside a place that goes round the corners at the same speed and stands at the end."""
    room_m, left_m = 0.0, feed.off_line_m
    for other, length_m in onward:
        apart = math.hypot(*_change(unit, other))
        if apart * length_m >= left_m:
            return room_m + left_m / apart
        room_m, left_m = room_m + length_m, left_m - apart * length_m
    return room_m + left_m


def _change(a: Vec3, b: Vec3) -> Vec3:
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


def _leg(a: Vec3, b: Vec3) -> tuple[Vec3, float]:
    east_m, north_m = offset_m(a[:2], b[0], b[1])
    length_m = math.hypot(north_m, east_m, b[2] - a[2])
    if length_m < SHORTEST_M:
        return (0.0, 0.0, 0.0), 0.0
    return (north_m / length_m, east_m / length_m, (b[2] - a[2]) / length_m), length_m


def _limits(unit: Vec3, speed_m_s: float, feed: Feed) -> tuple[float, float]:
    """Speed along the leg, with ``speed_m_s`` over ground, and acceleration."""
    flat, up = math.hypot(unit[0], unit[1]), abs(unit[2])
    vertical_m_s = feed.climb_m_s if unit[2] > 0 else feed.descent_m_s
    return (
        min(speed_m_s / max(flat, 1e-9), vertical_m_s / max(up, 1e-9)),
        min(feed.accel_m_s2 / max(flat, 1e-9), feed.vertical_accel_m_s2 / max(up, 1e-9)),
    )


def _corner_m_s(change: Vec3, feed: Feed) -> float:
    flat, up = math.hypot(change[0], change[1]), abs(change[2])
    return min(feed.turn_m_s / max(flat, 1e-9), feed.vertical_turn_m_s / max(up, 1e-9))


def _entry_m_s(leg: Bounds) -> float:
    """From which the speed at its end can still be had."""
    return math.sqrt(leg.out_m_s**2 + 2 * leg.accel_m_s2 * leg.length_m)


class FedLeg:
    """The place that is led along one leg. ``advance`` it by the clock, then send what ``set_point`` says."""

    def __init__(self, start: Place, target: GuidedTarget, bounds: Bounds, feed: Feed, *, speed_m_s: float) -> None:
        self.start, self._target, self._bounds, self._feed = start, target, bounds, feed
        self._along_m, self._speed_m_s, self._accel_m_s2 = 0.0, speed_m_s, 0.0

    @property
    def is_over(self) -> bool:
        return self._along_m >= self._bounds.length_m

    @property
    def out_m_s(self) -> float:
        return self._bounds.out_m_s

    def advance(self, seconds: float, at: Place, *, most_m_s: float = math.inf) -> None:
        """``at``: where the vehicle is; the place waits for one that falls behind."""
        left_m = self._bounds.length_m - self._along_m
        before = self._speed_m_s
        if left_m <= 0.0:
            self._speed_m_s = self._accel_m_s2 = 0.0
            return
        wish = min(self._wish_m_s(left_m) * self._patience(at), most_m_s)
        most = self._bounds.accel_m_s2 * seconds
        self._speed_m_s = max(min(wish, before + most), before - 2 * most, 0.0)
        self._accel_m_s2 = (self._speed_m_s - before) / seconds if seconds > 0.0 else 0.0
        self._along_m = min(self._bounds.length_m, self._along_m + (before + self._speed_m_s) / 2 * seconds)

    def limit(self, bounds: Bounds) -> None:
        """Of the same leg: it changes to another speed as it changes to any."""
        self._bounds = bounds

    def catch_up(self, at: Place) -> None:
        """After silence: it goes on from where the vehicle has come to meanwhile, from rest."""
        self._along_m = min(self._bounds.length_m, max(self._along_m, self._reached_m(at)))
        self._speed_m_s = self._accel_m_s2 = 0.0

    def set_point(self, home_alt_amsl_m: float, heading_rad: float | None) -> SetPoint:
        a, b, bounds, feed = self.start, self._target, self._bounds, self._feed
        share = self._along_m / bounds.length_m if bounds.length_m else 1.0
        place = Place(
            a.lat_deg + share * (b.lat_deg - a.lat_deg),
            a.lon_deg + share * (b.lon_deg - a.lon_deg),
            a.alt_rel_home_m + share * (b.alt_rel_home_m - a.alt_rel_home_m),
            home_alt_amsl_m,
            heading_rad,
        )
        most = self._silence_m_s(bounds.length_m - self._along_m)
        flat = min(most, self._speed_m_s + self._accel_m_s2 * feed.lead_s)
        up = min(most, self._speed_m_s + self._accel_m_s2 * feed.vertical_lead_s)
        return SetPoint(place, (bounds.unit[0] * flat, bounds.unit[1] * flat, bounds.unit[2] * up))

    def _wish_m_s(self, left_m: float) -> float:
        """So fast that it can be as slow as it must be at the end, and silence does not carry the vehicle away."""
        bounds = self._bounds
        brakes = math.sqrt(bounds.out_m_s**2 + 2 * bounds.accel_m_s2 * left_m)
        return min(bounds.speed_m_s, max(brakes, CREEPING_M_S), self._silence_m_s(left_m))

    def _silence_m_s(self, left_m: float) -> float:
        return (left_m + self._bounds.room_m) / (self._feed.silent_s + STOPS_S)

    def _patience(self, at: Place) -> float:
        """Share of the speed, for a vehicle that is there."""
        late_m = self._along_m - self._reached_m(at) - PATIENT_M - PATIENT_S * self._speed_m_s
        return min(1.0, max(0.0, 1.0 - late_m / CATCH_UP_M))

    def _reached_m(self, at: Place) -> float:
        a, unit = self.start, self._bounds.unit
        east_m, north_m = offset_m((a.lat_deg, a.lon_deg), at.lat_deg, at.lon_deg)
        return north_m * unit[0] + east_m * unit[1] + (at.alt_rel_home_m - a.alt_rel_home_m) * unit[2]
