"""The mission protocol of the simulated vehicle beyond what was recorded (see test_simulator_agreement)."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.protocol.kept_items import KINDS, WITHOUT_MOTION, KeptItem, keep
from tests.telemetry.simulator_bench import Bench

LAT, LON = -371244507, 1756892878
ACCEPTED, ERROR, UNSUPPORTED, INVALID_SEQUENCE, DENIED, CANCELLED = 0, 1, 3, 13, 14, 15


def rows(count: int, up_m: float = 10.0) -> list[tuple[int, int, float, int, int, float]]:
    return [
        (0, 16, 0.0, LAT, LON, 0.0),
        (3, 22, 0.0, LAT, LON, up_m),
        *[(3, 16, 0.0, LAT + 9, LON, up_m)] * (count - 2),
    ]


def ready() -> Bench:
    bench = Bench()
    bench.advance(0.6)
    return bench


def read_back(bench: Bench) -> list[Any]:
    count = bench.send(wire.MAVLink_mission_request_list_message(1, 1))[0].count
    return [bench.send(wire.MAVLink_mission_request_int_message(1, 1, seq))[0] for seq in range(count)]


def item(seq: int, **changes: Any) -> wire.MAVLink_mission_item_int_message:
    fields: dict[str, Any] = {
        "frame": 3, "command": 16, "current": 0, "autocontinue": 1, "param1": 0.0, "param2": 0.0, "param3": 0.0,
        "param4": 0.0, "x": LAT, "y": LON, "z": 10.0,
    }  # fmt: skip
    return wire.MAVLink_mission_item_int_message(1, 1, seq, **{**fields, **changes})


def test_a_broken_off_upload_leaves_a_mixed_mission() -> None:
    bench = ready()
    assert bench.upload(rows(6, up_m=10.0)) == ACCEPTED
    bench.send(wire.MAVLink_mission_count_message(1, 1, 5))
    for seq in range(3):
        bench.send(item(seq, z=33.0))
    bench.advance(9)
    assert bench.last("MISSION_ACK").type == CANCELLED
    assert [found.z for found in read_back(bench)[1:]] == [33.0, 33.0, 10.0, 10.0]


def test_a_second_ground_station_must_wait_for_the_first() -> None:
    bench = ready()
    bench.send(wire.MAVLink_mission_count_message(1, 1, 3))
    answer = bench.send(wire.MAVLink_mission_count_message(1, 1, 3), system=254)[0]
    assert (answer.type, answer.target_system) == (DENIED, 254)
    assert bench.send(item(0), system=254)[0].type == ERROR
    assert bench.send(item(0))[0].get_type() == "MISSION_REQUEST"


def test_the_same_ground_station_may_begin_again() -> None:
    bench = ready()
    bench.send(wire.MAVLink_mission_count_message(1, 1, 3))
    bench.send(item(0))
    assert bench.upload(rows(4)) == ACCEPTED
    assert len(read_back(bench)) == 4


def test_exactly_as_many_items_as_fit() -> None:
    bench = ready()
    assert bench.upload(rows(650)) == ACCEPTED
    assert bench.send(wire.MAVLink_mission_count_message(1, 1, 651))[0].type == 4
    assert len(read_back(bench)) == 650


@pytest.mark.parametrize("clearing", ["count", "clear"])
def test_a_mission_can_be_cleared(clearing: str) -> None:
    bench = ready()
    bench.upload(rows(5))
    message = wire.MAVLink_mission_count_message(1, 1, 0)
    if clearing == "clear":
        message = wire.MAVLink_mission_clear_all_message(1, 1)
    assert bench.send(message)[0].type == ACCEPTED
    assert read_back(bench) == []
    bench.stream(42, 10)
    bench.advance(0.3)
    assert bench.last("MISSION_CURRENT").total == 0


def test_a_mission_that_is_being_flown_cannot_be_cleared() -> None:
    bench = ready()
    bench.upload(rows(5))
    bench.fly_mission()
    bench.advance(8)
    assert bench.send(wire.MAVLink_mission_clear_all_message(1, 1))[0].type == ERROR
    assert len(read_back(bench)) == 5


def test_items_in_degrees_are_taken_and_given_too() -> None:
    bench = ready()
    answers = bench.send(wire.MAVLink_mission_count_message(1, 1, 2))
    for seq in range(2):
        old = wire.MAVLink_mission_item_message(1, 1, seq, 3, 22, 0, 1, 0, 0, 0, 0, LAT / 1e7, LON / 1e7, 12.0)
        answers = bench.send(old)
    assert answers[0].type == ACCEPTED
    back = bench.send(wire.MAVLink_mission_request_message(1, 1, 1))[0]
    assert back.get_type() == "MISSION_ITEM"
    assert (back.x, back.y, back.z) == pytest.approx((LAT / 1e7, LON / 1e7, 12.0), abs=1e-5)


def test_a_part_of_the_mission_can_be_replaced() -> None:
    bench = ready()
    bench.upload(rows(6))
    assert bench.send(wire.MAVLink_mission_write_partial_list_message(1, 1, 3, 4))[0].seq == 3
    assert bench.send(item(3, z=21.0))[0].seq == 4
    assert bench.send(item(4, z=22.0))[0].type == ACCEPTED
    assert [found.z for found in read_back(bench)[1:]] == [10.0, 10.0, 21.0, 22.0, 10.0]
    assert bench.send(wire.MAVLink_mission_write_partial_list_message(1, 1, 3, 9))[0].type == ERROR


@pytest.mark.parametrize("mission_type", [1, 2])
def test_fence_and_rally_lists_are_empty_at_first_and_of_no_other_type(mission_type: int) -> None:
    bench = ready()
    assert bench.send(wire.MAVLink_mission_request_list_message(1, 1, mission_type))[0].count == 0
    assert bench.send(wire.MAVLink_mission_clear_all_message(1, 1, mission_type))[0].type == ACCEPTED
    assert bench.send(wire.MAVLink_mission_count_message(1, 1, 3, 7))[0].type == UNSUPPORTED


def test_a_lost_item_is_asked_for_again() -> None:
    bench = ready()
    bench.send(wire.MAVLink_mission_count_message(1, 1, 2))
    before = len(bench.of("MISSION_REQUEST"))
    bench.advance(2.5)
    assert [heard.message.seq for heard in bench.of("MISSION_REQUEST")][before:] == [0, 0]
    bench.send(item(0))
    assert bench.send(item(1))[0].type == ACCEPTED


@settings(deadline=None)
@given(st.floats(width=32, min_value=-80_000, max_value=80_000), st.floats(width=32, min_value=0, max_value=1e9))
def test_heights_lose_less_than_a_centimetre_and_holds_their_fractions(alt_m: float, hold_s: float) -> None:
    kept = keep(item(2, z=alt_m, param1=hold_s, param2=3.0, param4=math.nan))
    assert isinstance(kept, KeptItem)
    back = kept.message(2, (255, 190))
    assert abs(back.z) <= abs(np.float32(alt_m)) * (1 + 1e-6)
    assert abs(back.z - alt_m) < 0.0101 + 1e-6 * abs(alt_m)
    assert back.param1 == math.floor(min(hold_s, 65535))
    assert (back.param2, back.param4) == (0.0, 0.0)


@settings(deadline=None)
@given(
    st.sampled_from([*KINDS, *sorted(WITHOUT_MOTION), 9999]),
    st.integers(0, 255),
    st.tuples(*[st.floats(width=32)] * 4),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(-(2**31), 2**31 - 1),
    st.floats(width=32),
)
def test_whatever_is_sent_is_kept_or_refused(
    command: int, frame: int, params: tuple[float, ...], x: int, y: int, z: float
) -> None:
    named = {f"param{n}": value for n, value in enumerate(params, start=1)}
    kept = keep(item(1, command=command, frame=frame, x=x, y=y, z=z, **named))
    if isinstance(kept, KeptItem):
        assert all(math.isfinite(value) for value in kept.params)
        back = kept.message(1, (255, 190))
        assert keep(back) == kept
        assert math.isfinite(kept.step().alt_m)
    else:
        assert kept in (2, 3, 6, 7, 8, 9, 10, 11, 12)
