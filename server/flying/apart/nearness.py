"""Vehicles in the air held against each other, once a second: an alarm for both where they may come too near."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from mapping.geometry.frames import offset_m
from planning.following.separation import Nearest, TimedLine, nearest
from server.errors import reported
from server.heard.channel import Channel
from server.heard.plan_follower import EARLY_LATE_SHARE, Ahead
from server.schemas import VehicleAlarm
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")

EVERY_S = 1.0
NEAR_M, OVER_M = 5.0, 8.0
"""Between the balls in which the vehicles are: an alarm begins below the first, and is over above the second."""
RADIUS_M = 3.0
"""Of the ball: half a vehicle, and the errors of position and height; more where the receiver claims more."""
AHEAD_S, STRAIGHT_S = 60.0, 12.0
"""So far a plan is looked ahead; and straight on, where none is flown."""
STANDS_M_S = 0.3
"""What is slower stays where it is for all of that time."""
VEER_SHARE = 0.2
"""Of its speed: so much a vehicle's ball grows in a second while nothing is heard, or where no plan is flown."""
_FLAT = 1.02
"""What ``offset_m`` may be wrong by, over the ways that are flown."""
_ADVICE = "Hold one of them, or lead it away."
_ALONE = "Hold yours or lead it away, and call the other station."


@dataclass(frozen=True, slots=True)
class Flown:
    """A vehicle in the air, as its pages know it."""

    name: str
    state: VehicleState
    ahead: Ahead | None
    unsure_m: float = 0.0
    """Added to its ball: what it may have moved because the age of its position is not known well."""
    is_silent: bool = False
    """Of another station, and not heard for so long that nothing tells where it is by now."""
    key: str = ""
    """Of another station: its name and the vehicle's number there. What its vehicle is called may be anything."""
    told: Flown | None = None
    """The same vehicle on the line that another station tells of, or on the guided way that it is led. Held apart as
    well, never instead."""


Pair = tuple[int, int | str]
"""Two of the station's vehicles by their numbers; or one, and another station's by its key."""


