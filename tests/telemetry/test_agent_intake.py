"""The ground station's end of the sensor link."""

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose, UwbScan, rows
from telemetry.agent.intake import SCANS_MOST_HZ, Intake, Taken
from telemetry.agent.link_messages import (
    NOTICE_LONGEST,
    STEP_M,
    Cloud,
    Hello,
    Notice,
    Ping,
    Pong,
    RadarMessage,
    Slam,
    Uwb,
    Welcome,
    cloud,
    decode_from_agent,
    encode,
    points_of,
)
from telemetry.errors import SensorLinkError

TARGETS = np.array([[1, 50, 0.5, -3, 20], [2, 60, 1, 0.31, 15]], np.float32)


def greeted() -> Intake:
    intake = Intake()
    taken = intake.on_data(encode(Hello(1, "drone")), now_mono_s=100.0, now_utc_s=1000.0)
    assert taken.answer == Welcome(100.0)
    return intake


def give(intake: Intake, message: RadarMessage | Cloud | Slam | Ping | Notice, now_mono_s: float = 100.0):
    return intake.on_data(encode(message), now_mono_s=now_mono_s, now_utc_s=1000.0 + now_mono_s - 100.0)


def radar(number: int, t_s: float = 99.9) -> RadarMessage:
    return RadarMessage(number, t_s, TARGETS.tobytes())


def test_a_radar_frame_becomes_one_for_the_bus() -> None:
    frame = give(greeted(), radar(7)).frame
    assert isinstance(frame, RadarFrame)
    assert (frame.number, frame.source, frame.t_mono_s) == (7, "drone", 99.9)
    assert frame.t_utc_s == pytest.approx(999.9)
    assert np.array_equal(rows(frame.xyz_m, 3), TARGETS[:, :3])
    assert np.array_equal(rows(frame.radial_speed_m_s, 1)[:, 0], TARGETS[:, 3])
    assert np.array_equal(rows(frame.snr_db, 1)[:, 0], TARGETS[:, 4])


@given(st.lists(st.tuples(*[st.floats(-160, 160, width=32)] * 3), max_size=50))
def test_a_cloud_arrives_to_half_a_step(points: list[tuple[float, float, float]]) -> None:
    xyz_m = np.array(points, np.float32).reshape(-1, 3)
    frame = give(greeted(), cloud(xyz_m, number=0, t_s=99.0, voxel_m=0.25)).frame
    assert isinstance(frame, CloudFrame)
    assert frame.voxel_m == 0.25
    assert np.allclose(rows(frame.xyz_m, 3), xyz_m, atol=STEP_M / 2 + 1e-4)


def test_points_that_cannot_be_written_are_left_out() -> None:
    xyz_m = np.array([[1, 2, 3], [np.nan, 0, 0], [400, 0, 0], [np.inf, 1, 1]], np.float32)
    assert points_of(cloud(xyz_m, number=0, t_s=0.0, voxel_m=0.0)) == pytest.approx(np.array([[1, 2, 3]]))


def test_a_pose_passes_and_one_without_numbers_does_not() -> None:
    intake = greeted()
    pose = Slam(99.0, (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0), "poor")
    assert give(intake, pose).frame == SlamPose(99.0, (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0), "poor")
    assert give(intake, Slam(99.0, (float("nan"), 0, 0), (1.0, 0, 0, 0), "good")).frame is None
    assert intake.refused == 1


def uwb(number: int, **changes: float) -> Uwb:
    return msgspec.structs.replace(Uwb(number, 99.9, np.arange(16, dtype="<f4").tobytes()), **changes)


def test_a_uwb_scan_becomes_one_for_the_bus() -> None:
    scan = give(greeted(), uwb(3, beamwidth_deg=30.0, bearing_deg=-90.0)).frame  # type: ignore[arg-type]
    assert isinstance(scan, UwbScan)
    assert (scan.number, scan.source, scan.t_mono_s, scan.bin_m) == (3, "drone", 99.9, 0.30)
    assert (scan.beamwidth_rad, scan.bearing_rad) == pytest.approx((np.radians(30.0), np.radians(-90.0)))
    assert rows(scan.intensity, 1)[:, 0].tolist() == list(range(16))


@pytest.mark.parametrize(
    "wrong",
    [{"intensity": b"abc"}, {"intensity": bytes(4 * 4097)}, {"intensity": bytes(4 * 7)}, {"bin_m": 0.0},
     {"bin_m": float("nan")}, {"first_bin_m": float("inf")}, {"beamwidth_deg": 181.0}, {"bearing_deg": 1e9},
     {"intensity": np.full(16, np.nan, "<f4").tobytes()}, {"t_s": 200.0}],
)  # fmt: skip
def test_a_scan_that_is_none_is_refused(wrong: dict[str, float]) -> None:
    intake = greeted()
    assert give(intake, uwb(0, **wrong)).frame is None  # type: ignore[arg-type]
    assert (intake.received, intake.refused) == (0, 1)


def test_scans_come_no_faster_than_they_may() -> None:
    intake = greeted()
    for number in range(SCANS_MOST_HZ + 50):
        give(intake, uwb(number), 100.0 + number * 0.001)  # type: ignore[arg-type]
    assert (intake.received, intake.refused, intake.lost) == (SCANS_MOST_HZ, 50, 0)
    assert isinstance(give(intake, uwb(999), 101.5).frame, UwbScan)  # type: ignore[arg-type]


