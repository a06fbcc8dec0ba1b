"""The simulated vehicles at their fences: what they say, what they do, and what Hedgehop hears and sets of it."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.basics.plan_model import Firmware
from planning.fence.fence_model import Fence, circle
from planning.formats.fence_items import fence_items
from telemetry.errors import NotAllowedError
from telemetry.flight.fence_actions import at_fence
from telemetry.flight.fence_heights import NAMES, height_changes, heights_aboard
from telemetry.flight.fence_heights_put import put_heights
from telemetry.mavlink.items import wire_items
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.copter_fence import CopterFence, FenceNews
from telemetry.simulation.simulator.autopilot.fence_shapes import FencePart, allowed
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES
from telemetry.simulation.simulator.autopilot.px4.px4_fence import Px4Fence, Px4FenceNews
from telemetry.topics.parameters import ParameterChange
from telemetry.topics.requests import Land, ReadParameters, ReturnHome, StartAuto, UploadPlaces, WriteParameters
from tests.telemetry.link_bench import ME, Console, until
from tests.telemetry.own_time import run
from tests.telemetry.simulator_bench import HOME, Bench
from tests.telemetry.test_mavlink_flights import LAT_DEG, LON_DEG, items, phase, simulated, start, upload
from tests.telemetry.test_px4_flights import px4

ORIGIN = (0.0, 0.0, 0.0)
SQUARE = FencePart(inclusion=True, corners_ne_m=((-10, -10), (-10, 10), (10, 10), (10, -10)))
POND = FencePart(inclusion=False, corners_ne_m=((5, 0),), radius_m=2.0)


class Copter:
    """A fence and a place, looked at once in a second."""

    def __init__(self, **parameters: float) -> None:
        self.parameters = Parameters(FENCE_ENABLE=1, **parameters)
        self.fence, self._now_s = CopterFence(self.parameters), 0.0

    def at(self, north_m: float, up_m: float, *, landing: bool = False, flying: bool = True) -> FenceNews:
        self._now_s += 1.0
        return self.fence.check((north_m, 0.0, up_m), ORIGIN, self._now_s, flying=flying, landing=landing)


def test_shapes_allow_what_is_inside_every_inclusion_and_outside_every_exclusion() -> None:
    for place, is_allowed in (((0, 0), True), ((5, 0), False), ((7.5, 0), True), ((11, 0), False), ((0, -10.1), False)):
        assert allowed((SQUARE, POND), place) is is_allowed


@pytest.mark.parametrize(
    ("action", "modes"),
    [
        (1, ("RTL", "LAND")), (2, ("LAND",)), (3, ("SMART_RTL", "RTL", "LAND")), (4, ("BRAKE", "LAND")),
        (5, ("SMART_RTL", "LAND")), (0, ()),
    ],
)  # fmt: skip
def test_a_copter_acts_once_at_its_ceiling_as_its_action_says_and_tells_when_it_is_within_again(action, modes) -> None:
    copter = Copter(FENCE_TYPE=1, FENCE_ALT_MAX=20, FENCE_ACTION=action)
    assert copter.at(0, 19.9) == FenceNews()  # its margin of 2 m makes no breach
    assert copter.at(0, 20.0) == FenceNews(("Max Alt fence breached",), modes)
    assert (copter.fence.breached, copter.fence.count) == (1, 1)
    assert copter.at(0, 30.0) == FenceNews()
    assert copter.at(0, 40.1).modes == modes  # 20 m further beyond it acts anew
    assert copter.at(0, 19.9) == FenceNews(("Fence breach cleared",))
    assert copter.at(0, 130.0).modes == (("LAND",) if action else ())  # more than 100 m beyond: it lands


def test_a_copter_names_all_that_it_crosses_and_only_what_its_type_says() -> None:
    copter = Copter(FENCE_TYPE=7, FENCE_ALT_MAX=20, FENCE_RADIUS=30)
    copter.fence.parts = (SQUARE, POND)
    assert copter.at(5, 10).texts == ("Polygon fence breached",)
    assert copter.at(40, 25).texts == ("Max Alt and Circle fences breached",)
    copter.parameters.set("FENCE_TYPE", 0)
    assert copter.at(40, 25).texts == ("Fence breach cleared",)
    copter.parameters.set("FENCE_TYPE", 7)
    copter.parameters.set("FENCE_ENABLE", 0)
    assert copter.at(40, 25) == FenceNews()


def test_a_copter_takes_new_kinds_only_when_its_fence_is_switched_on() -> None:
    copter = Copter(FENCE_TYPE=4, FENCE_ALT_MAX=20)
    copter.parameters.set("FENCE_TYPE", 5)
    assert copter.at(0, 25) == FenceNews()
    copter.parameters.set("FENCE_ENABLE", 0)
    assert copter.at(0, 25) == FenceNews()
    copter.parameters.set("FENCE_ENABLE", 1)
    assert copter.at(0, 25).texts == ("Max Alt fence breached",)


def test_the_floor_comes_on_above_it_by_the_margin_and_is_off_while_it_lands() -> None:
    copter = Copter(FENCE_TYPE=8, FENCE_ALT_MIN=5, FENCE_MARGIN=2)
    assert copter.at(0, 0.0, flying=False, landing=True) == FenceNews()
    assert copter.at(0, 6.9) == FenceNews()
    assert copter.at(0, 7.0).texts == ("Min Alt fence enabled (auto enable)",)
    assert copter.at(0, 4.9) == FenceNews(("Min Alt fence breached",), ("RTL", "LAND"))
    assert copter.at(0, 4.0, landing=True).texts == ("Min Alt fence auto-disabled", "Fence breach cleared")


def test_a_copter_does_not_arm_beyond_its_fence_or_with_a_band_that_is_too_narrow() -> None:
    copter = Copter(FENCE_TYPE=4)
    copter.fence.parts = (SQUARE,)
    copter.at(20, 0, flying=False, landing=True)
    assert copter.fence.why_not_arm() == "Vehicle breaching Polygon fence"
    for low_m, high_m, said in ((5, 9, "FENCE_MARGIN too big"), (9, 5, "FENCE_ALT_MAX < FENCE_ALT_MIN"), (5, 10, None)):
        assert Copter(FENCE_ALT_MIN=low_m, FENCE_ALT_MAX=high_m).fence.why_not_arm() == said


class Px4:
    def __init__(self, **parameters: float) -> None:
        self.fence = Px4Fence(PERSONALITIES["px4"].parameters(**parameters))
        self.mode, self._now_s = "MISSION", 0.0

    def at(self, north_m: float, up_m: float, *, after_s: float = 1.0, armed: bool = True) -> Px4FenceNews:
        self._now_s += after_s
        news = self.fence.check((north_m, 0.0, up_m), ORIGIN, self._now_s, armed=armed, mode=self.mode)
        self.mode = news.mode or self.mode
        return news


HIGH = "Geofence: exceeding maximum altitude above Home"


def test_a_px4_holds_at_once_and_stays_so_until_somebody_takes_over() -> None:
    vehicle = Px4(GF_MAX_VER_DIST=20)
    assert vehicle.at(0, 19.9) == Px4FenceNews()
    assert vehicle.at(0, 20.0) == Px4FenceNews((HIGH, "Failsafe activated"), "HOLD")
    assert vehicle.at(0, 19.0) == Px4FenceNews()
    assert vehicle.fence.acts
    vehicle.mode = "MISSION"
    assert vehicle.at(0, 19.0) == Px4FenceNews()
    assert not vehicle.fence.acts


def test_a_px4_holds_for_five_seconds_before_it_returns_or_lands() -> None:
    returns = Px4(GF_MAX_VER_DIST=20, GF_ACTION=3)
    assert returns.at(0, 21) == Px4FenceNews((HIGH, "Failsafe activated: entering Hold for 5 seconds"), "HOLD")
    assert returns.at(0, 21, after_s=4.9) == Px4FenceNews()
    assert returns.at(0, 21, after_s=0.2) == Px4FenceNews(("Failsafe activated",), "RTL")
    lands = Px4(GF_MAX_VER_DIST=20, GF_ACTION=5, COM_FAIL_ACT_T=0)
    assert lands.at(0, 21).mode == "LAND"
    assert lands.at(0, 19).mode == "MISSION"  # within again, what it did before goes on


def test_a_px4_only_warns_falls_or_does_nothing_as_its_action_says() -> None:
    assert Px4(GF_MAX_HOR_DIST=30, GF_ACTION=0).at(40, 5) == Px4FenceNews()
    distance = "Geofence: exceeding maximum distance to Home"
    assert Px4(GF_MAX_HOR_DIST=30, GF_ACTION=1).at(40, 5) == Px4FenceNews((distance, "Failsafe activated"))
    assert Px4(GF_MAX_HOR_DIST=30, GF_ACTION=4).at(40, 5).terminates
    assert Px4(GF_MAX_HOR_DIST=30).at(40, 5, armed=False) == Px4FenceNews()


def test_a_px4_leaves_out_a_part_that_forbids_home() -> None:
    vehicle = Px4()
    around_home = FencePart(inclusion=False, corners_ne_m=((0, 0),), radius_m=3.0)
    assert vehicle.fence.take((SQUARE, around_home), ORIGIN) == 1
    assert vehicle.at(1, 5) == Px4FenceNews()
    assert vehicle.at(12, 5).texts[0] == "Geofence: approaching or outside geofence"


def test_the_status_of_a_copters_fence_is_told_and_its_return_stays_below_the_ceiling() -> None:
    bench = Bench()
    bench.set_parameters(FENCE_TYPE=1, FENCE_ALT_MAX=30, RTL_ALT=5000)
    assert bench.command(512, wire.MAVLINK_MSG_ID_FENCE_STATUS) != 0  # of one that is off nothing is told
    bench.set_parameters(FENCE_ENABLE=1)
    assert bench.command(512, wire.MAVLINK_MSG_ID_FENCE_STATUS) == 0
    assert bench.last("FENCE_STATUS").breach_status == 0
    pilot = bench.vehicle.autopilot
    bench.until(lambda: pilot.position_ok)
    assert [bench.command(176, 1, 4), bench.command(400, 1), bench.command(22, 0, 0, 0, 0, 0, 0, 10)] == [0] * 3
    bench.until(lambda: pilot.p_neu[2] > 9.5)
    lat, lon, _ = HOME.geodetic_from_neu((40.0, 0.0, 0.0))
    for up_m, result in ((31.0, 4), (20.0, 0)):  # beyond its fence it is not sent
        there = wire.MAVLink_command_int_message(
            1, 1, 3, 192, 0, 0, -1, 1, 0, math.nan, round(lat * 1e7), round(lon * 1e7), up_m
        )
        assert next(a.result for a in bench.send(there) if a.get_type() == "COMMAND_ACK") == result
    bench.until(lambda: math.dist(pilot.p_neu, (40.0, 0.0, 20.0)) < 1)
    bench.command(176, 1, 6)
    bench.until(lambda: math.dist(pilot.p_neu[:2], (0, 0)) < 5)
    assert pilot.p_neu[2] == pytest.approx(28.0, abs=0.5)


class Asks:
    """The link without its bus."""

    def __init__(self, bench: Console) -> None:
        self._bench = bench

    async def call(self, request: Any) -> Any:
        return await self._bench.handle(request)


async def put(bench: Console, ceiling_m: float, firmware: Firmware) -> dict[str, float | None]:
    """The vehicle's ceiling, as Hedgehop sets it; what the vehicle holds then."""
    held = await bench.handle(ReadParameters(NAMES[firmware]))
    found = height_changes(Fence(ceiling_rel_home_m=ceiling_m), held, firmware)
    assert all(one.took for one in await put_heights(Asks(bench), ME, found))
    now = await bench.handle(ReadParameters(NAMES[firmware]))
    assert heights_aboard(now, firmware).ceiling_rel_home_m == ceiling_m
    return now


