"""Bags as rosbags writes them, read in the confined process: tables, points of any layout, flights, hostile files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from mapping.voxels.map import VoxelMap
from telemetry.errors import RecordingError
from telemetry.perception.rebuilding.rebuild import OtherMap, Rebuilt, rebuild
from telemetry.perception.sensor_kinds import KINDS as SENSORS
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.ros.bag import bag_kind, contents_of, list_bag, read_bag
from telemetry.recording.ros.bag_flight import BagAsked, BagFlight, write_bag_flight
from telemetry.recording.ros.bag_types import CLOUD, TABLES
from telemetry.recording.ros.point_messages import MalformedMessageError, points_of
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import Sensor
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.bags import KINDS, T0_NS, Entry, Messages, write_bag

S = 1_000_000_000
FORWARD = (1.0, 0.0, 0.0, 0.0)
POSES_S = np.arange(61) * 0.05
NORTH = Rotation.from_euler("z", 90, degrees=True)


def wxyz(turn: Rotation) -> np.ndarray:
    return np.roll(turn.as_quat(), 1)


class Flight:
    """A robot flies north towards a wall; its radar is mounted turned, on an arm. All at 20 Hz but the radar at 10."""

    def __init__(self) -> None:
        rng = np.random.default_rng(7)
        self.places = np.column_stack([100 + 0.1 * np.sin(POSES_S), 200 + 3 * POSES_S, 30 + 0.3 * POSES_S])
        tilts = rng.uniform(-8, 8, (len(POSES_S), 3)).cumsum(axis=0) * 0.2
        self.turns = NORTH * Rotation.from_euler("zyx", tilts, degrees=True)
        self.mount_m, self.mount = np.array([0.2, -0.1, -0.05]), Rotation.from_euler("zyx", [20, 10, -5], degrees=True)
        keys = np.unique(np.column_stack([rng.integers(-8, 8, 80), np.full(80, 40), rng.integers(-3, 6, 80)]), axis=0)
        self.wall_enu_m = self.places[0] + keys + 0.5 + rng.uniform(-0.4, 0.4, keys.shape)
        self.keys = keys
        self.clouds_s = 0.02 + np.arange(28) * 0.1

    def seen(self, t_s: float) -> np.ndarray:
        """(N, 3) in the radar's frame: some of the wall."""
        some = self.wall_enu_m[int(t_s * 10) % 3 :: 3]
        place = [np.interp(t_s, POSES_S, self.places[:, k]) for k in range(3)]
        at_base = Slerp(POSES_S, self.turns)(t_s).inv().apply(some - place)
        return self.mount.inv().apply(at_base - self.mount_m)

    def entries(self, kind: str, *, poses: str = "odometry", **columns: float) -> list[Entry]:
        m, found = Messages(kind), list[Entry]()
        found.append(("/tf_static", T0_NS, m.tf(T0_NS, "base_link", "radar", self.mount_m, wxyz(self.mount))))
        for t_s, place, turn in zip(POSES_S, self.places, self.turns, strict=True):
            t_ns = T0_NS + round(t_s * S)
            if poses == "odometry":
                found.append(("/odom", t_ns, m.odometry(t_ns, "odom", "base_link", place, wxyz(turn))))
            elif poses == "pose":
                found.append(("/pose", t_ns, m.pose_stamped(t_ns, "odom", place, wxyz(turn))))
            else:
                found.append(("/tf", t_ns, m.tf(t_ns, "odom", "base_link", place, wxyz(turn))))
        for t_s in self.clouds_s:
            t_ns, xyz = T0_NS + round(t_s * S), self.seen(t_s)
            others: Any = {name: np.full(len(xyz), value) for name, value in columns.items()}
            cloud = m.cloud(t_ns, "radar", dict(zip("xyz", xyz.T, strict=True)) | others)
            found.append(("/points", t_ns + 7_000_000, cloud))
        found.append(("/fix", T0_NS, m.fix(T0_NS, 45.0, 10.0, 480.0)))
        return sorted(found, key=lambda entry: entry[1])


def flown(bag: Path, out: Path, sensor: Sensor = "radar", **asked: Any) -> BagFlight:
    return write_bag_flight(bag, list_bag(bag), BagAsked(**{"points": "/points", **asked}), sensor, out)


