"""Which of a vehicle's messages are believed: an impossible change waits until it is confirmed.

Whoever can write the vehicle's address on a packet can say anything in its name, while the vehicle itself goes on
speaking. So what no vehicle does from one moment to the next (motors that stop in the air, kilometres within a second,
a clock that leaps) is held back until a second kind of message says it too, or until for a while nobody says the
opposite. Until then the worse end counts: armed, in the air, at the old place. Frames in, messages out; no clock.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mapping.geometry.frames import apart_m
from telemetry.mavlink.actions import Message
from telemetry.mavlink.conversation import BACKWARDS_MS
from telemetry.mavlink.reduce import is_vehicle_heartbeat, lat_lon
from telemetry.topics.vehicle import IN_THE_AIR, VehicleState

SETTLE_S, SETTLE_MESSAGES = 1.0, 3
"""A leap is believed when nothing else was heard for so long, and it was said so often."""
ALONE_S, ALONE_HEARTBEATS = 5.0, 4
"""The same for motors that stop in the air, when no second kind of message says so."""
LOW_M = 1.0
MOVES_M_S, CLIMBS_M_S = 2.0, 1.0
"""What is faster has not come down."""
RESTS_M_S, NEAR_M = 0.3, 1.5
"""What stands on the ground is slower by its own estimate, and so near the height of home, where it took off."""
SLACK_M, FAST_M_S, FAST_CLIMB_M_S = 20.0, 120.0, 60.0
"""No vehicle is faster; a receiver that finds its place anew may be off by the slack."""
FORWARDS_MS, FASTER = 10_000, 120.0
"""A simulation's clock may run so many times as fast as ours."""
CLOCKED = frozenset({"GLOBAL_POSITION_INT", "ATTITUDE", "LOCAL_POSITION_NED", "SYSTEM_TIME"})
"""Whose milliseconds since boot are the autopilot's own, never a forwarded sensor's."""
SAID_S = 10.0
"""A contradiction is told for so long."""
MOTORS_DOUBTED = (
    "Not confirmed: the vehicle says that it is disarmed in the air. It counts as flying until a second message says "
    "so. Look at it."
)
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_FLIES = frozenset({2, 3, 4})
"""MAV_LANDED_STATE of in the air, taking off and landing."""

Place = tuple[float, float, float, float]
"""Degrees, degrees, metres above home, and seconds since boot: a simulation's may be faster than ours."""


@dataclass(frozen=True, slots=True)
class _Doubt:
    """What is said, since when, how often, and last when."""

    since_s: float
    newest: Any
    at_s: float
    times: int = 1


def _again(doubt: _Doubt | None, newest: object, now_s: float) -> _Doubt:
    if doubt is None:
        return _Doubt(now_s, newest, now_s)
    return _Doubt(doubt.since_s, newest, now_s, doubt.times + 1)


class _Steady:
    """One figure that cannot leap. ``follows(before, after, seconds)`` says whether it is none."""

    def __init__(self, follows: Callable[[Any, Any, float], bool]) -> None:
        self._follows = follows
        self._known: _Doubt | None = None
        self._leap: _Doubt | None = None
        self.contradictions = 0

    def believes(self, value: object, now_s: float) -> bool:
        known, leap = self._known, self._leap
        if known is None or self._follows(known.newest, value, now_s - known.at_s):
            self.contradictions += leap is not None
            self._known, self._leap = _Doubt(now_s, value, now_s), None
            return True
        if leap is None or not self._follows(leap.newest, value, now_s - leap.at_s):
            self._leap = _Doubt(now_s, value, now_s)
            return False
        self._leap = leap = _again(leap, value, now_s)
        if now_s - leap.since_s < SETTLE_S or leap.times < SETTLE_MESSAGES:
            return False
        self._known, self._leap = leap, None
        return True


