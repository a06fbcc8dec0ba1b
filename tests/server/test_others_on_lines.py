"""Lines that vehicles fly, from station to station: told within their error, used while they are flown, drawn."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.frames import moved_deg, offset_m
from planning.following.reference import Reference
from server.flying.apart import own_lines
from server.flying.apart.nearness import NEAR_M, Flown, near_each_other
from server.flying.apart.other_stations import OLD_S as POSITION_OLD_S
from server.flying.apart.others_lines import OthersLines
from server.flying.apart.others_placed import placed_vehicles
from server.flying.apart.own_lines import OwnLines, line_of_plan
from server.heard.plan_follower import NO_FLIGHT, OFF_LINE_M, Follower
from server.scene.layers.other_stations_layer import other_vehicle_nodes
from telemetry.stations.plan_lines import MOST_ERROR_M, MOST_POINTS, PlanLine, line_id, packed, unpacked
from telemetry.topics.messages import FlightStatus
from telemetry.topics.station_vehicles import FleetLine, OtherVehicle
from telemetry.topics.vehicle import VehicleState
from tests.server.test_other_stations import HOME, NOW_S, Desk, other
from tests.server.test_scene_obstacles import placed

FLYING = FlightStatus("auto", "flying")


def line(*east_north_t: tuple[float, float, float], alt_amsl_m: float = 500.0, error_m: float = 0.0) -> bytes:
    """Through places around home, each at its time."""
    places = np.array([moved_deg(HOME, east_m, north_m) for east_m, north_m, _ in east_north_t])
    t_s = np.array([t_s for *_, t_s in east_north_t])
    return packed(PlanLine(places, np.full(len(t_s), alt_amsl_m), t_s, error_m))


AWAY = line((100, 0, 0), (70, 0, 3), (70, 400, 43))
"""It comes west at 10 m/s, and turns north before it is here."""
HERE_LATER = line((100, 300, 0), (100, 0, 30), (0, 0, 40))


def near_m(told: OtherVehicle, payload: bytes | None) -> float:
    desk = Desk()
    desk.tell(told, lines=() if payload is None else (FleetLine("Bravo", 1, payload),))
    return desk.near_m()


def on(payload: bytes, east_m: float = 100.0, line_s: float | None = 0.0, **more: Any) -> OtherVehicle:
    return other(east_m, line=line_id(payload), line_s=line_s, **{"east_m_s": -10.0, "age_s": 0.0, **more})


def along_m(told: OtherVehicle, payload: bytes) -> float | None:
    """As it is judged on its line alone; None: it is not."""
    desk = Desk()
    desk.tell(told, lines=(FleetLine("Bravo", 1, payload),))
    (flown,) = desk.it.flown(NOW_S)
    hovers = VehicleState(1, 1, armed=True, position_t_mono_s=NOW_S, lat_deg=HOME[0], lon_deg=HOME[1])
    found = flown.told and near_each_other(Flown("Bee", replace(hovers, alt_amsl_m=500.0), None), flown.told, NOW_S)
    return None if found is None else found.distance_m


def test_one_that_turns_away_on_its_line_may_fly_straight_on() -> None:
    assert near_m(on(AWAY), AWAY) == near_m(on(AWAY), None) == 0.0
    away_m = along_m(on(AWAY), AWAY)
    assert away_m is not None
    assert 45.0 < away_m < 65.0
    # Where it was a second ago, it is a second on by now.
    assert along_m(on(AWAY, 100.0, age_s=1.0), AWAY) == pytest.approx(away_m, abs=3.0)
    # Past its turn, north of here: what lies behind it counts no more.
    lat_deg, lon_deg = moved_deg(HOME, 70.0, 200.0)
    past = on(AWAY, lat_deg=lat_deg, lon_deg=lon_deg, line_s=23.0, v_enu_m_s=(0.0, 10.0, 0.0))
    assert near_m(past, AWAY) > 180.0


@settings(deadline=None, max_examples=60)
@given(
    st.floats(-200.0, 200.0), st.floats(-14.0, 14.0), st.tuples(*[st.floats(-12.0, 12.0)] * 3),
    st.floats(0.0, 30.0), st.floats(0.0, 4.0), st.lists(st.tuples(*[st.floats(-150.0, 150.0)] * 2), max_size=4),
)  # fmt: skip
def test_a_line_only_ever_adds_whatever_it_says(
    east_m: float, off_m: float, v_enu_m_s: tuple[float, float, float], line_s: float, age_s: float, turns: list[Any]
) -> None:
    """What stands in AUTO, waits at a waypoint, drifts off or flies on behind its line's end is judged straight on."""
    points = [(east_m, 0.0, 0.0), (east_m, 0.0, 15.0)]
    points += [(e_m, n_m, 25.0 + 10.0 * k) for k, (e_m, n_m) in enumerate(turns)]
    payload = line(*points, alt_amsl_m=500.0 + off_m)
    told = on(payload, east_m, line_s, v_enu_m_s=v_enu_m_s, age_s=age_s)
    assert near_m(told, payload) <= near_m(told, None)