def test_a_copter_does_at_its_ceiling_and_its_shapes_what_the_page_says() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            report = await upload(bench, items(8))
            wide = Fence(circles=(circle(LAT_DEG, LON_DEG, 500.0, inclusion=True, where="t"),))
            assert (await bench.handle(UploadPlaces(ME, "fence", wire_items(fence_items(wide))))).verified
            shapes_alone = (ParameterChange("FENCE_TYPE", 4), ParameterChange("FENCE_ENABLE", 1))
            await bench.handle(WriteParameters(ME, shapes_alone))
            held = await put(bench, 16.0, "ardupilot")  # a kind that a fence that is on does not take by itself
            assert at_fence(held, "ardupilot").startswith("At its fence the vehicle returns")
            await start(bench, StartAuto(ME, report.onboard.digest))
            await until(lambda: bench.state.fence_breach == "ceiling")
            await until(lambda: bench.state.mode == "RTL")
            assert "Max Alt fence breached" in bench.texts
            with pytest.raises(NotAllowedError, match="armed"):
                await put(bench, 40.0, "ardupilot")
            await until(lambda: bench.state.fence_breach == "none")
            await until(lambda: not bench.state.armed)
            assert "Fence breach cleared" in bench.texts
            assert bench.state.fence_ok

    run(whole)


def test_a_px4_does_at_its_ceiling_what_the_page_says() -> None:
    async def whole() -> None:
        async with px4() as (bench, _):
            report = await upload(bench, items(8))
            held = await put(bench, 16.0, "px4")
            assert at_fence(held, "px4") == "At its fence the vehicle holds its place (GF_ACTION 2)."
            await start(bench, StartAuto(ME, report.onboard.digest))
            await until(lambda: bench.state.mode == "HOLD")
            await until(lambda: HIGH in bench.texts)
            assert "Failsafe activated" in bench.texts
            assert (bench.state.alt_rel_home_m or 0.0) == pytest.approx(16.0, abs=1.5)
            await bench.handle(ReturnHome(ME))
            await until(lambda: bench.state.mode == "RTL")
            await bench.handle(Land(ME))
            await phase(bench, "interrupted")

    run(whole)
