"""The simulated PX4 as a ground station meets it: what PX4 1.17 was measured to say, to take and to do."""

from __future__ import annotations

import math
import struct
from collections import Counter
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.mavlink.modes import mode_name
from telemetry.mavlink.upload import MissionUpload
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.protocol.px4.px4_missions import Px4Missions
from tests.telemetry.lossy import Faults, Run
from tests.telemetry.mission_samples import mission
from tests.telemetry.mission_vehicles import HOME
from tests.telemetry.simulator_bench import Bench

LAT, LON, HOME_ALT_M = -371244507, 1756892878, 803.24
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
ARM, SET_MODE, TAKEOFF, START, SPEED, REPOSITION, INTERVAL, MESSAGE = 400, 176, 22, 300, 178, 192, 511, 512
AUTO = 4
HOLD, MISSION, RTL, LAND = (AUTO, 3), (AUTO, 4), (AUTO, 5), (AUTO, 6)
POSCTL, OFFBOARD = (3, 0), (6, 0)
INT32, FLOAT = 6, 9
QUICK = {"COM_SPOOLUP_TIME": 0.2, "MPC_TKO_RAMP_T": 0.5, "MPC_LAND_SPEED": 1.5, "MPC_LAND_CRWL": 1.0}


def ready(**parameters: float) -> Bench:
    bench = Bench(make="px4", parameters=PERSONALITIES["px4"].parameters(**{**QUICK, **parameters}))
    bench.until(lambda: bench.vehicle.autopilot.position_ok)
    bench.advance(1.2)
    return bench


def mode(bench: Bench, main_and_sub: tuple[int, int]) -> int:
    return bench.command(SET_MODE, 1, *main_and_sub)


def mode_now(bench: Bench) -> str:
    bench.advance(1.1)
    return mode_name("px4", 2, bench.last("HEARTBEAT").custom_mode)


def item(seq: int, command: int, **changes: Any) -> Any:
    fields: dict[str, Any] = {"frame": 3, "param1": 0.0, "param4": math.nan, "x": LAT, "y": LON, "z": 8.0, **changes}
    return wire.MAVLink_mission_item_int_message(
        1, 1, seq, fields["frame"], command, 0, 1, fields["param1"], 0, 0, fields["param4"], fields["x"], fields["y"],
        fields["z"], fields.get("kind", 0),
    )  # fmt: skip


def flight() -> list[Any]:
    """Speed, take-off, a place with a hold of 1.6 s, one 10 m higher, home."""
    return [
        item(0, SPEED, frame=2, param1=1.0),
        item(1, TAKEOFF),
        item(2, 16, x=LAT + 1000, param1=1.6),
        item(3, 16, x=LAT + 1000, y=LON + 1500, z=18.0),
        item(4, 20, frame=2, x=0, y=0, z=0.0),
    ]


def upload(bench: Bench, items: list[Any], kind: int = 0) -> int:
    answers = bench.send(wire.MAVLink_mission_count_message(1, 1, len(items), kind))
    while answers[0].get_type() != "MISSION_ACK":
        assert answers[0].get_type() == "MISSION_REQUEST_INT"
        answers = bench.send(items[answers[0].seq])
    return answers[0].type


def read_back(bench: Bench, kind: int = 0) -> list[Any]:
    count = bench.send(wire.MAVLink_mission_request_list_message(1, 1, kind))[0].count
    found = [bench.send(wire.MAVLink_mission_request_int_message(1, 1, seq, kind))[0] for seq in range(count)]
    bench.send(wire.MAVLink_mission_ack_message(1, 1, 0, kind))
    return found


def hovering(up_m: float = 8.0) -> Bench:
    bench = ready()
    assert bench.command(ARM, 1) == ACCEPTED
    nan = math.nan
    assert bench.command(TAKEOFF, nan, 0, 0, nan, nan, nan, HOME_ALT_M + up_m) == ACCEPTED
    bench.until(lambda: bench.vehicle.autopilot.mode.name == "HOLD")
    return bench