def test_of_a_line_on_which_it_is_not_nothing_is_taken() -> None:
    """A home that is told wrong, or a line elsewhere, whatever place on it is said to be its."""
    off_m = OFF_LINE_M + unpacked(AWAY).error_m
    assert along_m(on(AWAY, alt_amsl_m=500.0 + off_m - 0.1), AWAY) is not None
    for odd in (on(AWAY, alt_amsl_m=500.0 + off_m + 0.1), on(AWAY, 100.0 + off_m + 0.2), on(AWAY, line_s=20.0)):
        assert along_m(odd, AWAY) is None
        assert near_m(odd, AWAY) == near_m(odd, None)


def test_a_line_that_is_too_wrong_is_not_used() -> None:
    lines = [line((100, 0, 0), (70, 0, 3), (70, 400, 43), error_m=error_m) for error_m in (14.8, 15.1)]
    assert [along_m(on(each), each) is not None for each in lines] == [True, False]


def test_one_that_turns_towards_ours_later_is_an_alarm_now() -> None:
    lat_deg, lon_deg = moved_deg(HOME, 100.0, 300.0)
    told = on(HERE_LATER, lat_deg=lat_deg, lon_deg=lon_deg, v_enu_m_s=(0.0, -10.0, 0.0))
    assert near_m(told, None) > NEAR_M + 50.0
    assert near_m(told, HERE_LATER) == 0.0


def test_what_its_line_may_be_wrong_by_is_added() -> None:
    exact_m = along_m(on(AWAY), AWAY)
    assert exact_m is not None
    rough = line((100, 0, 0), (70, 0, 3), (70, 400, 43), error_m=10.0)
    assert along_m(on(rough), rough) == pytest.approx(exact_m - 2 * 10.0, abs=0.5)
    # And how far it is beside the line now.
    assert along_m(on(AWAY, alt_amsl_m=512.0), AWAY) == pytest.approx(exact_m - 12.0, abs=2.0)
    assert (along_m(on(AWAY, unsure_s=1.0), AWAY) or 0.0) <= exact_m - 9.0


@pytest.mark.parametrize(
    "odd",
    [
        pytest.param(on(AWAY, line_s=None), id="it has left its line"),
        pytest.param(on(AWAY, line_s=43.5), id="it is over"),
        pytest.param(on(HERE_LATER), id="it flies another one"),
        pytest.param(other(100.0, east_m_s=-10.0, age_s=0.0), id="it tells of none"),
        pytest.param(on(AWAY, age_s=POSITION_OLD_S + 0.1), id="its position is old"),
        pytest.param(on(AWAY, age_s=None), id="the clocks are not compared"),
        pytest.param(on(AWAY, alt_amsl_m=None), id="its height is not known"),
        pytest.param(on(AWAY, age_s=100.0), id="it is not heard any more"),
    ],
)
def test_else_it_flies_straight_on_as_without_a_line(odd: OtherVehicle) -> None:
    assert along_m(odd, AWAY) is None
    assert near_m(odd, AWAY) == near_m(odd, None)


