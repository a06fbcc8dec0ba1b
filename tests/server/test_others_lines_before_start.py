"""Before a start a mission is held against the lines that other stations tell: none of them makes a start refused."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapping.geometry.frames import moved_deg
from planning.following.separation import Nearest, nearest
from server.flying.apart import other_vehicles
from server.flying.apart.nearness import Flown
from server.flying.apart.other_vehicles import (
    HORIZON_S,
    MOST_LINES,
    OLD_S,
    PENDING,
    Other,
    OtherVehicles,
    meets_elsewhere,
)
from server.schemas import CheckRow
from tests.server.test_flying_apart_other_vehicles import ACROSS, EAST, SPEED_M_S, flying, standing, whole
from tests.server.test_flying_apart_other_vehicles import HOME_ALT_M as OWN_HOME_M
from tests.server.test_flying_apart_other_vehicles import NOW_S as THEN_S
from tests.server.test_other_stations import HOME, Desk
from tests.server.test_others_on_lines import AWAY, on


def elsewhere(plan: Any = EAST, *, gone_s: float = 30.0) -> Flown:
    """Another station's, in the air on a line of which heights count above the sea."""
    flown = flying(plan, gone_s).flown
    assert flown.ahead is not None
    ahead = replace(flown.ahead, alt_rel_home_m=flown.ahead.alt_rel_home_m + OWN_HOME_M)
    told = Flown("Wasp (Bravo 1)", replace(flown.state, home_alt_amsl_m=0.0), ahead, key="Bravo 1")
    return replace(told, ahead=None, told=told)


def raised(flown: Flown, up_m: float) -> Flown:
    told = flown.told
    assert told is not None
    assert told.ahead is not None
    ahead = replace(told.ahead, alt_rel_home_m=told.ahead.alt_rel_home_m + up_m)
    state = replace(told.state, alt_amsl_m=(told.state.alt_amsl_m or 0.0) + up_m)
    return replace(flown, state=state, told=replace(told, ahead=ahead, state=state))


def test_a_start_that_would_meet_it_by_the_predicted_times_is_to_be_accepted_and_never_refused() -> None:
    mine = standing(EAST)
    row = meets_elsewhere(mine, [elsewhere(gone_s=11.0)], THEN_S)
    assert row is not None
    assert (row.state, row.code) == ("accept", "others")
    assert row.text.startswith("Started now, it may come within 0 m of Wasp (Bravo 1) in ")
    assert row.mend == "Start later, and call the other station."
    # High above, or without a line, it says nothing; and nothing of that makes it good.
    for flown in (raised(elsewhere(gone_s=11.0), 300.0), replace(elsewhere(), told=None)):
        assert meets_elsewhere(mine, [flown], THEN_S) is None
    assert meets_elsewhere(replace(mine, on_board=None), [elsewhere()], THEN_S) is None


def test_what_is_quickly_known_is_told_first_and_what_its_line_meets_after_it() -> None:
    mine, told, desk, now_s = [standing(EAST)], list[CheckRow](), Desk(on(AWAY)), [THEN_S]
    rows = OtherVehicles(
        {1: lambda: mine[0]},
        {1: told.append},
        elsewhere=desk.it.row,
        flown_elsewhere=lambda now_s: [elsewhere(gone_s=11.0)],
        now_mono_s=lambda: now_s[0],
    )

    async def looks() -> None:
        await rows.look()
        await rows.look_along()
        await rows.look()
        # Of another mission, or long ago, it says nothing.
        mine[0] = standing(ACROSS)
        await rows.look()
        mine[0], now_s[0] = standing(EAST), THEN_S + OLD_S + 0.1
        await rows.look()

    asyncio.run(looks())
    quick = desk.it.row().text
    assert [row.state for row in told] == ["accept"] * 4
    assert told[1].text.startswith(f"{quick} Started now, it may come within 0 m of Wasp (Bravo 1)")
    assert [row.text for row in (told[0], *told[2:])] == [quick] * 3


def test_a_row_that_is_long_looked_for_is_pending(monkeypatch: pytest.MonkeyPatch) -> None:
    told, waited = list[CheckRow](), threading.Event()
    rows = OtherVehicles({1: lambda: standing(EAST)}, {1: told.append}, old_s=0.05)
    slowly = rows._rows

    def late(*given: Any) -> Any:
        assert waited.wait(30.0)
        return slowly(*given)

    monkeypatch.setattr(rows, "_rows", late)

    async def looked() -> None:
        looking = asyncio.ensure_future(rows.look())
        while not told:
            await asyncio.sleep(0.01)
        waited.set()
        await looking

    asyncio.run(asyncio.wait_for(looked(), 30.0))
    assert told == [PENDING]


def test_a_swarm_of_told_lines_is_bounded_work_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """Inside of a bend of the mission, where none is met."""
    looks = list[None]()

    def counted(*lines: Any, **more: Any) -> Nearest | None:
        looks.append(None)
        return nearest(*lines, **more)

    monkeypatch.setattr(other_vehicles, "nearest", counted)
    inside = elsewhere(whole((0, 300), (100, 300)), gone_s=11.0)
    swarm = [replace(inside, name=f"Wasp {k}") for k in range(MOST_LINES + 2)]
    row = meets_elsewhere(standing(whole((0, 0), (400, 0), (400, 400))), swarm, THEN_S)
    assert row is not None
    assert (row.state, len(looks)) == ("accept", 3 * MOST_LINES)
    assert row.text.endswith(f"the lines of Wasp {MOST_LINES}, Wasp {MOST_LINES + 1}.")
    # The first meeting is enough.
    looks.clear()
    assert meets_elsewhere(standing(EAST), [elsewhere(gone_s=11.0)] * 9, THEN_S) is not None
    assert len(looks) <= 3
    # What is later than the horizon is not looked at: of the whole mission only what is before.
    far_m = SPEED_M_S * HORIZON_S
    late = standing(whole((0, 0), (far_m, 0), (2 * far_m, 0)))
    looks.clear()
    assert meets_elsewhere(late, [elsewhere(whole((1.5 * far_m, 0), (1.6 * far_m, 0)))], THEN_S) is None
    assert len(looks) == 2


def test_own_and_others_are_not_mixed_up_in_the_check() -> None:
    """A line that meets nothing of ours leaves the row as it was: what flies on after its line's end is not known."""
    far = standing(EAST)
    assert isinstance(far, Other)
    lat_deg, lon_deg = moved_deg(HOME, 0.0, 50_000.0)
    told = elsewhere().told
    assert told is not None
    assert told.ahead is not None
    away = replace(
        told,
        state=replace(told.state, lat_deg=lat_deg, lon_deg=lon_deg),
        ahead=replace(told.ahead, lat_lon_deg=told.ahead.lat_lon_deg + np.array([0.45, 0.0])),
    )
    assert meets_elsewhere(far, [replace(away, ahead=None, told=away)], THEN_S) is None