@pytest.mark.fact("P21", "P22", "P23")
def test_it_says_unasked_what_px4_says_and_at_its_rates() -> None:
    bench = ready()
    before = len(bench.heard)
    bench.advance(4.0)
    seen = Counter(one.message.get_type() for one in bench.heard[before:])
    for kind in ("ATTITUDE", "GLOBAL_POSITION_INT", "POSITION_TARGET_LOCAL_NED", "SERVO_OUTPUT_RAW"):
        assert 140 <= seen[kind] <= 202, (kind, seen[kind])
    assert (seen["GPS_RAW_INT"], seen["SYS_STATUS"], seen["HOME_POSITION"]) == (20, 4, 2)
    assert "POSITION_TARGET_GLOBAL_INT" not in seen
    assert bench.command(INTERVAL, 193, 1e6) == FAILED  # EKF_STATUS_REPORT is ArduPilot's
    assert bench.command(INTERVAL, 33, 1e5) == ACCEPTED
    before = len(bench.heard)
    bench.advance(2.0)
    assert sum(one.message.get_type() == "GLOBAL_POSITION_INT" for one in bench.heard[before:]) in (20, 21)


@pytest.mark.fact("P1", "P2", "P24", "P30")
def test_who_it_is_and_that_it_is_ready() -> None:
    bench = ready()
    assert bench.command(MESSAGE, 148) == ACCEPTED
    version = bench.last("AUTOPILOT_VERSION")
    assert version.flight_sw_version == 1 << 24 | 17 << 16 | 255
    assert version.capabilities & wire.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert not version.capabilities & wire.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    beat, status = bench.last("HEARTBEAT"), bench.last("SYS_STATUS")
    assert (beat.autopilot, beat.custom_mode, beat.base_mode, beat.system_status) == (12, 50593792, 29, 3)
    check = wire.MAV_SYS_STATUS_PREARM_CHECK
    assert status.onboard_control_sensors_health & check
    assert not (status.onboard_control_sensors_present | status.onboard_control_sensors_enabled) & check
    bench.advance(2.0)
    assert bench.last("ESTIMATOR_STATUS").flags == 1023  # a constant position, on the ground
    current = bench.last("MISSION_CURRENT")
    assert (current.total, current.mission_state) == (65535, 1)
    assert bench.texts()
    assert all(text.endswith("\t") for text in bench.texts())


@pytest.mark.fact("P29", "P31")
def test_a_mission_is_asked_for_and_given_back_as_px4_does() -> None:
    bench = ready()
    assert upload(bench, flight()) == ACCEPTED
    kept = read_back(bench)
    assert [(one.seq, one.frame, one.command) for one in kept] == [
        (0, 2, SPEED), (1, 6, TAKEOFF), (2, 6, 16), (3, 6, 16), (4, 2, 20),
    ]  # fmt: skip
    assert math.isnan(kept[2].param4)
    assert struct.pack("<f", kept[2].param1) == struct.pack("<f", 1.6)
    bench.advance(1.1)
    current = bench.last("MISSION_CURRENT")
    assert (current.seq, current.total, current.mission_state) == (0, 5, 2)
    assert bench.send(wire.MAVLink_mission_count_message(1, 1, 501))[0].type == wire.MAV_MISSION_NO_SPACE


def test_a_broken_off_upload_leaves_the_old_mission() -> None:
    bench = ready()
    upload(bench, flight())
    bench.send(wire.MAVLink_mission_count_message(1, 1, 3))
    bench.send(item(0, 16, z=99.0))
    bench.advance(1.0)
    assert len(bench.of("MISSION_REQUEST_INT")) >= 9  # again every quarter of a second
    bench.advance(5.0)
    assert [one.command for one in read_back(bench)] == [SPEED, TAKEOFF, 16, 16, 20]


