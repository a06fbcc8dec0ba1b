"""What is asked of the vehicle, and what is asked again."""

from collections import Counter
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.streams import FAST_HZ, FEW, StreamRequests
from tests.telemetry.frames import attitude, heard

NAMES = {kind.id: kind.msgname for kind in mavlink.mavlink_map.values()}
STEP_S = 0.05


class Vehicle:
    """Sends what it was asked for, from its own clock."""

    def __init__(self, *, grants: bool = True) -> None:
        self.grants = grants
        self.hz: dict[str, float] = {}
        self.asked: Counter[str] = Counter()
        self.old_streams: set[int] = set()

    def take(self, message: Any) -> None:
        if message.get_type() == "REQUEST_DATA_STREAM":
            self.old_streams.add(message.req_stream_id)
            return
        name = NAMES[int(message.param1)]
        self.asked[name] += 1
        if self.grants and message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.hz[name] = 1e6 / message.param2


def message_called(name: str) -> Any:
    class Heard:
        @staticmethod
        def get_type() -> str:
            return name

    return Heard()


def watch(requests: StreamRequests, vehicle: Vehicle, seconds: float, *, since_s: float = 0.0) -> None:
    due = dict.fromkeys(NAMES.values(), since_s)
    for step in range(int(seconds / STEP_S)):
        now_s = since_s + step * STEP_S
        for message in requests.on_tick(now_s):
            vehicle.take(message)
        for name, hz in vehicle.hz.items():
            while due[name] <= now_s:
                requests.on_message(message_called(name), now_s)
                due[name] += 1 / hz


def test_positions_and_attitudes_come_often_the_rest_seldom() -> None:
    vehicle = Vehicle()
    watch(StreamRequests((1, 1), "ardupilot", slow=False, now_s=0.0), vehicle, 30)
    assert vehicle.hz["GLOBAL_POSITION_INT"] == vehicle.hz["ATTITUDE"] == 20
    assert vehicle.hz["BATTERY_STATUS"] == 1
    assert "WIND_COV" not in vehicle.hz
    assert {name for name in vehicle.hz if vehicle.asked[name] != 1} == {"HOME_POSITION"}


def test_a_slow_radio_is_asked_for_less() -> None:
    vehicle = Vehicle()
    watch(StreamRequests((1, 1), "px4", slow=True, now_s=0.0), vehicle, 5)
    assert vehicle.hz["GLOBAL_POSITION_INT"] == 10
    assert sum(vehicle.hz.values()) < sum(FAST_HZ.values()) * 0.6
    assert "ESTIMATOR_STATUS" in vehicle.hz


def test_what_does_not_come_is_asked_for_again_and_not_for_ever() -> None:
    vehicle = Vehicle(grants=False)
    watch(StreamRequests((1, 1), "ardupilot", slow=False, now_s=0.0), vehicle, 300)
    assert vehicle.asked["GLOBAL_POSITION_INT"] > 20
    assert vehicle.asked["WIND"] == 5
    assert vehicle.asked["AUTOPILOT_VERSION"] == 5


def test_a_restarted_vehicle_is_asked_again() -> None:
    vehicle = Vehicle()
    requests = StreamRequests((1, 1), "ardupilot", slow=False, now_s=0.0)
    watch(requests, vehicle, 10)
    vehicle.hz.clear()
    requests.restart(10.0)
    watch(requests, vehicle, 10, since_s=10.0)
    assert vehicle.hz["GLOBAL_POSITION_INT"] == 20


def test_a_vehicle_that_silently_forgot_is_asked_again_too() -> None:
    vehicle = Vehicle()
    requests = StreamRequests((1, 1), "ardupilot", slow=False, now_s=0.0)
    watch(requests, vehicle, 10)
    vehicle.hz.clear()
    watch(requests, vehicle, 20, since_s=10.0)
    assert vehicle.hz["ATTITUDE"] == 20


def test_requests_go_out_a_few_at_a_time_and_the_needed_ones_first() -> None:
    requests = StreamRequests((1, 1), "ardupilot", slow=True, now_s=0.0)
    said = [requests.on_tick(step * STEP_S) for step in range(10)]
    assert [len(few) for few in said[:4]] == [FEW] * 4
    first = [NAMES[int(message.param1)] for few in said for message in few]
    assert {"GLOBAL_POSITION_INT", "ATTITUDE", "SYS_STATUS", "GPS_RAW_INT", "MISSION_CURRENT"} == set(first[:5])
    assert len(first) == len(set(first)) + 1, "HOME_POSITION once and by its rate"


def test_on_a_way_that_is_in_use_again_only_what_does_not_come_is_asked_for() -> None:
    vehicle = Vehicle()
    requests = StreamRequests((1, 1), "ardupilot", slow=False, now_s=0.0)
    watch(requests, vehicle, 10)
    vehicle.asked.clear()
    del vehicle.hz["ATTITUDE"]
    requests.go_on(60.0)
    watch(requests, vehicle, 2, since_s=60.0)
    assert set(vehicle.asked) - {"AUTOPILOT_VERSION"} == {"ATTITUDE"}, "this vehicle never tells its version"


def test_an_autopilot_that_does_not_know_the_command_is_asked_in_the_old_way() -> None:
    vehicle = Vehicle(grants=False)
    requests = StreamRequests((1, 1), "other", slow=False, now_s=0.0)
    watch(requests, vehicle, 1)
    assert vehicle.old_streams == set()
    refusal = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_RESULT_UNSUPPORTED)
    requests.on_message(heard(refusal), 1.0)
    watch(requests, vehicle, 10, since_s=1.0)
    assert vehicle.old_streams >= {6, 10}


def test_other_messages_change_nothing() -> None:
    requests = StreamRequests((1, 1), "ardupilot", slow=False, now_s=0.0)
    requests.on_message(heard(mavlink.MAVLink_command_ack_message(400, 4)), 0.0)
    requests.on_message(heard(attitude()), 0.0)
    assert not any(m.get_type() == "REQUEST_DATA_STREAM" for m in requests.on_tick(0.0))
