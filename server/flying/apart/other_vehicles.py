"""A row of the check before the start, where a station has several vehicles: does this mission meet another one?

What flies is judged by the predicted times at their worse end, as if the start were now. A mission that another vehicle
only has on board is judged without times: nothing tells when it will be flown. A plan that was taken up in flight is
judged alike, as if it were resumed now.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg, offset_m
from planning.following.separation import Nearest, TimedLine, nearest, ways_apart
from server.errors import reported
from server.flying.apart.nearness import (
    NEAR_M,
    RADIUS_M,
    Flown,
    both_ways,
    flown_of,
    line_of,
)
from server.flying.apart.way_apart import boxes_apart_m, where_parted
from server.heard.channel import Channel
from server.heard.plan_follower import EARLY_LATE_S, EARLY_LATE_SHARE, Whole
from server.schemas import CheckRow
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")

EVERY_S = 1.0
OLD_S = 5.0
"""What was looked at before that counts no more."""
HORIZON_S, MOST_LINES = 600.0, 8
"""So far, and against so many lines of other stations' vehicles, a mission is held."""
LONG_S = 1800.0
"""Half of this is longer than anything here flies home."""
_HOME_POINTS = 4
"""Of a whole way, at its end: the line's end, above it, above home, home."""
PENDING = CheckRow(
    code="others", state="unknown", text="Whether another vehicle's way comes near is not known yet.", mend="Wait."
)
_WORST_FIRST = "bad", "unknown", "accept", "good"
_ALONE = CheckRow(code="others", state="good", text="No other vehicle flies or has a mission on board.")
_CLEAR = CheckRow(code="others", state="good", text="No other vehicle's way comes near this one.")


@dataclass(frozen=True, slots=True)
class Other:
    """What is known of another vehicle's flight, or of its mission on board."""

    flown: Flown
    flies: bool
    on_board: Whole | None
    """Verified, and known here."""
    waits_in_air: bool = False
    """It holds, and what is on board was taken up and is not flown yet."""


@dataclass(frozen=True, slots=True)
class _Met:
    """What the look along the lines of others found for a mission."""

    on_board: Whole
    row: CheckRow
    t_mono_s: float

    def is_of(self, on_board: Whole | None) -> bool:
        mine = self.on_board
        return on_board is not None and all(
            np.array_equal(one, other)
            for one, other in (
                (mine.lat_lon_deg, on_board.lat_lon_deg),
                (mine.alt_rel_home_m, on_board.alt_rel_home_m),
            )
        )


def known(name: str, channel: Channel, *, is_verified: bool, waits_in_air: bool = False) -> Other:
    whole = channel.follower.whole() if is_verified else None
    return Other(flown_of(name, channel), channel.in_air or channel.led is not None, whole, waits_in_air)