class _OverRadio:
    """The simulated PX4's mission protocol, for a link with losses."""

    def __init__(self, bench: Bench) -> None:
        pilot = bench.vehicle.autopilot
        assert isinstance(pilot, Px4Pilot)
        self._missions = Px4Missions(pilot)

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        if not message.get_type().startswith("MISSION"):
            return []
        return [reply for _, reply in self._missions.on_message(message, "radio", now_s)]

    def on_tick(self, now_s: float) -> list[Any]:
        return [reply for _, reply in self._missions.on_tick(now_s)]


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
def test_hedgehops_upload_arrives_over_loss(loss: float) -> None:
    for seed in range(5):
        vehicle = _OverRadio(ready())
        machine = MissionUpload(mission(40), HOME, firmware="px4", target=(1, 1), now_s=0.0)
        run = Run(machine, vehicle, Faults(loss=loss), seed=seed).until_end()
        assert run.result.verified, run.result.differences


@pytest.mark.fact("P37")
def test_fence_and_rally_points_are_kept() -> None:
    bench = ready()
    corners = [item(seq, 5001, param1=3.0, param4=0.0, x=LAT + 90 * seq, kind=1) for seq in range(3)]
    assert upload(bench, corners, 1) == ACCEPTED
    assert [one.command for one in read_back(bench, 1)] == [5001] * 3
    assert upload(bench, [item(0, 5100, z=12.5, param4=0.0, kind=2)], 2) == ACCEPTED
    assert [one.z for one in read_back(bench, 2)] == [12.5]
    assert upload(bench, [item(0, 5001, param1=2.0, kind=1)], 1) == wire.MAV_MISSION_ERROR


@pytest.mark.fact("P26")
def test_integers_stand_bytewise_in_parameters() -> None:
    bench = ready()
    read = wire.MAVLink_param_request_read_message(1, 1, b"RTL_CONE_ANG", -1)
    value = bench.send(read)[0]
    assert (value.param_type, struct.unpack("<i", struct.pack("<f", value.param_value))[0]) == (INT32, 45)
    fifty = struct.unpack("<f", struct.pack("<i", 50))[0]
    changed = bench.send(wire.MAVLink_param_set_message(1, 1, b"RTL_CONE_ANG", fifty, INT32))[0]
    assert bench.vehicle.parameters["RTL_CONE_ANG"] == 50
    assert changed.param_index < changed.param_count
    bench.send(wire.MAVLink_param_set_message(1, 1, b"RTL_RETURN_ALT", 42.5, FLOAT))
    assert bench.vehicle.parameters["RTL_RETURN_ALT"] == 42.5
    bench.send(wire.MAVLink_param_request_list_message(1, 1))
    bench.advance(1.0)
    values = [one.message for one in bench.of("PARAM_VALUE")]
    assert "_HASH_CHECK" in {one.param_id for one in values}
    assert {one.param_index for one in values if one.param_index < 65535} == set(range(values[-1].param_count))


@pytest.mark.fact("P25")
def test_the_defaults_are_those_that_were_measured() -> None:
    parameters = ready().vehicle.parameters
    for name, value in {
        "NAV_ACC_RAD": 2, "NAV_MC_ALT_RAD": 0.8, "MPC_XY_CRUISE": 5, "MPC_XY_VEL_MAX": 12, "MPC_Z_V_AUTO_UP": 3,
        "MPC_Z_V_AUTO_DN": 1.5, "MPC_ACC_HOR": 3, "MPC_JERK_AUTO": 4, "MPC_XY_ERR_MAX": 2, "MPC_XY_TRAJ_P": 0.5,
        "MPC_TKO_SPEED": 1.5, "MIS_TAKEOFF_ALT": 2.5, "MIS_TKO_LAND_REQ": 0, "MIS_DIST_1WP": 10000,
        "RTL_RETURN_ALT": 30, "RTL_DESCEND_ALT": 10, "RTL_CONE_ANG": 45, "RTL_MIN_DIST": 10, "RTL_TYPE": 0,
        "NAV_DLL_ACT": 0, "NAV_RCL_ACT": 2, "COM_RC_IN_MODE": 1, "COM_DL_LOSS_T": 10, "COM_OF_LOSS_T": 1,
        "COM_OBL_RC_ACT": 0, "COM_DISARM_LAND": 2, "COM_DISARM_PRFLT": 10, "GF_ACTION": 2,
    }.items():  # fmt: skip
        assert parameters[name] == value, name


