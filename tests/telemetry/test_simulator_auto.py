"""Missions of the simulated autopilot: AUTO, as a ground station sees it."""

import math

from pymavlink.dialects.v20 import ardupilotmega as wire

from tests.telemetry.autopilot_bench import (
    ACCEPTED,
    AUTO,
    DENIED,
    FAILED,
    LAT,
    LOITER,
    LON,
    PAUSE,
    SET_CURRENT,
    SET_MODE,
    hovering,
    landed,
    mission,
    ready,
)


def test_auto_needs_a_mission_that_begins_with_a_take_off() -> None:
    bench = ready()
    assert bench.command(SET_MODE, 1, AUTO) == FAILED
    bench.upload([(0, 16, 0.0, LAT, LON, 0.0), (3, 16, 0.0, LAT, LON, 10.0)])
    assert bench.command(SET_MODE, 1, AUTO) == FAILED
    assert "Auto: Missing Takeoff Cmd" in bench.texts()


def test_a_mission_holds_changes_speed_jumps_and_returns() -> None:
    bench = ready(WPNAV_SPEED=500)
    rows = mission(
        (16, 0.0, LAT + 900, LON, 10.0),
        (16, 3.0, LAT + 900, LON + 900, 12.0),
        (177, 2.0, 0, 0, 0.0),
        (195, 0.0, LAT, LON, 0.0),
        (20, 0.0, 0, 0, 0.0),
    )
    assert bench.upload(rows) == 0
    bench.fly_mission()
    bench.until(lambda: landed(bench), 300)
    # A jump whose repeat count was not given (0) is passed over.
    assert [heard.message.seq for heard in bench.of("MISSION_ITEM_REACHED")] == [1, 2, 3, 6]
    reached = {heard.message.seq: heard.t_s for heard in bench.of("MISSION_ITEM_REACHED")}
    assert reached[3] - reached[2] > 3
    assert bench.last("HEARTBEAT").custom_mode == AUTO


def test_a_repeated_jump_flies_its_part_again() -> None:
    bench = ready(WPNAV_SPEED=800)
    items = mission(
        (16, 0.0, LAT + 500, LON, 10.0), (16, 0.0, LAT, LON, 10.0), (177, 2.0, 0, 0, 0.0), (21, 0, LAT, LON, 0)
    )
    answers = bench.send(wire.MAVLink_mission_count_message(1, 1, len(items)))
    for seq, (frame, command, first, x, y, z) in enumerate(items):
        second = 1.0 if command == 177 else 0.0
        item = wire.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, first, second, 0, 0, x, y, z)
        answers = bench.send(item)
    assert answers[0].type == 0
    bench.fly_mission()
    bench.until(lambda: landed(bench), 300)
    assert [heard.message.seq for heard in bench.of("MISSION_ITEM_REACHED")] == [1, 2, 3, 2, 3, 5]


def test_a_paused_mission_stands_still_and_goes_on() -> None:
    bench = ready(WPNAV_SPEED=500)
    bench.upload(mission((16, 0.0, LAT + 9000, LON, 10.0), (20, 0.0, 0, 0, 0.0)))
    bench.fly_mission()
    bench.until(lambda: bench.vehicle.truth.v_neu[0] > 4, 60)
    assert bench.command(PAUSE, 0) == ACCEPTED
    bench.advance(12)
    assert math.hypot(*bench.vehicle.truth.v_neu) < 0.1
    bench.stream(42, 5)
    bench.advance(0.5)
    assert bench.last("MISSION_CURRENT").mission_state == 4
    assert bench.command(PAUSE, 1) == ACCEPTED
    bench.until(lambda: bench.vehicle.truth.v_neu[0] > 4, 60)


def test_interrupted_by_loiter_it_goes_on_with_the_same_item() -> None:
    bench = ready()
    bench.upload(mission((16, 0.0, LAT + 900, LON, 10.0), (16, 0.0, LAT + 3000, LON, 10.0), (20, 0.0, 0, 0, 0.0)))
    bench.fly_mission()
    bench.until(lambda: "Mission: 3 WP" in bench.texts(), 60)
    bench.advance(1)
    bench.command(SET_MODE, 1, LOITER)
    bench.advance(5)
    bench.command(SET_MODE, 1, AUTO)
    assert bench.texts()[-1] == "Mission: 3 WP"
    bench.until(lambda: "Reached command #3" in bench.texts(), 60)


def test_the_current_item_can_be_set_in_the_air_and_on_the_ground() -> None:
    bench = hovering()
    bench.upload(mission((16, 0.0, LAT + 900, LON, 10.0), (16, 0.0, LAT, LON + 900, 10.0), (20, 0.0, 0, 0, 0.0)))
    assert bench.command(SET_CURRENT, 9) == DENIED
    assert bench.command(SET_CURRENT, 3) == ACCEPTED
    bench.command(SET_MODE, 1, AUTO)
    assert bench.texts()[-1] == "Mission: 3 WP"
    assert bench.command(SET_CURRENT, 2) == ACCEPTED
    assert bench.texts()[-1] == "Mission: 2 WP"


def test_after_a_landing_the_mission_begins_anew() -> None:
    bench = ready()
    bench.upload(mission((16, 0.0, LAT + 500, LON, 10.0), (20, 0.0, 0, 0, 0.0)))
    for _ in range(2):
        bench.fly_mission()
        bench.until(lambda: landed(bench), 200)
    assert [heard.message.seq for heard in bench.of("MISSION_ITEM_REACHED")] == [1, 2, 3] * 2