class OtherVehicles:
    """Tells each vehicle that waits for its start, or in the air with a new plan, of the others, once a second.

    Belongs to the event loop.
    """

    def __init__(
        self,
        look: Mapping[int, Callable[[], Other]],
        tell: Mapping[int, Callable[[CheckRow], None]],
        *,
        elsewhere: Callable[[], CheckRow | None] = lambda: None,
        flown_elsewhere: Callable[[float], Sequence[Flown]] = lambda _: (),
        now_mono_s: Callable[[], float] = time.monotonic,
        old_s: float = OLD_S,
    ) -> None:
        """``look`` and ``tell`` by the vehicle's number; ``elsewhere``: what other stations make of it;
        ``flown_elsewhere``: their vehicles in the air."""
        self._look, self._tell, self._elsewhere, self._now_mono_s = look, tell, elsewhere, now_mono_s
        self._flown_elsewhere, self._old_s = flown_elsewhere, old_s
        self._met: dict[int, _Met] = {}

    async def run(self) -> None:
        """Until cancelled."""
        await asyncio.gather(self._again(self.look, self._tell_pending), self._again(self.look_along, self._met.clear))

    async def look(self) -> None:
        """What is quickly known, and what the last look along the lines of others found."""
        seen = {number: look() for number, look in self._look.items()}
        work = asyncio.ensure_future(asyncio.to_thread(self._rows, seen, self._elsewhere(), dict(self._met)))
        done, _ = await asyncio.wait({work}, timeout=self._old_s)
        if not done:
            self._tell_pending()
        rows = await work
        if done:
            for number, row in rows.items():
                self._tell[number](row)

    async def look_along(self) -> None:
        """Takes as long as it takes: no row waits for it."""
        seen, now_s = {number: look() for number, look in self._look.items()}, self._now_mono_s()
        flown = self._flown_elsewhere(now_s)
        for number, mine in seen.items():
            waits = mine.on_board is not None and (not mine.flies or mine.waits_in_air)
            met = await asyncio.to_thread(meets_elsewhere, mine, flown, now_s) if waits else None
            self._met.pop(number, None)
            if met is not None and mine.on_board is not None:
                self._met[number] = _Met(mine.on_board, met, now_s)

    async def _again(self, look: Callable[[], Coroutine[Any, Any, None]], or_else: Callable[[], None]) -> None:
        while True:
            try:
                await look()
            except Exception as error:
                log.warning("A mission against those of others: %s", reported(error, log, "Comparing missions").what)
                or_else()
            await asyncio.sleep(EVERY_S)

    def _tell_pending(self) -> None:
        for tell in self._tell.values():
            tell(PENDING)

    def _rows(
        self, seen: Mapping[int, Other], elsewhere: CheckRow | None, met: Mapping[int, _Met]
    ) -> dict[int, CheckRow]:
        now_s, rows = self._now_mono_s(), {}
        for number, mine in seen.items():
            if not mine.flies or mine.waits_in_air:
                row = row_against(mine, [other for key, other in seen.items() if key != number], now_s)
                row = row if elsewhere is None else _together(row, elsewhere)
                along = met.get(number)
                is_of_this = along is not None and along.is_of(mine.on_board) and now_s - along.t_mono_s <= self._old_s
                rows[number] = _together(row, along.row) if along is not None and is_of_this else row
        return rows


def meets_elsewhere(mine: Other, flown: Sequence[Flown], now_s: float) -> CheckRow | None:
    """To be accepted, where it would meet another station's vehicle on its told line, by the predicted times: the first
    that is found, within ``HORIZON_S`` and of the ``MOST_LINES`` nearest vehicles whose lines may come near.

    Never bad: nobody here can hold that vehicle, or tell whether its line is true. None says nothing: their way home is
    not told, nor what flies without a line.
    """
    if mine.on_board is None:
        return None
    origin_deg = float(mine.on_board.lat_lon_deg[0, 0]), float(mine.on_board.lat_lon_deg[0, 1])
    flat, looked_at, left_out = _home_alt_m(mine.flown.state) is None, 0, list[str]()
    way_m = _way_m(mine.on_board, origin_deg, mine.flown.state, flat=flat)
    parts = [_until(part, now_s + HORIZON_S) for part in _timed(mine.on_board, way_m, now_s)]
    for other in sorted(flown, key=lambda each: _off_m(origin_deg, each)):
        line = None if other.told is None else line_of(other.told, origin_deg, now_s, flat=flat, ahead_s=None)
        line = None if line is None else _until(line, now_s + HORIZON_S)
        if line is None or boxes_apart_m(way_m, line.points_enu_m) >= NEAR_M + RADIUS_M + line.radius_m:
            continue
        looked_at += 1
        if looked_at > MOST_LINES:
            left_out.append(other.name)
            continue
        for part in parts:
            met = None if part is None else nearest(part, line, since_s=now_s)
            if met is not None and met.distance_m < NEAR_M:
                return _meets(mine, other, met, origin_deg, now_s)
    if not left_out:
        return None
    text = f"Not held against this mission, because too many fly around it: the lines of {', '.join(left_out)}."
    return _row("accept", text, "Agree with whoever flies them.")


def _meets(mine: Other, other: Flown, met: Nearest, origin_deg: tuple[float, float], now_s: float) -> CheckRow:
    begun, begin = ("Resumed", "Resume") if mine.waits_in_air else ("Started", "Start")
    text = (
        f"{begun} now, it may come within {met.distance_m:.0f} m of {other.name} in {max(0.0, met.t_s - now_s):.0f} s,"
    )
    return _row("accept", f"{text} at {_place(origin_deg, met)}.", f"{begin} later, and call the other station.")


def _until(line: TimedLine, end_s: float) -> TimedLine | None:
    """Of what it may be on before that time; None: on nothing of it."""
    keep = int(np.searchsorted(line.t_s - line.early_late_s, end_s, side="right"))
    return None if not keep else replace(line, points_enu_m=line.points_enu_m[: keep + 1], t_s=line.t_s[: keep + 1])