class Believing:
    """Of one vehicle's own messages. ``flies``: the last that was known of it is that it is in the air."""

    def __init__(self, *, flies: bool = False) -> None:
        self._flies = flies
        self._kind = _Steady(lambda before, after, _: before == after)
        self._clock = _Steady(_clock_follows)
        self._place = _Steady(_place_follows)
        self._disarmed: _Doubt | None = None
        self._down: _Doubt | None = None
        self._said_flying_s: float | None = None
        self._rests_since_s: float | None = None
        """At the height of home."""
        self._interval_s = 0.0
        self._refuted, self._counted, self._contradicted_s = 0, 0, -SAID_S

    @property
    def contradictions(self) -> int:
        """How often a message that was not believed was refuted by the next."""
        return self._refuted + self._kind.contradictions + self._clock.contradictions + self._place.contradictions

    def hear(self, state: VehicleState, message: Message, now_s: float) -> tuple[Message, ...]:
        """What is believed from now on, in order: not always this message, and perhaps one from before.

        ``state`` is what was believed until now.
        """
        if state.armed and is_in_the_air(state):
            self._flies = True
        believed = self._judged(message, now_s)
        if self.contradictions != self._counted:
            self._counted, self._contradicted_s = self.contradictions, now_s
        return believed

    def warnings(self, now_s: float) -> tuple[str, ...]:
        said: list[str] = []
        if self.doubts_motors(now_s):
            said.append(MOTORS_DOUBTED)
        if now_s - self._contradicted_s < SAID_S:
            said.append(
                f"Somebody else may be sending as this vehicle: {self.contradictions} of its messages contradicted "
                "the others and were not believed. Be ready to use the pilot's transmitter."
            )
        return tuple(said)

    def doubts_motors(self, now_s: float) -> bool:
        """It says that it is disarmed in the air, not that it has come down."""
        disarmed = self._disarmed
        return disarmed is not None and (self._down is None or now_s - disarmed.since_s > SETTLE_S)

    def _judged(self, message: Message, now_s: float) -> tuple[Message, ...]:
        kind = message.get_type()
        if kind in CLOCKED and not self._clock.believes(message.time_boot_ms, now_s):
            return ()
        if kind == "HEARTBEAT" and is_vehicle_heartbeat(message):
            is_same = self._kind.believes((message.autopilot, message.type), now_s)
            return self._heartbeat(message, now_s) if is_same else ()
        if kind == "EXTENDED_SYS_STATE":
            return self._landed(message, now_s)
        if kind == "GLOBAL_POSITION_INT":
            return self._position(message, now_s)
        return (message,)

    def _heartbeat(self, message: Message, now_s: float) -> tuple[Message, ...]:
        if message.base_mode & _ARMED:
            self._refuted += self._disarmed is not None
            self._disarmed = None
            return (message,)
        if not self._flies:
            return (message,)
        self._disarmed = _again(self._disarmed, message, now_s)
        alone = now_s - self._disarmed.since_s >= ALONE_S and self._disarmed.times >= ALONE_HEARTBEATS
        return self._come_down() if alone or self._is_down(now_s) else ()

    def _landed(self, message: Message, now_s: float) -> tuple[Message, ...]:
        if message.landed_state in _FLIES:
            if self._said_flying_s is not None:
                self._interval_s = max(now_s - self._said_flying_s, 0.9 * self._interval_s)
            self._said_flying_s = now_s
            self._refuted += self._down is not None
            self._down = None
            return (message,)
        if not self._flies:
            return (message,)
        self._down = _again(self._down, message, now_s)
        return self._come_down() if self._is_down(now_s) else ()

    def _position(self, message: Message, now_s: float) -> tuple[Message, ...]:
        lat_deg, lon_deg = lat_lon(message.lat, message.lon)
        alt_m, boot_s = message.relative_alt / 1000, message.time_boot_ms / 1000
        place = None if lat_deg is None or lon_deg is None else (lat_deg, lon_deg, alt_m, boot_s)
        if place is not None and not self._place.believes(place, now_s):
            return ()
        flat_m_s, climb_m_s = max(abs(message.vx), abs(message.vy)) / 100, abs(message.vz) / 100
        if abs(message.relative_alt) > NEAR_M * 1000 or max(flat_m_s, climb_m_s) > RESTS_M_S:
            self._rests_since_s = None
        elif self._rests_since_s is None:
            self._rests_since_s = now_s
        if (flat_m_s > MOVES_M_S or climb_m_s > CLIMBS_M_S) and self._down is not None:
            self._down = _Doubt(now_s, self._down.newest, now_s)  # falling, or not down at all
        return (message,)

    def _is_down(self, now_s: float) -> bool:
        """Both kinds of message say so, or the one alone for longer. A vehicle that has never said that it flies cannot
        be counted on to contradict.
        """
        if self._down is None:
            return False
        if self._rests_since_s is not None and now_s - self._rests_since_s >= SETTLE_S:
            return True  # its positions said so before
        if self._down.times < SETTLE_MESSAGES:
            return False
        intervals, least_s = (2.0, SETTLE_S / 2) if self._disarmed else (3.0, SETTLE_S)
        wanted_s = ALONE_S if self._said_flying_s is None else intervals * self._interval_s
        return now_s - self._down.since_s >= min(max(wanted_s, least_s), ALONE_S)

    def _come_down(self) -> tuple[Message, ...]:
        held = tuple(doubt.newest for doubt in (self._down, self._disarmed) if doubt is not None)
        self._flies, self._disarmed, self._down = False, None, None
        return held


def is_in_the_air(state: VehicleState) -> bool:
    """By its height where the vehicle does not say."""
    if state.landed is None:
        return state.alt_rel_home_m is not None and state.alt_rel_home_m >= LOW_M
    return state.landed in IN_THE_AIR


def _clock_follows(before_ms: int, after_ms: int, seconds: float) -> bool:
    return -BACKWARDS_MS <= after_ms - before_ms <= FORWARDS_MS + FASTER * 1000 * seconds


def _place_follows(before: Place, after: Place, seconds: float) -> bool:
    seconds = max(seconds, after[3] - before[3])
    is_near = apart_m(before[:2], after[:2]) <= SLACK_M + FAST_M_S * seconds
    return is_near and abs(after[2] - before[2]) <= SLACK_M + FAST_CLIMB_M_S * seconds


def is_disarmed(state: VehicleState | None) -> bool:
    """By its own word: who has said nothing may fly."""
    return state is not None and state.heartbeat_t_mono_s is not None and not state.armed