def mapped(bag: Path, out: Path, sensor: Sensor = "radar", **asked: Any) -> Rebuilt:
    flown(bag, out, sensor, **asked)
    return rebuild(out, SENSORS[sensor], other=OtherMap(resolution_m=1.0, whole_flight=True))


def keys_of(built: Rebuilt) -> set[tuple[int, ...]]:
    return set(map(tuple, built.folded.voxels.occupied().keys.tolist()))


@pytest.mark.parametrize("kind", KINDS)
def test_the_table_tells_types_counts_and_times(tmp_path: Path, kind: str) -> None:
    bag = write_bag(tmp_path, kind, Flight().entries(kind))
    table = list_bag(bag)
    assert table.kind == ("ros1" if kind == "ros1" else "folder")
    assert not table.fault
    rows = {topic.name: topic for topic in table.topics}
    assert {name: (row.type.split("/")[-1], row.count) for name, row in rows.items()} == {
        "/fix": ("NavSatFix", 1),
        "/odom": ("Odometry", 61),
        "/points": ("PointCloud2", 28),
        "/tf_static": ("TFMessage", 1),
    }
    assert rows["/odom"].first_utc_s == T0_NS / 1e9
    assert rows["/odom"].last_utc_s == T0_NS / 1e9 + 3.0


@pytest.mark.parametrize(("kind", "poses"), [("ros1", "odometry"), ("db3", "pose"), ("mcap", "transforms")])
def test_the_map_of_a_bag_is_that_of_the_same_points_and_poses(tmp_path: Path, kind: str, poses: str) -> None:
    flight = Flight()
    bag = write_bag(tmp_path, kind, flight.entries(kind, poses=poses))
    direct = VoxelMap(resolution_m=1.0)
    direct.insert_hits(flight.wall_enu_m - flight.places[0])
    wanted = set(map(tuple, np.floor(direct.occupied()).astype(int).tolist()))
    assert wanted == set(map(tuple, flight.keys.tolist()))
    for sensor in ("radar", "vision", "ranges"):
        built = mapped(bag, tmp_path / f"{sensor}.mcap", sensor, pose="/tf" if poses == "transforms" else None)
        reach = {key for key in wanted if sensor != "vision" or np.linalg.norm(key) < 38}
        assert reach <= keys_of(built) <= wanted, sensor
        assert (built.frames, built.dropped) == (28, 0)


def test_a_single_storage_file_is_a_bag_as_well(tmp_path: Path) -> None:
    for kind in ("db3", "mcap"):
        folder = write_bag(tmp_path, kind, Flight().entries(kind), kind)
        (file,) = folder.glob(f"*.{kind}")
        assert bag_kind(file) == kind
        assert keys_of(mapped(file, tmp_path / f"of-{kind}.mcap")) == set(map(tuple, Flight().keys.tolist()))


def test_radars_that_tell_speed_and_strength_are_judged_as_in_flight(tmp_path: Path) -> None:
    path = write_bag(tmp_path, "mcap", Flight().entries("mcap", doppler=-3.0, snr=30.0))
    flight = flown(path, tmp_path / "a.mcap")
    assert not any("counts as it is" in note for note in flight.notes)
    with open_recording(tmp_path / "a.mcap") as recording:
        states = [e.message for e in recording.entries((Topic.VEHICLE,))]
    assert isinstance(states[5], VehicleState)
    assert states[5].v_north_m_s == pytest.approx(3.0)
    assert states[5].v_down_m_s == pytest.approx(-0.3)


def test_home_is_the_fix_and_the_height_that_is_given(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, "ros1", Flight().entries("ros1"))
    assert not flown(bag, tmp_path / "a.mcap").is_on_earth
    assert flown(bag, tmp_path / "b.mcap", home_alt_amsl_m=432.0).is_on_earth
    built = rebuild(tmp_path / "b.mcap", SENSORS["radar"])
    assert built.folded.last is not None
    origin = built.folded.last.origin
    assert (origin.lat_deg, origin.lon_deg, origin.alt_amsl_m) == (45.0, 10.0, 432.0)