def _off_m(origin_deg: tuple[float, float], other: Flown) -> float:
    return math.hypot(*offset_m(origin_deg, other.state.lat_deg or 0.0, other.state.lon_deg or 0.0))


def row_against(mine: Other, others: Sequence[Other], now_s: float) -> CheckRow:
    """The worst that one of them makes of it."""
    others = [other for other in others if other.flies or other.on_board is not None]
    if not others:
        return _ALONE
    if mine.on_board is None:
        return PENDING
    found = [row for other in others if (row := _against(mine, mine.on_board, other, now_s)) is not None]
    return min(found, key=lambda row: ("bad", "accept").index(row.state), default=_CLEAR)


def _together(row: CheckRow, elsewhere: CheckRow) -> CheckRow:
    """Both sentences where both are alike, else those of the worse."""
    if row.state != elsewhere.state:
        return min(row, elsewhere, key=lambda one: _WORST_FIRST.index(one.state))
    mend = " ".join(filter(None, (row.mend, elsewhere.mend)))
    return row.model_copy(update={"text": f"{row.text} {elsewhere.text}", "mend": mend})


def _against(who: Other, mine: Whole, other: Other, now_s: float) -> CheckRow | None:
    """None: it does not come near."""
    name, theirs, state = other.flown.name, other.flown.state, who.flown.state
    origin_deg = float(mine.lat_lon_deg[0, 0]), float(mine.lat_lon_deg[0, 1])
    flat = _home_alt_m(state) is None or _home_alt_m(theirs) is None
    way_m = _way_m(mine, origin_deg, state, flat=flat)
    if not other.flies:
        assert other.on_board is not None
        met = ways_apart(way_m, _way_m(other.on_board, origin_deg, theirs, flat=flat), radius_m=RADIUS_M)
        if met.distance_m >= NEAR_M:
            return None
        text = f"{name} has a mission on board that comes within {met.distance_m:.0f} m of this one,"
        return _row("accept", f"{text} at {_place(origin_deg, met)}.", "Fly one after the other, or plan them apart.")
    if other.flown.ahead is None or other.on_board is None or theirs.lat_deg is None:
        met = None
        if theirs.lat_deg is not None:
            met = _meets_unplanned(who, mine, way_m, other.flown, origin_deg, now_s, flat=flat)
        if met is not None:
            return _or_was_there(_too_near(who, name, met, origin_deg, now_s), theirs, now_s)
        text = f"{name} is in the air, and no plan tells where it will be."
        return _row("accept", text, "Agree with whoever flies it.")
    theirs_ahead = [line_of(other.flown, origin_deg, now_s, flat=flat, ahead_s=None)]
    their_way_m = _way_m(other.on_board, origin_deg, theirs, flat=flat)
    theirs_ahead.append(_home(their_way_m[-_HOME_POINTS:], float(theirs_ahead[0].t_s[-1]), now_s))
    if min(ways_apart(way_m, line.points_enu_m, radius_m=line.radius_m).distance_m for line in theirs_ahead) >= NEAR_M:
        return None
    met = _first([(one, line) for one in _timed(mine, way_m, now_s) for line in theirs_ahead], now_s)
    if met is None:
        begin = "Resume" if who.waits_in_air else "Start"
        text = f"Its line comes near that of {name}, but by the predicted times not while {name} is there."
        return _row("accept", text, f"{begin} now or once {name} has landed, and watch both.")
    return _too_near(who, name, met, origin_deg, now_s)


def _or_was_there(row: CheckRow, theirs: VehicleState, now_s: float) -> CheckRow:
    """Where it was last heard long ago nobody can lead it away, nor say that it is there still."""
    silent_s = 0.0 if theirs.position_t_mono_s is None else now_s - theirs.position_t_mono_s
    if silent_s <= OLD_S:
        return row
    return _row(
        "accept", f"{row.text} It was last heard {silent_s:.0f} s ago.", "Make sure that it has landed or is elsewhere."
    )