def test_lines_are_forgotten_with_what_tells_them_and_odd_ones_left_out() -> None:
    lines, desk = OthersLines(), Desk(on(AWAY))
    assert desk.it.status is not None
    told = replace(desk.it.status, lines=(FleetLine("Bravo", 1, AWAY), FleetLine("Bravo", 2, b"odd")))
    lines.on_status(told)
    assert lines.of(told.vehicles[0]) is not None
    lines.on_status(replace(told, lines=()))
    assert lines.of(told.vehicles[0]) is None


# Told by this station


def reference(count: int, *, seed: int = 1) -> Any:
    """A plan over the hill, as it is followed."""
    drawn, dsm = np.random.default_rng(seed), placed()[0].dsm
    points_m = np.cumsum(drawn.normal(0.0, 6.0, (count, 3)), axis=0) + np.array([500_000.0, 3_999_940.0, 950.0])
    arrive_s = 10.0 + np.cumsum(drawn.exponential(2.0, count))
    leave_s = arrive_s + (drawn.random(count) < 0.3)
    arrive_s[1:] = np.maximum(arrive_s[1:], leave_s[:-1])
    leave_s = np.maximum(leave_s, arrive_s)
    line = Reference(
        points_m, np.arange(float(count)), np.zeros(count - 1, dtype=np.int64), arrive_s, leave_s, 10.0, 100.0, 200.0,
        (500_000.0, 3_999_940.0), 900.0, 0, count, tuple(points_m[0].tolist()),
    )  # fmt: skip
    return SimpleNamespace(reference=line, placer=SimpleNamespace(dsm=dsm))


@pytest.mark.parametrize("count", [2, 30, 600])
def test_a_told_line_is_never_farther_from_the_plan_than_it_says(count: int) -> None:
    followed = reference(count)
    made = line_of_plan(followed, 480.0)
    assert made is not None
    heard = unpacked(packed(made))
    assert len(heard.t_s) <= MOST_POINTS
    plan, dsm = followed.reference, followed.placer.dsm
    when_s = np.linspace(plan.arrive_s[0], plan.leave_s[-1], 4001)
    plan_s = np.column_stack([plan.arrive_s, plan.leave_s]).ravel()
    true = np.column_stack([np.interp(when_s, plan_s, np.repeat(plan.points_m[:, axis], 2)) for axis in range(3)])
    true_deg, origin_deg = dsm.lat_lon_from_xy(true[:, :2]), tuple(heard.lat_lon_deg[0])
    told_deg = np.column_stack([np.interp(when_s, heard.t_s, heard.lat_lon_deg[:, axis]) for axis in (0, 1)])
    apart_m = np.column_stack(
        [
            np.subtract(offset_m(origin_deg, *told_deg.T)[0], offset_m(origin_deg, *true_deg.T)[0]),
            np.subtract(offset_m(origin_deg, *told_deg.T)[1], offset_m(origin_deg, *true_deg.T)[1]),
            np.interp(when_s, heard.t_s, heard.alt_amsl_m) - (true[:, 2] - 900.0 + 480.0),
        ]
    )
    assert np.linalg.norm(apart_m, axis=1).max() <= heard.error_m
    assert heard.error_m < (2.0 if count < MOST_POINTS / 2 else 30.0)


def test_a_plan_without_times_is_not_told() -> None:
    followed = reference(5)
    plan = replace(followed.reference, leave_s=np.full(5, np.nan))
    assert line_of_plan(SimpleNamespace(reference=plan, placer=followed.placer), 480.0) is None  # type: ignore[arg-type]


def test_a_line_that_would_be_too_wrong_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    followed = reference(30)
    made = line_of_plan(followed, 480.0)
    assert made is not None
    channel: Any = SimpleNamespace(
        state=VehicleState(1, 1, home_alt_amsl_m=480.0),
        follower=SimpleNamespace(followed=followed, line_s=lambda flight: 12.5),
        flight=FLYING,
        in_air=True,
    )
    for error_m, count in ((MOST_ERROR_M - 0.2, 1), (MOST_ERROR_M - 0.1, 0)):
        rough = replace(made, error_m=error_m)
        monkeypatch.setattr(own_lines, "line_of_plan", lambda *_, rough=rough: rough)
        lines = OwnLines({2: channel})
        asyncio.run(lines.look())
        assert len(lines.lines()) == count
        assert (lines.told(2)[0] != 0) == bool(count)
    assert unpacked(packed(replace(made, error_m=MOST_ERROR_M - 0.2))).error_m <= MOST_ERROR_M


