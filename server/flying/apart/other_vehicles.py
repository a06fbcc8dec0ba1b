"""A row of the check before the start, where a station has several vehicles: does this mission meet another one?

What flies is judged by the predicted times at their worse end, as if the start were now. A mission that another vehicle
only has on board is judged without times: nothing tells when it will be flown. A plan that was taken up in flight is
judged alike, as if it were resumed now.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg, offset_m
from planning.following.separation import Nearest, TimedLine, nearest, ways_apart
from server.errors import reported
from server.flying.apart.nearness import (
    EARLY_LATE_S,
    EARLY_LATE_SHARE,
    NEAR_M,
    RADIUS_M,
    Flown,
    line_of,
)
from server.heard.channel import Channel
from server.heard.plan_follower import Whole
from server.schemas import CheckRow
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")

EVERY_S = 1.0
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


def known(name: str, channel: Channel, *, is_verified: bool, waits_in_air: bool = False) -> Other:
    state, follower = channel.state, channel.follower
    flown = Flown(name, state or VehicleState(0, 0), follower.ahead(channel.flight))
    return Other(flown, channel.in_air, follower.whole() if is_verified else None, waits_in_air)


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
    ) -> None:
        """``look`` and ``tell`` by the vehicle's number; ``elsewhere``: what other stations make of it;
        ``flown_elsewhere``: their vehicles in the air."""
        self._look, self._tell, self._elsewhere, self._now_mono_s = look, tell, elsewhere, now_mono_s
        self._flown_elsewhere = flown_elsewhere

    async def run(self) -> None:
        """Until cancelled."""
        while True:
            try:
                await self.look()
            except Exception as error:
                log.warning("A mission against those of others: %s", reported(error, log, "Comparing missions").what)
                for tell in self._tell.values():
                    tell(PENDING)
            await asyncio.sleep(EVERY_S)

    async def look(self) -> None:
        seen = {number: look() for number, look in self._look.items()}
        elsewhere, flown = self._elsewhere(), self._flown_elsewhere(self._now_mono_s())
        for number, row in (await asyncio.to_thread(self._rows, seen, elsewhere, flown)).items():
            self._tell[number](row)

    def _rows(
        self, seen: Mapping[int, Other], elsewhere: CheckRow | None, flown: Sequence[Flown]
    ) -> dict[int, CheckRow]:
        now_s, rows = self._now_mono_s(), {}
        for number, mine in seen.items():
            if not mine.flies or mine.waits_in_air:
                row = row_against(mine, [other for key, other in seen.items() if key != number], now_s)
                theirs = meets_elsewhere(mine, flown, now_s) or elsewhere
                rows[number] = row if theirs is None else _together(row, theirs)
        return rows


def meets_elsewhere(mine: Other, flown: Sequence[Flown], now_s: float) -> CheckRow | None:
    """Bad, where it would meet another station's vehicle on the line that this one flies, by the predicted times.

    None says nothing: their way home is not told, nor what flies without a line.
    """
    if mine.on_board is None:
        return None
    origin_deg = float(mine.on_board.lat_lon_deg[0, 0]), float(mine.on_board.lat_lon_deg[0, 1])
    found = list[tuple[Nearest, Flown]]()
    for other in flown:
        if other.ahead is None:
            continue
        flat = _home_alt_m(mine.flown.state) is None
        way_m = _way_m(mine.on_board, origin_deg, mine.flown.state, flat=flat)
        line = line_of(other, origin_deg, now_s, flat=flat, ahead_s=None)
        if ways_apart(way_m, line.points_enu_m, radius_m=max(RADIUS_M, line.radius_m)).distance_m >= NEAR_M:
            continue
        met = [nearest(one, line, since_s=now_s) for one in _timed(mine.on_board, way_m, now_s)]
        found += [(at, other) for at in met if at is not None and at.distance_m < NEAR_M]
    if not found:
        return None
    at, other = min(found, key=lambda each: (each[0].distance_m, each[0].t_s))
    begun, begin = ("Resumed", "Resume") if mine.waits_in_air else ("Started", "Start")
    text = f"{begun} now, it may come within {at.distance_m:.0f} m of {other.name} in {max(0.0, at.t_s - now_s):.0f} s,"
    return _row("bad", f"{text} at {_place(origin_deg, at)}.", f"{begin} later, and call the other station.")


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
    begun, begin = ("Resumed", "Resume") if who.waits_in_air else ("Started", "Start")
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
        text = f"{name} is in the air, and no plan tells where it will be."
        return _row("accept", text, "Agree with whoever flies it.")
    theirs_ahead = [line_of(other.flown, origin_deg, now_s, flat=flat, ahead_s=None)]
    their_way_m = _way_m(other.on_board, origin_deg, theirs, flat=flat)
    theirs_ahead.append(_home(their_way_m[-_HOME_POINTS:], float(theirs_ahead[0].t_s[-1]), now_s))
    if min(ways_apart(way_m, line.points_enu_m, radius_m=line.radius_m).distance_m for line in theirs_ahead) >= NEAR_M:
        return None
    pairs = [(one, line) for one in _timed(mine, way_m, now_s) for line in theirs_ahead]
    found = [
        met for one, line in pairs if (met := nearest(one, line, since_s=now_s)) is not None and met.distance_m < NEAR_M
    ]
    if not found:
        text = f"Its line comes near that of {name}, but by the predicted times not while {name} is there."
        return _row("accept", text, f"{begin} now or once {name} has landed, and watch both.")
    met = min(found, key=lambda one: (one.distance_m, one.t_s))
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