@pytest.mark.parametrize(("late_s", "most_gap_s"), [(0.4, 0.5), (0.6, 0.5), (900.0, 0.5), (900.0, 1000.0)])
def test_a_fix_of_another_time_is_no_home(tmp_path: Path, late_s: float, most_gap_s: float) -> None:
    t_ns, m = T0_NS + round(late_s * S), Messages("ros1")
    entries = [entry for entry in Flight().entries("ros1") if entry[0] != "/fix"]
    bag = write_bag(tmp_path, "ros1", [*entries, ("/fix", t_ns, m.fix(t_ns, 45.0, 10.0, 480.0))])
    asked: dict[str, Any] = {"home_alt_amsl_m": 432.0, "most_gap_s": most_gap_s}
    if late_s < most_gap_s:
        assert flown(bag, tmp_path / "a.mcap", **asked).is_on_earth
        return
    with pytest.raises(RecordingError, match=f"is {late_s:.3f} s away") as caught:
        flown(bag, tmp_path / "a.mcap", **asked)
    assert "--max-gap-s" in caught.value.advice
    assert not flown(bag, tmp_path / "a.mcap").is_on_earth


@pytest.mark.parametrize(("lat_deg", "lon_deg"), [(90.5, 10.0), (45.0, -180.5), (1e300, 0.0)])
def test_a_fix_nowhere_on_earth_is_none(tmp_path: Path, lat_deg: float, lon_deg: float) -> None:
    m, entries = Messages("ros1"), Flight().entries("ros1")
    nowhere = ("/fix", T0_NS, m.fix(T0_NS, lat_deg, lon_deg, 480.0))
    bag = write_bag(tmp_path, "ros1", [nowhere, *(entry for entry in entries if entry[0] != "/fix")])
    flight = flown(bag, tmp_path / "a.mcap", home_alt_amsl_m=432.0)
    assert not flight.is_on_earth
    assert any("1 messages contradict themselves" in note and "no place on Earth" in note for note in flight.notes)


def test_another_frame_than_that_of_the_poses_is_reached_through_the_transforms(tmp_path: Path) -> None:
    flight, out = Flight(), tmp_path / "a.mcap"
    flown(write_bag(tmp_path, "mcap", flight.entries("mcap")), out, "vision", base="radar")
    with open_recording(out) as recording:
        poses: list[Any] = [entry.message for entry in recording.entries((Topic.SLAM_POSE,))]
    base_m = np.column_stack([np.interp(flight.clouds_s, POSES_S, flight.places[:, k]) for k in range(3)])
    radar_m = base_m + Slerp(POSES_S, flight.turns)(flight.clouds_s).apply(flight.mount_m)
    first_m = flight.places[0] + flight.turns[0].apply(flight.mount_m)
    assert np.array([pose.position_m for pose in poses]) == pytest.approx(radar_m - first_m, abs=1e-6)


def test_a_gap_leaves_clouds_out_and_says_where(tmp_path: Path) -> None:
    entries = [e for e in Flight().entries("mcap") if e[0] != "/odom" or not 0.9 < (e[1] - T0_NS) / S < 2.1]
    bag = write_bag(tmp_path, "mcap", entries)
    flight = flown(bag, tmp_path / "a.mcap")
    assert (flight.clouds, flight.left_out) == (16, 12)
    (note,) = (note for note in flight.notes if "left out: no transform" in note)
    assert "12 of 28 clouds were left out: no transform from base_link to odom between 0.880 s and 2.080 s." in note
    assert flown(bag, tmp_path / "b.mcap", most_gap_s=2.0).left_out == 0


def test_stamps_of_zero_give_way_to_the_time_of_recording(tmp_path: Path) -> None:
    m, entries = Messages("mcap"), list[Entry]()
    for k in range(10):
        t_ns = T0_NS + k * S // 10
        entries.append(("/odom", t_ns, m.odometry(t_ns, "odom", "base_link", [0, 0, k], FORWARD)))
        entries.append(("/points", t_ns, m.cloud(0, "base_link", {"x": [5.0], "y": [0.0], "z": [0.0]})))
    entries.append(("/tf_static", T0_NS, m.tf(T0_NS, "base_link", "radar", [0, 0, 0], FORWARD)))
    flight = flown(write_bag(tmp_path, "mcap", entries), tmp_path / "a.mcap")
    assert flight.clouds == 10
    assert any(note.startswith("10 messages have no time of their own") for note in flight.notes)