def test_a_notice_is_for_the_pilot_once_a_second() -> None:
    intake = greeted()
    first = give(intake, Notice(True, "radar: gone\x1b[2J" + "!" * 300)).notice
    assert first is not None
    assert (first.severity, first.t_utc_s) == (4, 1000.0)
    assert first.text.startswith("drone: radar: gone [2J!!!")
    assert len(first.text) == len("drone: ") + NOTICE_LONGEST
    assert give(intake, Notice(False, "radar: back"), 100.5).notice is None
    assert intake.refused == 1
    second = give(intake, Notice(False, "radar: back"), 101.0).notice
    assert second is not None
    assert (second.severity, second.text) == (6, "drone: radar: back")
    assert intake.received == 0


def test_gaps_and_late_frames_are_counted() -> None:
    intake = greeted()
    for number, now_s in ((0, 100.0), (1, 100.0), (4, 100.0), (5, 101.0)):
        assert give(intake, radar(number), now_s).frame is not None
    report = intake.report(101.0)
    assert (report.received, report.lost, report.late, report.refused) == (4, 2, 1, 0)
    assert report.bytes_per_s > 0


@pytest.mark.parametrize("t_s", [100.2, float("nan"), float("inf"), -5000.0])
def test_impossible_times_are_refused_and_told(t_s: float) -> None:
    intake = greeted()
    assert give(intake, radar(0, t_s)).frame is None
    report = intake.report(100.0)
    assert (report.refused, report.received) == (1, 0)
    assert "measured" in report.text
    assert intake.report(100.0).text == ""


@pytest.mark.parametrize("column", range(5))
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_target_that_is_no_number_is_refused_and_told(column: int, value: float) -> None:
    intake, targets = greeted(), TARGETS.copy()
    targets[-1, column] = value
    taken = give(intake, RadarMessage(1, 99.9, targets.tobytes()))
    assert isinstance(taken.frame, RadarFrame)
    assert rows(taken.frame.xyz_m, 3) == pytest.approx(TARGETS[:1, :3])
    report = intake.report(100.0)
    assert (report.refused, report.received) == (1, 1)
    assert "1 of 2 targets hold what is no number" in report.text
    targets[:, column] = value
    assert give(intake, RadarMessage(1, 99.9, targets.tobytes())).frame is None  # it would look like an empty air
    assert intake.report(100.0).refused == 2
    assert give(intake, radar(2)).frame is not None


@pytest.mark.parametrize("message", [RadarMessage(0, 99.0, b"123"), Cloud(0, 99.0, 0.2, 0.005, b"1"),
                                     Cloud(0, 99.0, 0.2, 0.0, b""), Cloud(0, 99.0, 0.2, 0.005, bytes(600_006)),
                                     RadarMessage(0, 99.0, bytes(20 * 1001))], ids=str)  # fmt: skip
def test_bytes_that_are_no_rows_are_refused(message: RadarMessage | Cloud) -> None:
    intake = greeted()
    assert give(intake, message).frame is None
    assert intake.refused == 1


def test_a_ping_is_answered_with_both_clocks() -> None:
    assert give(greeted(), Ping(5.5), 123.0).answer == Pong(5.5, 123.0)


@pytest.mark.parametrize("hello", [Hello(2, "drone"), Hello(1, ""), Hello(1, "x" * 41), Hello(1, "a\nb")])
def test_agents_that_cannot_be_understood_are_sent_away(hello: Hello) -> None:
    with pytest.raises(SensorLinkError):
        Intake().on_data(encode(hello), now_mono_s=0.0, now_utc_s=0.0)


def test_frames_before_hello_end_the_connection() -> None:
    with pytest.raises(SensorLinkError, match="hello"):
        give(Intake(), radar(0))


@given(st.binary(max_size=200))
def test_noise_never_does_more_than_end_the_connection(data: bytes) -> None:
    try:
        decode_from_agent(data)
    except SensorLinkError as error:
        assert error.advice  # noqa: PT017 - noise may be a message by chance


def test_unknown_fields_and_types_are_told() -> None:
    for wrong in ({"type": "bomb"}, {"type": "ping", "t_s": 1.0, "more": 1}, {"t_s": 1.0}, [1]):
        with pytest.raises(SensorLinkError):
            decode_from_agent(msgspec.msgpack.encode(wrong))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"type": "bomb"}, "bomb"), ({"type": "ping", "t_s": 1.0, "more": 1}, "more"), ({"t_s": 1.0}, "type"),
     ([1], "object"),
     ({"type": "slam", "t_s": 1.0, "position_m": [0, 0, 0], "q_wxyz": [1, 0, 0, 0], "tracking": "fine"}, "fine")],
    ids=str,
)  # fmt: skip
def test_what_is_not_known_after_hello_is_refused_and_the_next_frame_passes(wrong: object, words: str) -> None:
    intake = greeted()
    taken = intake.on_data(msgspec.msgpack.encode(wrong), now_mono_s=100.0, now_utc_s=1000.0)
    assert taken == Taken()
    assert give(intake, radar(0)).frame is not None
    report = intake.report(100.0)
    assert (report.received, report.refused) == (1, 1)
    assert words in report.text


@given(st.binary(max_size=200))
def test_noise_after_hello_never_ends_the_connection(data: bytes) -> None:
    intake = greeted()
    intake.on_data(data, now_mono_s=100.0, now_utc_s=1000.0)
    assert give(intake, radar(0)).frame is not None


def test_what_is_not_known_before_hello_and_another_version_after_it_end_the_connection() -> None:
    with pytest.raises(SensorLinkError):
        Intake().on_data(msgspec.msgpack.encode({"type": "bomb"}), now_mono_s=0.0, now_utc_s=0.0)
    with pytest.raises(SensorLinkError, match="version 2"):
        greeted().on_data(encode(Hello(2, "drone")), now_mono_s=0.0, now_utc_s=0.0)