def test_a_line_is_told_in_the_air_and_only_of_the_plan_that_is_followed() -> None:
    followed = reference(30)
    follower = SimpleNamespace(followed=followed, line_s=lambda flight: 12.5)
    state = VehicleState(1, 1, home_alt_amsl_m=480.0)
    channel: Any = SimpleNamespace(state=state, follower=follower, flight=FLYING, in_air=True)
    lines = OwnLines({2: channel})
    assert (lines.told(2), lines.lines()) == ((0, None), [])
    asyncio.run(lines.look())
    (told,) = lines.lines()
    assert (told.number, lines.told(2)) == (2, (line_id(told.packed), 12.5))
    # Another plan: from the first moment on it is not the old one that it flies.
    follower.followed = reference(30, seed=2)
    assert lines.told(2) == (0, None)
    asyncio.run(lines.look())
    assert lines.lines()[0].packed != told.packed
    # Home has moved up: so have its heights above the sea.
    before = unpacked(lines.lines()[0].packed)
    channel.state = replace(state, home_alt_amsl_m=490.0)
    asyncio.run(lines.look())
    assert unpacked(lines.lines()[0].packed).alt_amsl_m == pytest.approx(before.alt_amsl_m + 10.0)
    channel.in_air = False
    asyncio.run(lines.look())
    assert (lines.told(2), lines.lines()) == ((0, None), [])


@pytest.mark.parametrize(
    ("phase", "cross_m", "height_m", "is_told"),
    [
        ("flying", 3.0, -2.0, True),
        ("flying", OFF_LINE_M, 1.0, False),
        ("flying", 0.0, -OFF_LINE_M - 0.1, False),
        ("paused", 0.0, 0.0, False),
        ("returning", 0.0, 0.0, False),
    ],
)
def test_one_that_left_its_line_is_not_told_to_fly_it(
    phase: Any, cross_m: float, height_m: float, *, is_told: bool
) -> None:
    follower: Any = Follower(reference(30))
    at = SimpleNamespace(cross_track_m=cross_m, height_error_m=height_m, leg=3, share=0.5)
    follower._following = SimpleNamespace(at=at, begun=True)
    plan = follower.followed.reference
    told_s = follower.line_s(FlightStatus("auto", phase))
    assert follower.line_s(FlightStatus("guided", phase)) is None
    follower._following.begun = False
    assert follower.line_s(FlightStatus("auto", phase)) is None
    assert (told_s is not None) == is_told
    if told_s is not None:
        assert told_s == pytest.approx((plan.leave_s[3] + plan.arrive_s[4]) / 2)
    assert Follower().line_s(NO_FLIGHT) is None


def test_what_is_left_of_its_line_is_drawn_while_it_is_on_it() -> None:
    drawing, placing = placed()
    lat_deg, lon_deg = placing.origin.lat_deg, placing.origin.lon_deg
    places = np.array([moved_deg((lat_deg, lon_deg), 10.0 * step, 0.0) for step in range(4)])
    told = PlanLine(places, np.array([500.0, 510.0, 520.0, 530.0]), np.arange(4.0), 0.1)
    here = other(lat_deg=lat_deg, lon_deg=lon_deg, alt_surface_m=10.0, line=7, line_s=1.5)
    (shown,) = placed_vehicles([here], drawing.dsm, NOW_S, lambda _: told)
    assert shown.line_m is not None
    assert shown.line_m[:, 2] - shown.place_m[2] == pytest.approx([20.0, 30.0])
    names = [node.name for node in other_vehicle_nodes(drawing, [shown])]
    assert [name for name in names if name.endswith("/line")] == ["/traffic/Bravo_1/line"]
    (old,) = placed_vehicles([here], drawing.dsm, NOW_S + 8.0, lambda _: told)
    (none,) = placed_vehicles([here], drawing.dsm, NOW_S)
    assert (old.line_m, none.line_m) == (None, None)