@pytest.mark.parametrize(
    ("asked", "what", "advice"),
    [
        ({"points": "/lidar"}, "/lidar is not in the bag", "/points (PointCloud2, 28)"),
        ({"points": "/odom"}, "/odom is of nav_msgs/msg/Odometry, which holds no points", "/points"),
        ({"pose": "/points"}, "which holds no poses", "/odom (Odometry, 61)"),
        ({"pose": "/tf_static", "base": "drone"}, "No transform tells of the robot's frame drone", "base_link, radar"),
        (
            {"base": "drone"},
            "The poses are of the frame base_link, and no transform leads from there to drone",
            "radar",
        ),
        ({"pose": "/tf_static"}, "Nothing tells where the robot was: no transform leads from base_link on", "--pose"),
        ({"pose": "/tf_static", "base": "radar"}, "all transforms from radar to base_link are static", "--pose"),
        ({"most_gap_s": float("nan")}, "nan s is none", "0.5"),
        ({"most_gap_s": 0.01}, "No cloud can be placed: no transform from base_link to odom between", "--max-gap-s"),
    ],
)
def test_what_is_missing_is_said(tmp_path: Path, asked: dict[str, Any], what: str, advice: str) -> None:
    bag = write_bag(tmp_path, "ros1", Flight().entries("ros1"))
    with pytest.raises(RecordingError) as caught:
        flown(bag, tmp_path / "a.mcap", **asked)
    assert what in caught.value.what
    assert advice in caught.value.advice


def test_a_bag_without_poses_says_so(tmp_path: Path) -> None:
    entries = [entry for entry in Flight().entries("ros1") if entry[0] != "/odom"]
    with pytest.raises(RecordingError, match="It holds no poses"):
        flown(write_bag(tmp_path, "ros1", entries), tmp_path / "a.mcap")


def test_dense_clouds_are_no_radars(tmp_path: Path) -> None:
    m, x = Messages("mcap"), np.linspace(5, 6, 2001)
    entries: list[Entry] = [("/odom", T0_NS, m.odometry(T0_NS, "odom", "radar", [0, 0, 0], FORWARD))]
    entries.append(("/points", T0_NS, m.cloud(T0_NS, "radar", {"x": x, "y": x, "z": x})))
    with pytest.raises(RecordingError, match="2,001 points, more than the 2,000 targets of a radar"):
        flown(write_bag(tmp_path, "mcap", entries), tmp_path / "a.mcap")


def test_scans_and_ranges_lie_where_their_angles_say(tmp_path: Path) -> None:
    m, entries = Messages("db3"), list[Entry]()
    down = Rotation.from_euler("y", 90, degrees=True)  # its x axis points down
    entries.append(("/tf_static", T0_NS, m.tf(T0_NS, "base_link", "sonar", [0, 0, -0.1], wxyz(down))))
    for k in range(5):
        t_ns = T0_NS + k * S // 10
        entries.append(("/odom", t_ns, m.odometry(t_ns, "odom", "base_link", [0, 0, 0], FORWARD)))
        ranges = [4.5, np.inf, np.nan, 6.5, 0.01]
        entries.append(("/scan", t_ns, m.scan(t_ns, "base_link", ranges, begin_rad=-np.pi / 2, step_rad=np.pi / 3)))
        entries.append(("/sonar", t_ns, m.range(t_ns, "sonar", 3.4)))
    bag = write_bag(tmp_path, "db3", entries)
    built = mapped(bag, tmp_path / "scan.mcap", "ranges", points="/scan")
    # To the right and to the left of a nose that points east, each on the edge of two columns of voxels.
    assert {key[1] for key in keys_of(built)} == {-5, 6}
    assert {key[0] for key in keys_of(built)} <= {-1, 0}
    contents = read_bag(bag, list_bag(bag), points="/scan", pose="/odom")
    assert contents.without_place == 5
    sonar = mapped(bag, tmp_path / "sonar.mcap", "ranges", points="/sonar")
    (key,) = keys_of(sonar)
    assert key[2] == -4
    assert flown(bag, tmp_path / "again.mcap", "ranges", points="/sonar").points == 5


def layout(rng: np.random.Generator, big: bool) -> tuple[list[tuple[str, str, int]], int]:
    """Fields in any order, with gaps, of any type that holds the values."""
    names = rng.permutation(["x", "y", "z", "intensity", "doppler", "snr"])
    fields, offset = [], int(rng.integers(0, 5))
    for name in names:
        kind = str(rng.choice(["f4", "f8", "i2", "i4"]))
        fields.append((str(name), (">" if big else "<") + kind, offset))
        offset += int(kind[1]) + int(rng.integers(0, 4))
    return fields, offset + int(rng.integers(0, 8))


