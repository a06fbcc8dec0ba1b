"""Arming, modes and failsafes of the simulated autopilot, as a ground station sees them."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from tests.telemetry.autopilot_bench import (
    ACCEPTED,
    ARM,
    BRAKE,
    DENIED,
    FAILED,
    GUIDED,
    LAND,
    LAT,
    LOITER,
    LON,
    POSHOLD,
    RTL,
    SET_MODE,
    SPEED,
    TAKEOFF,
    YAW,
    go_to,
    hovering,
    landed,
    ready,
)
from tests.telemetry.simulator_bench import HOME, Bench


def test_arming_waits_for_a_position_and_says_so() -> None:
    bench = Bench(boot_s=4.0)
    bench.advance(3.0)
    assert bench.command(SET_MODE, 1, GUIDED) == ACCEPTED
    assert bench.command(ARM, 1) == FAILED
    assert "Arm: Need Position Estimate" in bench.texts()
    bench.advance(1.5)
    assert bench.command(ARM, 1) == ACCEPTED


def test_modes_that_fly_by_themselves_cannot_be_armed_in() -> None:
    bench = ready()
    assert bench.command(SET_MODE, 1, LAND) == ACCEPTED
    assert bench.command(ARM, 1) == FAILED
    assert "Arm: LAND mode not armable" in bench.texts()


@pytest.mark.parametrize(("mode", "words"), [(POSHOLD, "POSHOLD failed: no RC receiver"), (42, "No such mode 42")])
def test_modes_that_are_not_simulated_are_refused_in_words(mode: int, words: str) -> None:
    bench = ready()
    assert bench.command(SET_MODE, 1, mode) == FAILED
    assert any(words in text for text in bench.texts())
    assert bench.vehicle.autopilot.mode.name == "STABILIZE"


def test_it_disarms_by_itself_on_the_ground() -> None:
    bench = ready(DISARM_DELAY=10)
    bench.command(SET_MODE, 1, GUIDED)
    bench.command(ARM, 1)
    bench.advance(9.5)
    assert not landed(bench)
    bench.advance(1.0)
    assert landed(bench)
    assert bench.texts()[-1] == "Disarming motors"


def test_take_off_climbs_straight_up_and_stays() -> None:
    bench = hovering(8.0, WPNAV_SPEED_UP=200)
    bench.advance(5)
    north, east, up = bench.vehicle.truth.p_neu
    assert (north, east) == pytest.approx((0, 0), abs=0.05)
    assert up == pytest.approx(8.0, abs=0.1)


def test_take_off_is_for_guided_and_armed_vehicles() -> None:
    bench = ready()
    assert bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED
    bench.command(SET_MODE, 1, GUIDED)
    assert bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED
    bench.command(ARM, 1)
    assert bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, math.nan) == FAILED


def test_it_refuses_to_disarm_in_the_air_unless_forced_and_then_falls() -> None:
    bench = hovering(20.0)
    assert bench.command(ARM, 0) == FAILED
    assert bench.command(ARM, 0, 21196) == ACCEPTED
    bench.advance(5)
    assert bench.vehicle.truth.p_neu[2] == 0
    assert any(text.startswith("SIM Hit ground at") for text in bench.texts())


def test_guided_goes_where_it_is_sent_facing_there() -> None:
    bench = hovering()
    go_to(bench, LAT, LON + 3000, 12.0)
    bench.advance(20)
    goal = HOME.neu_from_geodetic(LAT / 1e7, (LON + 3000) / 1e7, 0)
    assert math.dist(bench.vehicle.truth.p_neu[:2], goal[:2]) < 0.1
    assert bench.vehicle.truth.p_neu[2] == pytest.approx(12.0, abs=0.1)
    assert math.degrees(bench.vehicle.truth.heading_rad) == pytest.approx(90, abs=2)


def test_reposition_takes_it_to_guided_only_when_told_to() -> None:
    bench = hovering()
    bench.command(SET_MODE, 1, LOITER)
    for change, result in ((0, DENIED), (1, ACCEPTED)):
        order = wire.MAVLink_command_int_message(1, 1, 3, 192, 0, 0, -1, change, 0, math.nan, LAT + 2000, LON, 15.0)
        assert bench.send(order)[0].result == result
    bench.advance(20)
    assert bench.vehicle.autopilot.mode.name == "GUIDED"
    assert bench.vehicle.truth.p_neu[0] == pytest.approx(22.2, abs=0.3)


@pytest.mark.parametrize("frame", [1, 10, 21])
def test_reposition_in_a_frame_that_is_not_flown_is_denied(frame: int) -> None:
    bench = hovering()
    order = wire.MAVLink_command_int_message(1, 1, frame, 192, 0, 0, -1, 1, 0, math.nan, LAT, LON, 15.0)
    assert bench.send(order)[0].result == DENIED


@pytest.mark.parametrize("mode", [LOITER, BRAKE])
def test_holding_stops_where_it_comes_to_rest(mode: int) -> None:
    bench = hovering(WPNAV_SPEED=500)
    go_to(bench, LAT + 20000, LON, 10.0)
    bench.advance(8)
    assert bench.vehicle.truth.v_neu[0] == pytest.approx(5, abs=0.3)
    before = bench.vehicle.truth.p_neu
    assert bench.command(SET_MODE, 1, mode) == ACCEPTED
    bench.advance(8)
    assert math.hypot(*bench.vehicle.truth.v_neu) < 0.05
    assert 4 < bench.vehicle.truth.p_neu[0] - before[0] < 12


def test_a_commanded_heading_and_speed_are_kept() -> None:
    bench = hovering()
    assert bench.command(YAW, 225, 0, 0, 0) == ACCEPTED
    go_to(bench, LAT + 10000, LON, 10.0)
    assert bench.command(SPEED, 1, 2.0) == ACCEPTED
    assert bench.command(SPEED, 1, -1) == FAILED
    go_to(bench, LAT + 12000, LON, 10.0)
    bench.advance(12)
    assert math.degrees(bench.vehicle.truth.heading_rad) == pytest.approx(225, abs=2)
    assert bench.vehicle.truth.v_neu[0] == pytest.approx(2.0, abs=0.05)


def test_a_speed_that_is_commanded_before_the_first_place_is_forgotten_with_it() -> None:
    bench = hovering()
    assert bench.command(SPEED, 1, 2.0) == ACCEPTED
    go_to(bench, LAT + 10000, LON, 10.0)
    bench.advance(8)
    assert bench.vehicle.truth.v_neu[0] > 5.0


def velocity(bench: Bench, frame: int, north: float, east: float, down: float, *, mask: int = 0b110111000111) -> None:
    bench.send(
        wire.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, frame, mask, 0, 0, 0, north, east, down, 0, 0, 0, math.pi / 2, 0
        )
    )


@pytest.mark.fact("A45")
@pytest.mark.parametrize(
    ("frame", "mask", "flown"),
    [
        (wire.MAV_FRAME_LOCAL_NED, 0b110111000111, (1.0, -0.5, 0.3)),
        (wire.MAV_FRAME_LOCAL_OFFSET_NED, 0b100111000111, (1.0, -0.5, 0.3)),
        (wire.MAV_FRAME_BODY_OFFSET_NED, 0b110111000111, (0.5, 1.0, 0.3)),
        (wire.MAV_FRAME_LOCAL_NED, 0b110111111111, (0.0, 0.0, 0.0)),
    ],
)
def test_guided_flies_velocities_until_they_are_not_told_any_more(
    frame: int, mask: int, flown: tuple[float, float, float]
) -> None:
    bench = hovering()
    bench.command(YAW, 90, 0, 0, 0)
    bench.advance(5)
    for _ in range(8):
        velocity(bench, frame, 1.0, -0.5, -0.3, mask=mask)
        bench.advance(0.5)
    assert bench.vehicle.truth.v_neu == pytest.approx(flown, abs=0.08)
    bench.advance(7)  # GUID_TIMEOUT is 3 s
    assert math.hypot(*bench.vehicle.truth.v_neu) < 0.1
    go_to(bench, LAT, LON, 15.0)
    bench.advance(15)
    assert bench.vehicle.truth.p_neu[2] == pytest.approx(15.0, abs=0.1)


def test_a_place_with_a_velocity_is_followed_until_it_is_not_told_any_more() -> None:
    bench = hovering()
    heard_s = []
    for step in range(50):
        north_e7 = round(0.2 * step * 2.0 / 111_195 * 1e7)
        place = LAT + north_e7, LON, 10.0
        bench.send(
            wire.MAVLink_set_position_target_global_int_message(
                0, 1, 1, 6, 0b110111000000, *place, 2.0, 0.0, 0.0, *[0] * 5
            )
        )
        heard_s.append(bench.now_s)
        bench.advance(0.2)
    north, speed = bench.vehicle.truth.p_neu[0], bench.vehicle.truth.v_neu[0]
    assert speed == pytest.approx(2.0, abs=0.05)
    assert north == pytest.approx(2.0 * (bench.now_s - heard_s[0]), abs=0.3)
    bench.advance(12.0)
    # GUID_TIMEOUT is 3 s from the last one.
    assert bench.vehicle.truth.p_neu[0] == pytest.approx(2.0 * (heard_s[-1] - heard_s[0] + 3.0), abs=0.3)
    assert bench.vehicle.truth.v_neu[0] == pytest.approx(0.0, abs=0.05)


def test_landing_disarms() -> None:
    bench = hovering(6.0)
    assert bench.command(SET_MODE, 1, LAND) == ACCEPTED
    bench.until(lambda: landed(bench), 60)
    assert bench.vehicle.truth.p_neu[2] == 0
    assert not bench.vehicle.autopilot.crashed


def test_return_climbs_flies_home_and_lands() -> None:
    bench = hovering(5.0, RTL_ALT=2000, RTL_CONE_SLOPE=0)
    go_to(bench, LAT + 5000, LON, 5.0)
    bench.advance(25)
    assert bench.command(SET_MODE, 1, RTL) == ACCEPTED
    highest, away = 0.0, []
    while not landed(bench):
        bench.advance(0.5)
        north, _, up = bench.vehicle.truth.p_neu
        highest = max(highest, up)
        away.append((north, up))
    assert highest == pytest.approx(20.0, abs=0.2)
    assert math.hypot(*bench.vehicle.truth.p_neu[:2]) < 0.2
    assert all(up > 17 for north, up in away if 5 < north < 45)


@pytest.mark.parametrize(("slope", "height_m"), [(3.0, 15.0), (0.0, 30.0), (0.2, 30.0)])
def test_the_cone_spares_the_climb_near_home(slope: float, height_m: float) -> None:
    bench = hovering(5.0, RTL_ALT=3000, RTL_CONE_SLOPE=slope)
    go_to(bench, LAT + 450, LON, 5.0)
    bench.advance(15)
    bench.command(SET_MODE, 1, RTL)
    highest = 0.0
    while not landed(bench):
        bench.advance(0.5)
        highest = max(highest, bench.vehicle.truth.p_neu[2])
    assert highest == pytest.approx(height_m, abs=0.3)


def test_return_from_above_keeps_the_height() -> None:
    bench = hovering(25.0, RTL_ALT=1500)
    go_to(bench, LAT + 3000, LON, 25.0)
    bench.advance(15)
    bench.command(SET_MODE, 1, RTL)
    bench.advance(5)
    assert bench.vehicle.truth.p_neu[2] == pytest.approx(25.0, abs=0.2)


def test_a_silent_ground_station_brings_it_home() -> None:
    bench = hovering(10.0, FS_GCS_ENABLE=1)
    bench.heartbeat = False
    bench.until(lambda: "GCS Failsafe" in bench.texts(), 20)
    assert bench.last("HEARTBEAT").custom_mode == RTL
    assert bench.last("HEARTBEAT").system_status == 5
    bench.heartbeat = True
    bench.until(lambda: "GCS Failsafe Cleared" in bench.texts(), 20)
    assert bench.vehicle.autopilot.mode.name == "RTL"


def test_a_low_battery_brings_it_home_and_an_empty_one_down() -> None:
    bench = hovering(10.0, BATT_CAPACITY=600, BATT_LOW_MAH=300, BATT_FS_LOW_ACT=2)
    bench.until(lambda: any(text.startswith("Battery 1 is low") for text in bench.texts()), 100)
    assert bench.vehicle.autopilot.mode.name == "RTL"
    drained = hovering(30.0, BATT_CAPACITY=300)
    drained.until(lambda: "Battery empty" in drained.texts(), 100)
    drained.advance(5)
    assert drained.vehicle.autopilot.crashed
    assert drained.command(ARM, 1) == FAILED


class _Hill:
    """A wall, 20 m north."""

    def up_m(self, north_m: float, east_m: float) -> float:
        return 50.0 if north_m > 20 else 0.0


def test_flying_into_something_is_the_end() -> None:
    bench = Bench(SimulatedVehicle(HOME, gnss="perfect", boot_s=0.5, ground=_Hill()))
    bench.advance(1)
    bench.command(SET_MODE, 1, GUIDED)
    bench.command(ARM, 1)
    bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10)
    bench.until(lambda: bench.vehicle.autopilot.stage == "flight")
    go_to(bench, LAT + 5000, LON, 10.0)
    bench.until(lambda: landed(bench), 30)
    assert "Crash: Disarming: hit the ground" in bench.texts()
    assert bench.vehicle.truth.p_neu[0] == pytest.approx(20, abs=0.3)


class _Kerb:
    """A step of 0.1 m that the vehicle drifts onto while it lifts off."""

    def __init__(self) -> None:
        self._looks = 0

    def up_m(self, north_m: float, east_m: float) -> float:
        self._looks += 1
        return 0.1 if self._looks > 5 else 0.0


def test_a_step_beside_the_take_off_is_no_crash() -> None:
    bench = Bench(SimulatedVehicle(HOME, gnss="perfect", boot_s=0.5, ground=_Kerb()))
    bench.advance(1)
    bench.command(SET_MODE, 1, GUIDED)
    bench.command(ARM, 1)
    bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10)
    bench.until(lambda: bench.vehicle.autopilot.stage == "flight", 60)
    assert any(text.startswith("SIM Hit ground") for text in bench.texts())
    assert "Crash: Disarming: hit the ground" not in bench.texts()
    assert bench.vehicle.truth.p_neu[2] == pytest.approx(10, abs=1.0)


def test_it_flies_by_its_estimate_not_by_the_truth() -> None:
    vehicle = SimulatedVehicle(HOME, gnss="standalone", boot_s=0.5, seed=3)
    bench = Bench(vehicle)
    bench.advance(1)
    bench.command(SET_MODE, 1, GUIDED)
    bench.command(ARM, 1)
    bench.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10)
    bench.until(lambda: vehicle.autopilot.stage == "flight")
    go_to(bench, LAT + 2000, LON, 10.0)
    bench.advance(25)
    goal = HOME.neu_from_geodetic((LAT + 2000) / 1e7, LON / 1e7, 0)
    assert math.dist(vehicle.estimated_neu[:2], goal[:2]) < 0.5
    off = np.subtract(vehicle.estimated_neu, vehicle.truth.p_neu)
    assert off == pytest.approx(vehicle.gnss.error_neu, abs=0.05)
    assert np.hypot(*off[:2]) > 0.5


def test_wind_is_held_against() -> None:
    bench = hovering(10.0, SIM_WIND_SPD=6.0, SIM_WIND_DIR=270)
    bench.advance(30)
    assert math.dist(bench.vehicle.truth.p_neu, (0, 0, 10)) < 0.6
    roll, pitch, heading = bench.vehicle.truth.attitude_rad
    leaning_west = roll * math.cos(heading) - pitch * math.sin(heading)
    assert leaning_west < -0.08
