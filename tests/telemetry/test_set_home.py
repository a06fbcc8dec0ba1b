"""Home set by order: both autopilots obey, nothing is called somebody else's, and nothing paused is gone on with."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from mapping.geometry.frames import apart_m, moved_deg
from telemetry.errors import NotAllowedError, RefusedError
from telemetry.flight.guided.beginning import check_stands_there, home_elsewhere
from telemetry.flight.guided.script_watches import HomeWatched
from telemetry.flight.home_watch import CORRECTED_M, HomePlace, HomeWatch, home_of, is_there
from telemetry.topics.messages import FlightStatus, GuidedTarget
from telemetry.topics.requests import FlyManoeuvre, FlyRest, FlyWay, Resume, SetHome, StartAuto, StartGuided, TakeUp
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.link_bench import ME, Console, until
from tests.telemetry.own_time import run
from tests.telemetry.simulator_bench import Bench
from tests.telemetry.test_home_watch import HOME, moved, state
from tests.telemetry.test_mavlink_flights import QUICKLY_DOWN, TARGETS, items, simulated, start, upload
from tests.telemetry.test_mission_taken_up import VEHICLES, holding, put_on_board
from tests.telemetry.test_px4_flights import QUICK
from tests.telemetry.test_px4_simulator import ready

SET_HOME, ARM = wire.MAV_CMD_DO_SET_HOME, 400
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)


def beside(told: VehicleState, east_m: float, up_m: float = 0.0) -> SetHome:
    home = home_of(told)
    assert home is not None
    lat_deg, lon_deg = moved_deg((home.lat_deg, home.lon_deg), east_m, 0.0)
    return SetHome(ME, lat_deg, lon_deg, home.alt_amsl_m + up_m)


def is_home(bench: Console, wanted: SetHome) -> bool:
    home = home_of(bench.state)
    wanted_deg = wanted.lat_deg, wanted.lon_deg
    return home is not None and apart_m((home.lat_deg, home.lon_deg), wanted_deg) < 0.1


def test_it_is_set_told_and_written_down_and_what_is_paused_does_not_go_on() -> None:
    async def whole() -> None:
        async with holding("ardupilot", QUICKLY_DOWN) as (bench, _, _digest):
            wanted = beside(bench.state, 25.0, -3.0)
            await bench.handle(wanted)
            await until(lambda: is_home(bench, wanted))
            assert not [text for text in bench.texts if "Home has moved" in text], "it is our own order"
            assert [words for words in bench.commands if words.startswith("set home to")]
            with pytest.raises(NotAllowedError, match="certified for the home before") as refused:
                await bench.handle(Resume(ME))
            said = f"{refused.value.what} {refused.value.advice}"
            await until(lambda: bench.last(FlightStatus).not_resumed == said)

    run(whole)


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_a_home_that_somebody_else_moved_in_flight_keeps_resume_back(autopilot: str, parameters: object) -> None:
    async def whole() -> None:
        async with holding(autopilot, parameters) as (bench, simulator, _digest):
            pilot = simulator.vehicle.autopilot
            north_m, east_m, up_m = pilot.home_neu
            pilot.fix_home((north_m, east_m + 25.0, up_m))
            await until(lambda: [text for text in bench.texts if "25 m to the east" in text])
            with pytest.raises(NotAllowedError, match="certified for the home before"):
                await bench.handle(Resume(ME))

    run(whole)


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_what_was_certified_for_the_home_before_is_refused_at_the_link_itself(
    autopilot: str, parameters: object
) -> None:
    """Whoever judged it may not have heard of the other home; 0.7 m higher is nearer than a way may begin."""

    async def whole() -> None:
        async with holding(autopilot, parameters) as (bench, simulator, _digest):
            pilot, judged = simulator.vehicle.autopilot, home_of(bench.state)
            assert judged is not None
            hovers, up_m = bench.state, bench.state.alt_rel_home_m
            assert hovers.lat_deg is not None
            assert hovers.lon_deg is not None
            assert up_m is not None
            place = (hovers.lat_deg, hovers.lon_deg)
            ends = (GuidedTarget(0, *place, up_m + 1.0, 2.0),)
            north_m, east_m, above_m = pilot.home_neu
            report = await put_on_board(bench)

            async def refused(words: str) -> None:
                now_up_m = bench.state.alt_rel_home_m or 0.0
                way = FlyWay(ME, ends, *place, now_up_m, 4.0, spare_m=5.0, home=judged)
                for order in (way, TakeUp(ME, report.onboard.digest, *place, now_up_m, judged)):
                    with pytest.raises(NotAllowedError, match=words):
                        await bench.handle(order)

            pilot.fix_home((north_m, east_m, above_m + 0.7))
            await until(lambda: not is_there(home_of(bench.state), judged))
            await refused(r"Home was moved by 0\.7 m since this was certified")
            pilot.fix_home((north_m, east_m + 25.0, above_m))
            await until(lambda: [text for text in bench.texts if "25 m to the east" in text])
            await refused(r"Home was moved by 2[45]\.\d m since this was certified")
            with pytest.raises(NotAllowedError, match="certified for the home before"):
                await bench.handle(FlyRest(ME, ends))
            with pytest.raises(NotAllowedError, match="certified for the home before"):
                await bench.handle(FlyManoeuvre(ME, "over", ends, None))
            pilot.fix_home((north_m, east_m, above_m))
            await until(lambda: is_there(home_of(bench.state), judged))
            await bench.handle(FlyWay(ME, ends, *place, up_m, 4.0, spare_m=5.0, home=judged))
            await until(lambda: bench.flight.is_flown)

    run(whole)


def test_it_is_not_set_while_a_mission_is_flown_nor_elsewhere_on_the_ground() -> None:
    async def whole() -> None:
        async with simulated() as (bench, simulator):
            await until(lambda: home_of(bench.state) is not None and bench.state.lat_deg is not None)
            with pytest.raises(NotAllowedError, match=r"40\.\d m beside"):
                await bench.handle(beside(bench.state, 40.0))
            here = beside(bench.state, 0.5)
            await bench.handle(here)
            await until(lambda: is_home(bench, here))
            pilot = simulator.vehicle.autopilot
            assert pilot.home_is_fixed

    run(whole)


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_nothing_starts_with_a_home_that_was_fixed_elsewhere(autopilot: str, parameters: object) -> None:
    async def whole() -> None:
        async with simulated(autopilot=autopilot, parameters=parameters, speedup=8.0) as (bench, simulator):
            report = await upload(bench, items(3))
            pilot = simulator.vehicle.autopilot
            await until(lambda: pilot.position_ok and home_of(bench.state) is not None)
            north_m, east_m, up_m = pilot.home_neu
            before = home_of(bench.state)
            pilot.fix_home((north_m + 30.0, east_m, up_m))
            await until(lambda: before is not None and not is_there(home_of(bench.state), before))
            with pytest.raises(NotAllowedError, match="30 m from where the vehicle stands"):
                await bench.handle(StartAuto(ME, report.onboard.digest))
            await until(lambda: not bench.state.armed and not pilot.armed)
            north_m, east_m, up_m = pilot.p_neu
            pilot.fix_home((north_m, east_m, up_m - 1.5))
            await until(lambda: (bench.state.alt_rel_home_m or 0.0) > 1.2)
            with pytest.raises(NotAllowedError, match=r"1\.[3-7] m above home"):
                await bench.handle(StartGuided(ME, TARGETS, 10.0))
            await until(lambda: not bench.state.armed and not pilot.armed)
            if autopilot == "ardupilot":
                with pytest.raises(NotAllowedError, match=r"1\.[3-7] m above home"):
                    await bench.handle(StartAuto(ME, report.onboard.digest, 2, 20.0))
                await until(lambda: not bench.state.armed and not pilot.armed)
            pilot.fix_home(pilot.p_neu)
            await start(bench, StartAuto(ME, report.onboard.digest))

    run(whole)


def test_a_px4_in_flight_refuses_in_its_own_words_and_its_mission_may_go_on() -> None:
    async def whole() -> None:
        async with holding("px4", QUICK) as (bench, _, _digest):
            with pytest.raises(RefusedError, match="set home"):
                await bench.handle(beside(bench.state, 25.0))
            assert not is_home(bench, beside(bench.state, 25.0))
            await until(lambda: bench.last(FlightStatus).not_resumed == "")
            await bench.handle(Resume(ME))
            await until(lambda: bench.flight.phase == "flying")

    run(whole)


def test_somebody_elses_home_is_an_alarm_beside_an_order_of_our_own() -> None:
    watch = HomeWatch()
    assert watch.on_state(state(HOME)) is None
    watch.expect(moved(40.0, 0.0, 2.0))
    assert watch.on_state(state(moved(-40.0, 0.0, 0.0))) is not None
    assert watch.on_state(state(moved(40.2, 0.0, 2.1))) is None
    watch.expect(None)
    assert watch.on_state(state(moved(40.0, 0.0, 2.0))) is None
    assert watch.on_state(state(HOME)) is not None


@pytest.mark.parametrize(
    ("east_m", "up_m", "refused"), [(0.0, 0.0, False), (2.9, 1.9, False), (3.2, 0.0, True), (0.0, -2.2, True)]
)
def test_on_the_ground_it_is_set_where_the_vehicle_stands(east_m: float, up_m: float, refused: bool) -> None:
    stands = VehicleState(
        1, 1, lat_deg=HOME.lat_deg, lon_deg=HOME.lon_deg, alt_amsl_m=HOME.alt_amsl_m, position_t_mono_s=10.0
    )
    if not refused:
        check_stands_there(stands, moved(east_m, 0.0, up_m), 10.0)
        return
    with pytest.raises(NotAllowedError, match="the vehicle"):
        check_stands_there(stands, moved(east_m, 0.0, up_m), 10.0)


def test_where_the_vehicle_stands_must_be_known_and_of_now() -> None:
    stands = VehicleState(
        1, 1, lat_deg=HOME.lat_deg, lon_deg=HOME.lon_deg, alt_amsl_m=HOME.alt_amsl_m, position_t_mono_s=10.0
    )
    for now_s, told in ((13.0, stands), (10.0, VehicleState(1, 1))):
        with pytest.raises(NotAllowedError, match="not known"):
            check_stands_there(told, HOME, now_s)


@pytest.mark.parametrize(
    ("autopilot", "spare_m", "to", "ends"),
    [
        ("px4", None, (0.0, 0.0, CORRECTED_M - 0.1), False),
        ("px4", 5.0, (0.9, 0.0, -CORRECTED_M + 0.1), False),
        ("px4", 5.0, (0.0, 0.0, CORRECTED_M + 0.1), True),
        ("px4", None, (0.0, 0.0, -CORRECTED_M - 0.1), True),
        ("px4", 1.0, (0.0, 0.0, -1.2), True),
        ("px4", 0.0, (0.0, 0.0, 0.25), False),
        ("px4", 0.0, (0.0, 0.0, 0.35), True),
        ("ardupilot", 5.0, (0.0, 0.0, 0.45), False),
        ("ardupilot", 5.0, (0.0, 0.0, 0.6), True),
        ("ardupilot", None, (0.0, 1.2, 0.0), True),
    ],
)
def test_a_script_follows_home_no_further_than_its_autopilot_corrects_and_its_way_spares(
    autopilot: str, spare_m: float | None, to: tuple[float, float, float], ends: bool
) -> None:
    watched = HomeWatched(spare_m)
    assert watched.interruption(VehicleState(1, 1)) == ""
    assert watched.interruption(state(HOME, autopilot=autopilot)) == ""
    said = watched.interruption(state(moved(*to), autopilot=autopilot))
    assert bool(said) == ends
    assert not ends or "certified for the home before" in said


def command_int(bench: Bench, first: float, place: HomePlace, frame: int = 0) -> int:
    message = wire.MAVLink_command_int_message(
        1, 1, frame, SET_HOME, 0, 0, first, math.nan, math.nan, math.nan, round(place.lat_deg * 1e7),
        round(place.lon_deg * 1e7), place.alt_amsl_m,
    )  # fmt: skip
    bench.send(message)
    bench.advance(0.1)
    return bench.last("COMMAND_ACK").result


@pytest.mark.parametrize("make", ["ardupilot", "px4"])
def test_a_simulated_vehicle_keeps_the_home_that_was_set_when_it_arms(make: Any) -> None:
    bench = ready() if make == "px4" else Bench()
    pilot = bench.vehicle.autopilot
    bench.until(lambda: pilot.position_ok)
    lat_deg, lon_deg, alt_m = pilot.frame.geodetic_from_neu((12.0, 5.0, 1.5))
    assert command_int(bench, 0.0, HomePlace(lat_deg, lon_deg, alt_m)) == ACCEPTED
    assert pilot.home_neu == pytest.approx((12.0, 5.0, 1.5), abs=0.02)
    pilot.set_mode("HOLD" if make == "px4" else "GUIDED")
    assert pilot.arm() == "accepted"
    in_flight = command_int(bench, 0.0, HomePlace(lat_deg, lon_deg, alt_m))
    assert in_flight == (DENIED if make == "px4" else ACCEPTED)
    assert pilot.home_neu == pytest.approx((12.0, 5.0, 1.5), abs=0.02)
    if make == "px4":
        assert command_int(ready(COM_HOME_EN=0.0), 1.0, HomePlace(0.0, 0.0, 0.0)) == DENIED
    else:
        assert command_int(bench, 0.0, HomePlace(lat_deg, lon_deg, alt_m), frame=10) == DENIED
        assert command_int(bench, 1.0, HomePlace(0.0, 0.0, 0.0)) == ACCEPTED
        assert pilot.home_neu == pytest.approx(pilot.p_neu, abs=0.05)


def stands(up_m: float, accuracy_m: float, *, beside_m: float = 0.0) -> VehicleState:
    at_deg = moved_deg((HOME.lat_deg, HOME.lon_deg), beside_m, 0.0)
    placed: dict[str, Any] = {"lat_deg": at_deg[0], "lon_deg": at_deg[1], "alt_rel_home_m": up_m}
    return state(HOME, landed="on_ground", horizontal_accuracy_m=accuracy_m, **placed)


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (stands(0.2, 0.5), None),
        (stands(-0.4, 0.5), "0.4 m below home"),
        (stands(1.9, 0.5), "1.9 m above home"),
        (stands(0.0, 1.0, beside_m=4.5), None),
        (stands(0.0, 0.1, beside_m=4.5), "Home lies 4 m"),
        (stands(0.0, 40.0, beside_m=8.0), "Home lies 8 m"),
    ],
)
def test_home_must_lie_where_the_vehicle_stands_before_it_starts(told: VehicleState, words: str | None) -> None:
    refusal = home_elsewhere(told)
    assert refusal is None if words is None else refusal is not None and words in str(refusal)