@pytest.mark.fact("P27", "P28", "P32", "P35")
def test_a_mission_from_the_ground_to_the_ground() -> None:
    """MISSION on the ground, armed: it takes off at once; its end is RTL, and then the mode before."""
    bench = ready()
    upload(bench, flight())
    assert [mode(bench, MISSION), bench.command(ARM, 1), bench.command(START, 0, 0)] == [ACCEPTED] * 3
    bench.until(lambda: bench.vehicle.autopilot.stage == "flight")
    landed = [one.message.landed_state for one in bench.of("EXTENDED_SYS_STATE")]
    assert list(dict.fromkeys(landed)) == [1, 3]  # "in the air" only above
    assert bench.vehicle.autopilot.p_neu[2] > 8 - 0.9
    bench.advance(2.1)
    assert bench.last("ESTIMATOR_STATUS").flags == 895
    high_m = 0.0
    while bench.vehicle.autopilot.armed:
        bench.advance(0.2)
        if bench.vehicle.autopilot.mode.name == "RTL":
            high_m = max(high_m, bench.vehicle.autopilot.p_neu[2] - bench.vehicle.autopilot.home_neu[2])
        assert bench.now_s < 300
    assert 29.0 < high_m < 31.0  # RTL_RETURN_ALT
    assert [one.message.seq for one in bench.of("MISSION_ITEM_REACHED")][-1] == 4
    words = [text.strip("\t") for text in bench.texts()]
    for said in ("Armed by external command", "Executing Mission", "Takeoff detected", "Mission finished, loitering"):
        assert said in words
    assert words[-2:] == ["Landing detected", "Disarmed by landing"]
    assert mode_now(bench) == "HOLD"
    assert (bench.last("MISSION_CURRENT").mission_state, bench.last("MISSION_CURRENT").seq) == (5, 4)


@pytest.mark.fact("P10")
def test_after_a_hold_below_the_next_place_it_climbs_first() -> None:
    bench = ready()
    upload(bench, flight())
    mode(bench, MISSION)
    bench.command(ARM, 1)
    bench.until(lambda: bench.vehicle.autopilot.mission.current == 3)
    assert mode(bench, HOLD) == ACCEPTED
    bench.advance(6.0)
    assert bench.last("MISSION_CURRENT").mission_state == 4
    n, e, u = bench.vehicle.autopilot.p_neu
    assert u < 16.5
    assert mode(bench, MISSION) == ACCEPTED
    assert bench.texts()[-1] == "Climb to 18.0 meters above home\t"
    bench.until(lambda: bench.vehicle.autopilot.p_neu[2] > 17.0)
    assert math.dist(bench.vehicle.autopilot.p_neu[:2], (n, e)) < 1.5


@pytest.mark.fact("P33")
def test_a_return_keeps_a_greater_height() -> None:
    bench = hovering(34.0)
    assert mode(bench, RTL) == ACCEPTED
    bench.advance(0.1)
    said = "".join(text for text in bench.texts() if text.startswith(("RTL: start", ")")))
    assert said in {f"RTL: start return at {803 + up} m ({up} m above destination)\t" for up in (33, 34)}


@pytest.mark.fact("P34")
def test_it_goes_where_it_is_told_above_the_sea() -> None:
    bench = hovering()
    order = wire.MAVLink_command_int_message(1, 1, 0, REPOSITION, 0, 0, -1, 1, 0, math.nan, LAT + 1000, LON, 815.24)
    assert bench.send(order)[0].result == ACCEPTED
    north_m = 1000e-7 * bench.vehicle.frame.metres_per_degree[0]
    bench.until(lambda: math.dist(bench.vehicle.autopilot.p_neu, (north_m, 0.0, 12.0)) < 0.8, limit_s=60)
    assert bench.vehicle.autopilot.mode.name == "HOLD"


