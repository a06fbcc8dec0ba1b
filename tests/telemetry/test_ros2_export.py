"""Recordings as ROS 2 bags: read back by rosbags and by the mcap package, and mapped again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from mapping.geometry.frames import LocalFrame, attitude_rotation
from mapping.sensor_frames import RadarFrame
from telemetry.errors import RecordingError
from telemetry.perception.rebuilding.rebuild import OtherMap, rebuild
from telemetry.perception.sensor_kinds import KINDS
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.ros.bag import bag_kind, list_bag
from telemetry.recording.ros.bag_flight import BagAsked, write_bag_flight
from telemetry.recording.ros.ros2_export import Ros2Export, export_ros2
from telemetry.recording.ros.ros2_writer import Ros2Writer
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState
from tests.telemetry import perception_flights as flights
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds: states at 20 Hz, radar at 10, two clouds."""
    path = tmp_path_factory.mktemp("export") / "flight.mcap"
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, now=lambda: 0.0)
    for k in range(80):
        t_s = k / 20
        writer.write(Topic.VEHICLE, flights.state_at(t_s, T0_MONO_S, T0_UTC_S), T0_UTC_S + t_s)
        if k % 2 == 0:
            writer.write(Topic.RADAR_FRAME, flights.radar_frame(t_s, k // 2, T0_MONO_S, T0_UTC_S), T0_UTC_S + t_s)
        if k in (20, 40):
            cloud = flights.cloud_frame(t_s, k, T0_MONO_S, T0_UTC_S, count=50)
            writer.write(Topic.CLOUD_FRAME, cloud, T0_UTC_S + t_s)
    writer.close()
    return path


@pytest.fixture(scope="module")
def bag(recording: Path) -> Path:
    out = recording.with_name("ros2.mcap")
    messages = {"/camera/points": 2, "/fix": 80, "/odom": 80, "/radar/points": 40, "/tf": 80}
    assert export_ros2(recording, out) == Ros2Export(messages, ())
    assert not list(out.parent.glob(".tmp-*"))
    return out


def test_both_readers_read_it(bag: Path) -> None:
    with bag.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert reader.get_header().profile == "ros2"
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 282
        assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    with AnyReader([bag]) as reader:
        assert {name: info.msgcount for name, info in reader.topics.items()}["/radar/points"] == 40
    assert bag_kind(bag) == "mcap"
    assert list_bag(bag).fault == ""


def test_points_through_its_transforms_are_where_the_radar_saw_them(recording: Path, bag: Path) -> None:
    with open_recording(recording) as opened:
        entries = [entry.message for entry in opened.entries((Topic.VEHICLE, Topic.RADAR_FRAME))]
    states = [message for message in entries if isinstance(message, VehicleState)]
    frames = [message for message in entries if isinstance(message, RadarFrame)]
    found, poses = [], {}
    with AnyReader([bag]) as reader:
        for connection, t_ns, data in reader.messages():
            message: object = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/tf":
                (moved,) = message.transforms  # type: ignore[attr-defined]
                shift, turn = moved.transform.translation, moved.transform.rotation
                at = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
                poses[t_ns] = (at, np.array([shift.x, shift.y, shift.z]))
            elif connection.topic == "/radar/points":
                found.append((t_ns, message.data.view("<f4").reshape(-1, 5)))  # type: ignore[attr-defined]
    assert len(found) == len(frames) == 40
    home = LocalFrame(states[0].home_lat_deg or 0, states[0].home_lon_deg or 0, states[0].home_alt_amsl_m or 0)
    for (t_ns, rows), frame, state in zip(found, frames, states[::2], strict=True):
        at, place = poses[t_ns]
        attitude = attitude_rotation(state.heading_rad or 0, state.pitch_rad or 0, state.roll_rad or 0)
        own = home.to_enu(state.lat_deg or 0, state.lon_deg or 0, home.alt_m)[0]
        own[2] = state.alt_rel_home_m
        xyz_m, speed_m_s, snr_db = frame.columns()
        np.testing.assert_allclose(at.apply(rows[:, :3]) + place, xyz_m @ attitude.T + own, atol=1e-4)
        np.testing.assert_array_equal(rows[:, 3:], np.column_stack([speed_m_s, snr_db]))


def test_its_map_is_the_recordings(recording: Path, bag: Path, tmp_path: Path) -> None:
    """The origin is another one: the first pose, not home."""
    asked = BagAsked("/radar/points", "/odom")
    flight = write_bag_flight(bag, list_bag(bag), asked, "radar", tmp_path / "again.mcap")
    assert (flight.clouds, flight.left_out) == (40, 0)
    other = OtherMap(radar_variant="full_attitude", radar_azimuth_deg=90.0, radar_low_deg=-80.0, radar_high_deg=80.0)
    own, again = rebuild(recording, KINDS["radar"], other=other), rebuild(tmp_path / "again.mcap", KINDS["radar"])
    assert again.frames == own.frames == 40
    assert again.points == own.points
    assert own.folded.last is not None
    first = flights.state_at(0.0, T0_MONO_S, T0_UTC_S)
    origin = own.folded.last.origin
    shift_m = LocalFrame(origin.lat_deg, origin.lon_deg, 0.0).to_enu(first.lat_deg or 0, first.lon_deg or 0, 0.0)[0]
    shift_m[2] = first.alt_rel_home_m
    centres = [built.folded.voxels.occupied().keys + 0.5 for built in (own, again)]
    # Voxels of 1 m that lie on another grid: each has one of the other map within a diagonal.
    for one, other_map in ((centres[0], centres[1] + shift_m), (centres[1] + shift_m, centres[0])):
        assert KDTree(other_map).query(one)[0].max() <= np.sqrt(3.0)


def test_a_recording_without_a_flight_is_refused(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S)
    writer.write(Topic.VEHICLE, VehicleState(1, 1), T0_UTC_S)
    writer.close()
    with pytest.raises(RecordingError, match="nothing to export"):
        export_ros2(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert not (tmp_path / "b.mcap").exists()


def test_what_is_damaged_in_the_recording_is_said(recording: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[:-4000])
    made = export_ros2(cut, tmp_path / "ros2.mcap")
    assert made.messages["/odom"] > 0
    assert any("not finished" in fault for fault in made.faults)


def test_half_a_bag_is_none(recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out, write = tmp_path / "ros2.mcap", Ros2Writer.cloud

    def full(*given: Any, **others: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Ros2Writer, "cloud", full)
    with pytest.raises(OSError, match="No space left"):
        export_ros2(recording, out)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(Ros2Writer, "cloud", write)
    assert export_ros2(recording, out).messages["/radar/points"] == 40
    assert list(tmp_path.iterdir()) == [out]