@pytest.mark.parametrize("seed", range(30))
def test_point_clouds_of_any_layout(seed: int) -> None:
    rng, m = np.random.default_rng(seed), Messages("mcap")
    fields, step = layout(rng, big := bool(seed % 2))
    height, width = int(rng.integers(1, 4)), int(rng.integers(1, 9))
    row = step * width + int(rng.integers(0, 9))
    values = {name: rng.integers(-99, 99, (height, width)).astype(float) for name, _, _ in fields}
    data = bytearray(rng.bytes(row * height))
    for name, kind, offset in fields:
        for v in range(height):
            for u in range(width):
                at = v * row + u * step + offset
                data[at : at + int(kind[2])] = np.array(values[name][v, u]).astype(kind).tobytes()
    types = {"i2": 3, "i4": 5, "f4": 7, "f8": 8}
    made = [m.field(name, offset, types[kind[1:]]) for name, kind, offset in fields]
    found, none = points_of(m.raw_cloud(T0_NS, "a", made, bytes(data), (height, width), step, row, big=big), CLOUD)
    assert none == 0
    np.testing.assert_array_equal(found["xyz_m"], np.column_stack([values[axis].ravel() for axis in "xyz"]))
    np.testing.assert_array_equal(found["speed_m_s"], values["doppler"].ravel())
    np.testing.assert_array_equal(found["snr_db"], values["snr"].ravel())


def test_points_without_a_place_are_left_out_and_counted() -> None:
    cloud = Messages("mcap").cloud(T0_NS, "a", {"x": [1, np.nan, 3], "y": [1, 2, np.inf], "z": [0, 0, 0]})
    found, without_place = points_of(cloud, CLOUD)
    assert (found["xyz_m"].tolist(), without_place) == ([[1.0, 1.0, 0.0]], 2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"width": 10**9}, "and has 24 bytes"),
        ({"height": 2**32 - 1, "row_step": 0}, "rows of 0 bytes|bytes"),
        ({"point_step": 0}, "0 bytes"),
        ({"point_step": 8}, "outside of its points"),
        ({"row_step": 1, "height": 2, "width": 1}, "rows of 1 bytes"),
        ({"fields": []}, "no field x"),
    ],
)
def test_clouds_that_contradict_themselves(change: dict[str, Any], words: str) -> None:
    cloud = Messages("mcap").cloud(T0_NS, "a", {"x": [1, 2], "y": [1, 2], "z": [0, 0]})
    for name, value in change.items():
        setattr(cloud, name, value)
    with pytest.raises(MalformedMessageError, match=words):
        points_of(cloud, CLOUD)


def test_a_broken_message_is_left_out_and_said(tmp_path: Path) -> None:
    entries = Flight().entries("ros1")
    number = next(k for k, entry in enumerate(entries) if entry[0] == "/points")
    entries[number][2].width = 10**9
    bag = write_bag(tmp_path, "ros1", entries)
    flight = flown(bag, tmp_path / "a.mcap")
    assert flight.clouds == 27
    assert any("1 messages contradict themselves" in note and "/points" in note for note in flight.notes)


@pytest.mark.parametrize("content", [b"", b"hello", b"#ROSBAG V2.0\n", b"SQLite format 3\x00" + bytes(90)])
def test_what_is_no_bag_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        list_bag(path)
    assert caught.value.where == "run.bag"
    assert caught.value.advice
    with pytest.raises(RecordingError, match="no such bag"):
        list_bag(tmp_path / "none.bag")


def test_what_the_decoding_process_says_is_not_believed_unseen(tmp_path: Path) -> None:
    rows = {name: np.zeros(2, kind) for name, kind in TABLES.items()}
    for name, column, value in (
        ("frames", "frame", 3),
        ("frames", "count", 3),
        ("transforms", "child", -1),
        ("places", "lat_deg", 91.0),
    ):
        for each, table in rows.items():
            changed = table.copy()
            if each == name:
                changed[column][1] = value
            changed.tofile(tmp_path / each)
        with pytest.raises(RecordingError, match="does not fit together"):
            contents_of(tmp_path, {"names": ["a"], "counts": {}, "broken": ""})


def test_own_recordings_are_no_bags(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, "mcap", Flight().entries("mcap"))
    flown(bag, tmp_path / "own.mcap")
    assert bag_kind(tmp_path / "own.mcap") is None
    assert bag_kind(bag) == "folder"
