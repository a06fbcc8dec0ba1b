"""A bag's clouds and poses as a recording of Hedgehop, from which its maps are made as those of its own flights."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mapping.geometry import quaternions
from mapping.geometry.frames import LocalFrame, attitude_of
from mapping.sensor_frames import CloudFrame, RadarFrame, RangeFrame, SensorFrame, SlamPose, packed, thinned
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.recorded_flight import state_at
from telemetry.recording.ros.bag import BagContents, BagTable, Progress, read_bag
from telemetry.recording.ros.bag_types import BAG_POINT_TYPES, POSE_TYPES, TF_TYPES
from telemetry.recording.ros.placing import MOST_GAP_S, PlacedBag, PlacedCloud, PlacedPose, placed
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import PerceptionSettings, Sensor
from telemetry.topics.vehicle import VehicleState

MOST_RADAR_TARGETS = 2000
"""Of one cloud; more are no radar's."""
WIDEST = PerceptionSettings(
    radar_variant="full_attitude", radar_azimuth_deg=90.0, radar_low_deg=-80.0, radar_high_deg=80.0
)
"""Of a radar that nobody knows: the gate is as wide as there are."""
_SOURCE = "bag"
_THINNED_M = 0.001
"""Of clouds that are mapped as a camera's: so every point counts, since nobody knows how often its sensor is wrong."""
_REACHES = {"radar": "1.5 to 125 m from it", "vision": "0.3 to 40 m from it", "ranges": "0.1 to 120 m from it"}
"""Of each sensor's map."""
_NOWHERE = LocalFrame(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class BagAsked:
    """What of a bag is to be mapped, and how."""

    points: str
    pose: str | None = None
    """None: the only topic of poses that there is, else the transforms."""
    base: str | None = None
    most_gap_s: float = MOST_GAP_S
    home_alt_amsl_m: float | None = None
    """Height above sea level of the first pose; a NavSatFix tells only that above the ellipsoid."""
    home_lat_lon_deg: tuple[float, float] | None = None
    """Of the first pose, where it is known; it counts before a NavSatFix."""


@dataclass(frozen=True, slots=True)
class BagFlight:
    notes: tuple[str, ...]
    clouds: int
    left_out: int
    points: int
    is_on_earth: bool
    """Whether it is known where on Earth, and how high above the sea, the map lies."""


def write_bag_flight(
    path: Path,
    table: BagTable,
    asked: BagAsked,
    sensor: Sensor,
    out: Path,
    *,
    name: str = "",
    progress: Progress | None = None,
) -> BagFlight:
    """The bag as a recording ``out``, which calls itself ``name``, else as its file.

    Raises RecordingError: what is missing, and what there is instead.
    """
    if not (math.isfinite(asked.most_gap_s) and asked.most_gap_s > 0.0):
        raise RecordingError(f"A gap of {asked.most_gap_s:g} s is none.", where="--max-gap-s", advice="Try 0.5.")
    _check_topic(table, asked.points, BAG_POINT_TYPES, "points", path.name)
    pose = _pose_topic(table, asked.pose, path.name)
    contents = read_bag(path, table, points=asked.points, pose=pose, progress=progress)
    try:
        bag = placed(
            contents,
            base=asked.base,
            from_transforms=any(t.name == pose and t.type in TF_TYPES for t in table.topics),
            most_gap_s=asked.most_gap_s,
        )
        _check_radar(bag, sensor)
        home = _home(contents, bag, asked)
    except RecordingError as error:
        raise RecordingError(error.what, where=error.where or path.name, advice=error.advice) from error
    return _write(bag, home, sensor, out, name or out.stem, is_on_earth=home != _NOWHERE, fault=table.fault)


def _check_topic(table: BagTable, name: str, types: frozenset[str], what: str, where: str) -> None:
    if any(topic.name == name and topic.type in types for topic in table.topics):
        return
    found = next((topic for topic in table.topics if topic.name == name), None)
    is_what = f"is of {found.type}, which holds no {what}" if found else "is not in the bag"
    raise RecordingError(f"The topic {name} {is_what}.", where=where, advice=_of_right_types(table, types, what))


def _of_right_types(table: BagTable, types: frozenset[str], what: str) -> str:
    right = [f"{topic.name} ({topic.type.rpartition('/')[2]}, {topic.count:,})" for topic in table.of_types(types)]
    return f"Topics with {what}: {', '.join(right[:20])}." if right else f"It holds no topic with {what} at all."


def _pose_topic(table: BagTable, asked: str | None, where: str) -> str:
    types = POSE_TYPES | TF_TYPES
    if asked is not None:
        _check_topic(table, asked, types, "poses", where)
        return asked
    told = [topic.name for topic in table.of_types(POSE_TYPES)]
    moving = [topic.name for topic in table.of_types(TF_TYPES) if not topic.name.endswith("tf_static")]
    chosen = told if told else moving
    if len(chosen) != 1:
        what = "Several topics tell poses: one must be chosen." if chosen else "It holds no poses."
        raise RecordingError(what, where=where, advice=f"Give --pose. {_of_right_types(table, types, 'poses')}")
    return chosen[0]


def _check_radar(bag: PlacedBag, sensor: Sensor) -> None:
    most = max(len(cloud.xyz_m) for cloud in bag.clouds)
    if sensor == "radar" and most > MOST_RADAR_TARGETS:
        what = f"A cloud has {most:,} points, more than the {MOST_RADAR_TARGETS:,} targets of a radar."
        raise RecordingError(what, advice="Map it with --sensor vision, as dense clouds are.")


def _home(contents: BagContents, bag: PlacedBag, asked: BagAsked) -> LocalFrame:
    """As declared, else by the NavSatFix nearest to the first pose; without either, or without its height, nowhere.

    Raises RecordingError where it is of another time.
    """
    if asked.home_alt_amsl_m is None:
        return _NOWHERE
    if asked.home_lat_lon_deg is not None:
        return LocalFrame(*asked.home_lat_lon_deg, asked.home_alt_amsl_m)
    if not len(contents.places):
        return _NOWHERE
    apart_s = np.abs(contents.places["stamp_ns"] - bag.origin_ns) / 1e9
    nearest = int(np.argmin(apart_s))
    if apart_s[nearest] > asked.most_gap_s:
        what = f"The NavSatFix nearest to the first pose is {apart_s[nearest]:,.3f} s away from it."
        advice = f"At most {asked.most_gap_s:g} s are bridged; --max-gap-s bridges more, and without --home-alt-amsl-m"
        raise RecordingError(what, advice=f"{advice} no fix is needed.")
    place = contents.places[nearest]
    return LocalFrame(float(place["lat_deg"]), float(place["lon_deg"]), asked.home_alt_amsl_m)


def _write(
    bag: PlacedBag,
    home: LocalFrame,
    sensor: Sensor,
    out: Path,
    name: str,
    *,
    is_on_earth: bool,
    fault: str,
) -> BagFlight:
    start_ns = bag.clouds[0].stamp_ns
    bare = any(np.isnan(cloud.speed_m_s).any() or np.isnan(cloud.snr_db).any() for cloud in bag.clouds)
    settings = replace(WIDEST, paper_bare=bare)
    writer = RecordingWriter(out, t_utc_s=start_ns / 1e9, t_mono_s=start_ns / 1e9, name=name, now=lambda: 0.0)
    writer.write(Topic.PERCEPTION_SETTINGS, settings, start_ns / 1e9)
    for number, cloud in enumerate(bag.clouds):
        t_s = cloud.stamp_ns / 1e9
        writer.write(Topic.VEHICLE, _state(cloud.pose, home), t_s)
        if sensor == "vision":
            writer.write(Topic.SLAM_POSE, _camera(cloud.pose), t_s)
        topic, message = _frame(cloud, number, sensor)
        writer.write(topic, message, t_s)
    writer.close()
    notes = [*bag.notes, *_notes_of(bag, sensor, bare=bare, fault=fault)]
    return BagFlight(tuple(notes), len(bag.clouds), bag.left_out, sum(len(c.xyz_m) for c in bag.clouds), is_on_earth)


def _notes_of(bag: PlacedBag, sensor: Sensor, *, bare: bool, fault: str) -> Iterator[str]:
    if fault:
        yield f"The bag is damaged; what comes after the damage is not in the map ({fault})."
    if sensor == "radar" and bare:
        yield "The points tell no radial speed or no strength in dB: each of them counts as it is."
    ahead = "ahead of" if sensor == "radar" else "around"
    yield f"A {sensor} map takes what is {ahead} {bag.base}, {_REACHES[sensor]}; points elsewhere are left out."


def _state(pose: PlacedPose, home: LocalFrame) -> VehicleState:
    return state_at(pose.stamp_ns / 1e9, pose.p_enu_m, pose.v_enu_m_s, pose.R_enu_body, home)


def _camera(pose: PlacedPose) -> SlamPose:
    east, north, up = pose.p_enu_m.tolist()
    w, x, y, z = quaternions.from_attitude(*attitude_of(pose.R_enu_body)).tolist()
    return SlamPose(pose.stamp_ns / 1e9, (east, north, up), (w, x, y, z))


def _frame(cloud: PlacedCloud, number: int, sensor: Sensor) -> tuple[Topic, SensorFrame]:
    t_s = cloud.stamp_ns / 1e9
    if sensor == "vision":
        xyz_m = thinned(cloud.xyz_m.astype(np.float32), _THINNED_M)
        return Topic.CLOUD_FRAME, CloudFrame(t_s, t_s, number, _SOURCE, packed(xyz_m), _THINNED_M)
    if sensor == "ranges":
        return Topic.RANGE_FRAME, _ranges(cloud, number)
    speed, snr = np.nan_to_num(cloud.speed_m_s), np.nan_to_num(cloud.snr_db)
    frame = RadarFrame.of(cloud.xyz_m, speed, snr, t_mono_s=t_s, t_utc_s=t_s, number=number, source=_SOURCE)
    return Topic.RADAR_FRAME, frame


def _ranges(cloud: PlacedCloud, number: int) -> RangeFrame:
    """Directions count from the horizontal plane and the nose's bearing, whatever the robot's attitude."""
    heading_rad, _, _ = attitude_of(cloud.pose.R_enu_body)
    east, north, up = (cloud.xyz_m @ cloud.pose.R_enu_body.T).T
    bearing_rad = np.arctan2(east, north) - heading_rad
    t_s = cloud.stamp_ns / 1e9
    return RangeFrame(
        t_s, t_s, number, _SOURCE,
        bearing_rad=tuple(np.remainder(bearing_rad, 2 * math.pi).tolist()),
        elevation_rad=tuple(np.arctan2(up, np.hypot(east, north)).tolist()),
        range_m=tuple(np.linalg.norm(cloud.xyz_m, axis=1).tolist()),
    )  # fmt: skip