class Nearness:
    """``alarms`` by the vehicle's number. All methods belong to the event loop."""

    def __init__(
        self,
        channels: Mapping[int, tuple[str, Channel]],
        *,
        elsewhere: Callable[[float], Sequence[Flown]] = lambda _: (),
        now_mono_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """``elsewhere``: other stations' vehicles in the air; they are held against these, not against each other."""
        self._channels, self._elsewhere, self._now_mono_s = channels, elsewhere, now_mono_s
        self._own: dict[Pair, Nearest] = {}
        self._others: dict[Pair, Nearest] = {}
        self._of_others: dict[int, VehicleAlarm] = {}
        self.alarms: dict[int, VehicleAlarm] = {}

    async def run(self) -> None:
        """Until cancelled."""
        while True:
            await asyncio.sleep(EVERY_S)
            try:
                await self.look()
            except Exception as error:
                log.warning("Whether vehicles come near: %s", reported(error, log, "Holding vehicles apart").what)

    async def look(self) -> None:
        """A second in the life of all pairs; the sums are done beside the event loop."""
        flown = in_the_air(self._channels)
        now_s = self._now_mono_s()
        # One's own first, and told at once: whatever others tell delays no alarm between these.
        self._own = _near(await asyncio.to_thread(found_among, flown, now_s), self._own)
        of_own = _of_own(flown, self._own, now_s)
        self.alarms = {number: of for number, of in self._of_others.items() if number in flown} | of_own
        elsewhere = {each.key: each for each in self._elsewhere(now_s)}
        self._others = _near(await asyncio.to_thread(found_elsewhere, flown, now_s, elsewhere), self._others)
        self._of_others = _of_other_stations(flown, elsewhere, self._others, now_s)
        self.alarms = self._of_others | {
            number: _both(of, self._of_others.get(number)) for number, of in of_own.items()
        }


def in_the_air(channels: Mapping[int, tuple[str, Channel]]) -> dict[int, Flown]:
    """One's own, by their numbers: those whose place is known."""
    return {
        number: flown_of(name, channel)
        for number, (name, channel) in channels.items()
        if channel.state is not None and channel.in_air and channel.state.lat_deg is not None
    }


def flown_of(name: str, channel: Channel) -> Flown:
    state, led = channel.state or VehicleState(0, 0), channel.led_ahead()
    return Flown(name, state, channel.ahead(), told=None if led is None else Flown(name, state, led))


def _near(found: Mapping[Pair, Nearest], before: Mapping[Pair, Nearest]) -> dict[Pair, Nearest]:
    """Those that come too near, or did and are not well apart yet."""
    return {pair: at for pair, at in found.items() if at.distance_m < (OVER_M if pair in before else NEAR_M)}


def _of_own(flown: Mapping[int, Flown], near: Mapping[Pair, Nearest], now_s: float) -> dict[int, VehicleAlarm]:
    """Of several the nearest is told."""
    alarms: dict[int, VehicleAlarm] = {}
    for (one, other), at in sorted(near.items(), key=lambda it: -it[1].distance_m):
        assert isinstance(other, int)
        for its, theirs in ((one, other), (other, one)):
            text = f"{said(flown[its].name, flown[theirs].name, at, now_s)} {_ADVICE}"
            alarms[its] = VehicleAlarm(kind="near", key=f"near {one} {other}", text=text)
    return alarms


def _both(own: VehicleAlarm, of_others: VehicleAlarm | None) -> VehicleAlarm:
    """Neither hides the other; it is the alarm of one's own pair."""
    return own if of_others is None else own.model_copy(update={"text": f"{own.text} {of_others.text}"})


def _of_other_stations(
    flown: Mapping[int, Flown], elsewhere: Mapping[str, Flown], near: Mapping[Pair, Nearest], now_s: float
) -> dict[int, VehicleAlarm]:
    """Of several the nearest is told, and before one that may be anywhere one that is there."""
    alarms: dict[int, VehicleAlarm] = {}
    each = [(one, elsewhere[str(other)], at) for (one, other), at in near.items()]
    for one, other, at in sorted(each, key=lambda it: (not it[1].is_silent, -it[2].distance_m)):
        alarms[one] = _of_other_station(one, flown[one].name, other, at, now_s)
    return alarms


def _of_other_station(number: int, name: str, other: Flown, at: Nearest, now_s: float) -> VehicleAlarm:
    """That it is heard no more is another alarm than the one before: whoever has seen that has not seen this."""
    if other.is_silent:
        text = f"{other.name} is not heard any more, and may be where {name} flies. {_ALONE}"
        return VehicleAlarm(kind="near", key=f"near {number} {other.key} silent", text=text)
    text = f"{said(name, other.name, at, now_s)} {_ALONE}"
    return VehicleAlarm(kind="near", key=f"near {number} {other.key}", text=text)


def found_among(flown: Mapping[int, Flown], now_s: float) -> dict[Pair, Nearest]:
    """How near each pair of one's own comes to each other."""
    found: dict[Pair, Nearest] = {}
    for one, other in combinations(sorted(flown), 2):
        if (at := near_each_other(flown[one], flown[other], now_s)) is not None:
            found[one, other] = at
    return found


def found_elsewhere(flown: Mapping[int, Flown], now_s: float, others: Mapping[str, Flown]) -> dict[Pair, Nearest]:
    """How near other stations' come to one's own; without those that are too far away for any alarm."""
    reach_m = {key: max(_reach_m(each, now_s) for each in both_ways(of)) for key, of in others.items()}
    found: dict[Pair, Nearest] = {}
    for one, own in flown.items():
        own_m = max(_reach_m(each, now_s) for each in both_ways(own))
        for (key, other), far_m in zip(others.items(), _apart_m(own, list(others.values())), strict=True):
            if far_m > _FLAT * (own_m + reach_m[key]) + OVER_M:
                continue
            if (at := near_each_other(own, other, now_s)) is not None:
                found[one, key] = at
    return found


def _apart_m(one: Flown, others: Sequence[Flown]) -> list[float]:
    """Between the last places, along the ground: at a glance, of many."""
    places_deg = np.array([(of.state.lat_deg or 0.0, of.state.lon_deg or 0.0) for of in others]).reshape(-1, 2)
    east_m, north_m = offset_m((one.state.lat_deg or 0.0, one.state.lon_deg or 0.0), places_deg[:, 0], places_deg[:, 1])
    return np.hypot(east_m, north_m).tolist()


def _reach_m(of: Flown, now_s: float) -> float:
    """No part of its line, nor of the ball around it, is farther from its last place."""
    state, way_m = of.state, 0.0
    if of.ahead is not None:
        place_deg = state.lat_deg or 0.0, state.lon_deg or 0.0
        east_m, north_m = offset_m(place_deg, of.ahead.lat_lon_deg[:, 0], of.ahead.lat_lon_deg[:, 1])
        way_m = float(np.max(np.hypot(east_m, north_m), initial=0.0))
    age_s = 0.0 if state.position_t_mono_s is None else max(0.0, now_s - state.position_t_mono_s)
    speed_m_s = math.hypot(state.v_east_m_s or 0.0, state.v_north_m_s or 0.0, state.v_down_m_s or 0.0)
    straight_m = (1.0 + VEER_SHARE) * speed_m_s * (age_s + AHEAD_S)
    return _radius_m(of) + max(way_m, straight_m)


def _radius_m(of: Flown) -> float:
    off_m = 0.0 if of.ahead is None else of.ahead.off_m
    return max(RADIUS_M, 2.0 * (of.state.horizontal_accuracy_m or 0.0)) + of.unsure_m + off_m


def near_each_other(one: Flown, other: Flown, now_s: float) -> Nearest | None:
    """Where either one's height above the sea is unknown, both are taken to be at the same height.

    Where a line is told, both ways count: straight on, and that; the nearer, then the sooner is it.
    """
    pairs = product(both_ways(one), both_ways(other))
    found = [at for its, theirs in pairs if (at := _near_on(its, theirs, now_s)) is not None]
    return min(found, key=lambda at: (at.distance_m, at.t_s), default=None)


def both_ways(of: Flown) -> tuple[Flown, ...]:
    return (of,) if of.told is None else (of, of.told)


def _near_on(one: Flown, other: Flown, now_s: float) -> Nearest | None:
    origin_deg = one.state.lat_deg or 0.0, one.state.lon_deg or 0.0
    flat = one.state.alt_amsl_m is None or other.state.alt_amsl_m is None
    one_line, other_line = (line_of(each, origin_deg, now_s, flat=flat) for each in (one, other))
    return nearest(one_line, other_line, since_s=now_s)


def said(name: str, other: str, at: Nearest, now_s: float) -> str:
    within_s = at.t_s - now_s
    when = "now" if within_s < 1.5 else f"in {within_s:.0f} s"
    return f"{name} and {other} may come within {at.distance_m:.0f} m of each other {when}."


def line_of(
    of: Flown, origin_deg: tuple[float, float], now_s: float, *, flat: bool, ahead_s: float | None = AHEAD_S
) -> TimedLine:
    """From the last position that was heard, however old it is; ``ahead_s`` None: to the end of its plan."""
    state, ahead = of.state, of.ahead
    alt_m = 0.0 if flat else state.alt_amsl_m or 0.0
    here_m = np.array([*offset_m(origin_deg, state.lat_deg or 0.0, state.lon_deg or 0.0), alt_m])
    heard_s = now_s if state.position_t_mono_s is None else min(now_s, state.position_t_mono_s)
    v_enu_m_s = np.array([state.v_east_m_s or 0.0, state.v_north_m_s or 0.0, -(state.v_down_m_s or 0.0)])
    v_enu_m_s[2] *= not flat
    radius_m = _radius_m(of)
    home_m = None if flat else state.home_alt_amsl_m
    if ahead is not None and (flat or home_m is not None):
        east_m, north_m = offset_m(origin_deg, ahead.lat_lon_deg[:, 0], ahead.lat_lon_deg[:, 1])
        up_m = np.zeros(len(ahead.t_s)) if flat else ahead.alt_rel_home_m + (home_m or 0.0)
        points_m = np.vstack([here_m, np.column_stack([east_m, north_m, up_m])])
        t_s = heard_s + np.concatenate([[0.0], ahead.t_s])
        return TimedLine(
            *((points_m, t_s) if ahead_s is None else _until(points_m, t_s, now_s + _middle_s(ahead, ahead_s))),
            radius_m,
            early_late_s=ahead.early_late_s,
            early_late_share=ahead.early_late_share,
        )
    speed_m_s = math.hypot(*v_enu_m_s)
    ends_s = now_s + ((ahead_s or AHEAD_S) if speed_m_s < STANDS_M_S else STRAIGHT_S) - heard_s
    points_m = np.stack([here_m, here_m + ends_s * v_enu_m_s])
    return TimedLine(points_m, np.array([heard_s, heard_s + ends_s]), radius_m, VEER_SHARE * speed_m_s)


def _middle_s(ahead: Ahead, end_s: float) -> float:
    """So far by the middle of its times: all that it may be on until then, where these are known as badly as a led
    way's; a plan's own margin is small beside what is looked ahead."""
    if ahead.early_late_share <= EARLY_LATE_SHARE:
        return end_s
    return (end_s + ahead.early_late_s) / (1.0 - ahead.early_late_share)


def _until(points_m: np.ndarray, t_s: np.ndarray, end_s: float) -> tuple[np.ndarray, np.ndarray]:
    """The line as far as that time; at its end the vehicle may stay for as long."""
    if t_s[-1] < end_s:
        return np.vstack([points_m, points_m[-1:]]), np.append(t_s, end_s)
    keep = int(np.searchsorted(t_s, end_s))
    last_m = [np.interp(end_s, t_s, points_m[:, axis]) for axis in range(3)]
    return np.vstack([points_m[:keep], [last_m]]), np.append(t_s[:keep], end_s)