def test_a_place_that_changes_no_mode_is_carried_out_and_answered_with_unsupported() -> None:
    bench = hovering()
    up_m, nan = 803.0 + bench.vehicle.autopilot.p_neu[2], math.nan
    order = wire.MAVLink_command_int_message(1, 1, 0, REPOSITION, 0, 0, -1, 0, 0, nan, LAT + 10_000, LON, up_m)
    assert bench.send(order)[0].result == UNSUPPORTED
    bench.advance(12.0)
    began_m = bench.vehicle.truth.p_neu[0]
    assert began_m > 10.0
    assert bench.command(REPOSITION, -1, 0, 0, nan, nan, nan, nan) == UNSUPPORTED
    bench.advance(12.0)
    assert bench.vehicle.truth.p_neu[0] < began_m + 15.0
    assert mode(bench, RTL) == ACCEPTED
    assert bench.send(order)[0].result == UNSUPPORTED
    bench.advance(1.0)
    assert bench.vehicle.autopilot.mode.name == "RTL"


@pytest.mark.fact("P36")
def test_offboard_needs_a_stream_and_ends_without_it() -> None:
    bench = hovering()
    mask = 0b0000_1101_1100_0111
    target = wire.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, mask, 0, 0, 0, 1.0, 0, 0, 0, 0, 0, 0, 0)
    assert mode(bench, OFFBOARD) == REJECTED
    began_m = bench.vehicle.autopilot.p_neu[0]
    for sent in range(40):
        bench.send(target)
        bench.advance(0.1)
        if sent == 1:
            assert mode(bench, OFFBOARD) == ACCEPTED
    assert bench.vehicle.autopilot.p_neu[0] - began_m > 2.0
    assert bench.vehicle.autopilot.v_neu[0] == pytest.approx(0.89, abs=0.15)  # as measured where 1 m/s was asked
    bench.advance(1.5)
    assert bench.vehicle.autopilot.mode.name == "HOLD"


def test_what_it_does_not_do() -> None:
    bench = ready()
    assert bench.command(START, 0, 0) == DENIED
    assert bench.command(193, 0) == UNSUPPORTED
    assert bench.command(MESSAGE, 193) == DENIED
    assert mode(bench, POSCTL) == ACCEPTED  # on the ground; but nobody has a stick in his hand
    assert bench.command(ARM, 1) == REJECTED
    flying = hovering()
    assert mode(flying, POSCTL) == REJECTED
    assert flying.command(ARM, 0) == REJECTED


@pytest.mark.fact("P38")
@pytest.mark.parametrize(
    ("command", "before"), [(246, UNSUPPORTED), (179, ACCEPTED), (207, UNSUPPORTED), (209, UNSUPPORTED)]
)
def test_what_is_for_the_ground_is_denied_while_it_is_armed(command: int, before: int) -> None:
    """Starting again, another home, the fence's switch, turning single motors."""
    bench = ready()
    assert bench.command(command, 1) == before
    assert bench.command(ARM, 1) == ACCEPTED
    assert bench.command(command, 1) == DENIED
    assert bench.command(ARM, 0) == ACCEPTED
    assert not bench.vehicle.autopilot.armed


def test_its_motors_stop_when_it_does_not_take_off() -> None:
    bench = ready()
    assert bench.command(ARM, 1) == ACCEPTED
    bench.advance(9.5)
    assert bench.vehicle.autopilot.armed
    bench.advance(1.0)
    assert not bench.vehicle.autopilot.armed


@pytest.mark.fact("P11")
def test_home_moves_with_a_receiver_of_metres_alone() -> None:
    shifts = {}
    for name in ("standalone", "rtk"):
        bench = Bench(make="px4", gnss=name, seed=4)
        bench.until(lambda bench=bench: bench.vehicle.autopilot.position_ok)
        pilot = bench.vehicle.autopilot
        assert isinstance(pilot, Px4Pilot)
        pilot.arm()
        began_m = pilot.home_neu[2]
        pilot.take_off(10.0)
        seen = []
        for _ in range(12):
            bench.advance(10.0)
            seen.append(pilot.home_neu[2] - began_m)
        shifts[name] = max(seen) - min(seen)
    assert 0.3 < shifts["standalone"] <= 1.2
    assert shifts["rtk"] == 0