def _meets_unplanned(
    who: Other, mine: Whole, way_m: F64, other: Flown, origin_deg: tuple[float, float], now_s: float, *, flat: bool
) -> Nearest | None:
    """One that hovers, or is led along a way of its own: for as long as ``HORIZON_S``. Who holds beside it may be led
    away: what comes after they have parted counts."""
    theirs = [line_of(each, origin_deg, now_s, flat=flat, ahead_s=HORIZON_S) for each in both_ways(other)]
    parts = _timed(mine, way_m, now_s)
    if who.waits_in_air and not flat:
        here_m, near_m = theirs[0].points_enu_m[0], NEAR_M + RADIUS_M + theirs[0].radius_m
        if np.linalg.norm(parts[0].points_enu_m[0] - here_m) < near_m:
            parts = [where_parted(parts[0], here_m, near_m)[1] or parts[0], *parts[1:]]
    return _first([(one, line) for one in parts for line in theirs], now_s)


def _first(pairs: Sequence[tuple[TimedLine, TimedLine]], now_s: float) -> Nearest | None:
    """Where both come nearest; None: nowhere too near."""
    found = [met for one, other in pairs if (met := nearest(one, other, since_s=now_s)) and met.distance_m < NEAR_M]
    return min(found, key=lambda one: (one.distance_m, one.t_s), default=None)


def _too_near(who: Other, name: str, met: Nearest, origin_deg: tuple[float, float], now_s: float) -> CheckRow:
    begun, begin = ("Resumed", "Resume") if who.waits_in_air else ("Started", "Start")
    text = f"{begun} now, it may come within {met.distance_m:.0f} m of {name} in {max(0.0, met.t_s - now_s):.0f} s,"
    return _row("bad", f"{text} at {_place(origin_deg, met)}.", f"{begin} later, or land {name} first.")


def _timed(mine: Whole, way_m: F64, now_s: float) -> list[TimedLine]:
    """The climb to the first waypoint, the line, and the way home."""
    line_m, home_m = way_m[: 1 - _HOME_POINTS], way_m[-_HOME_POINTS:]
    if mine.t_s is None:
        return [TimedLine(way_m, np.full(len(way_m), now_s + LONG_S), RADIUS_M, early_late_s=LONG_S)]
    climbs, parts = 0, list[TimedLine]()
    if mine.takeoff_s > 0.0:
        climbs = min(max(1, int(np.searchsorted(mine.t_s, mine.takeoff_s))), len(line_m) - 1)
        up_s = now_s + np.linspace(0.0, mine.takeoff_s, climbs + 1)
        parts.append(TimedLine(line_m[: climbs + 1], up_s, RADIUS_M, early_late_s=EARLY_LATE_S + mine.takeoff_s))
    if climbs + 1 < len(line_m):
        span_s = EARLY_LATE_S + EARLY_LATE_SHARE * mine.takeoff_s
        parts.append(
            TimedLine(
                line_m[climbs:],
                now_s + mine.t_s[climbs:],
                RADIUS_M,
                early_late_s=span_s,
                early_late_share=EARLY_LATE_SHARE,
            )
        )
    return [*parts, _home(home_m, now_s + float(mine.t_s[-1]), now_s)]


def _home(points_m: F64, begins_s: float, now_s: float) -> TimedLine:
    """Nothing times it: the vehicle is somewhere on it from as early as it may begin until long after."""
    earliest_s = begins_s - EARLY_LATE_S - EARLY_LATE_SHARE * (begins_s - now_s)
    return TimedLine(points_m, np.full(len(points_m), earliest_s + LONG_S), RADIUS_M, early_late_s=LONG_S)


def _way_m(of: Whole, origin_deg: tuple[float, float], state: VehicleState | None, *, flat: bool) -> F64:
    """(N, 3) east, north and above the sea; ``flat``: all at one height."""
    east_m, north_m = offset_m(origin_deg, of.lat_lon_deg[:, 0], of.lat_lon_deg[:, 1])
    up_m = np.zeros(len(east_m)) if flat else of.alt_rel_home_m + (_home_alt_m(state) or 0.0)
    return np.column_stack([east_m, north_m, up_m])


def _home_alt_m(state: VehicleState | None) -> float | None:
    """Above the sea; before it arms a vehicle's home is where it stands."""
    if state is None:
        return None
    if not state.armed and state.alt_amsl_m is not None:
        return state.alt_amsl_m
    return state.home_alt_amsl_m


def _place(origin_deg: tuple[float, float], met: Nearest) -> str:
    lat_deg, lon_deg = moved_deg(origin_deg, met.at_enu_m[0], met.at_enu_m[1])
    return f"{lat_deg:.7f}, {lon_deg:.7f}"


def _row(state: str, text: str, mend: str) -> CheckRow:
    return CheckRow.model_validate({"code": "others", "state": state, "text": text, "mend": mend})
