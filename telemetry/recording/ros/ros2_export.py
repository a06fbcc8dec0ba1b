"""A recording of Hedgehop as a ROS 2 bag: poses, fixes, and what radar and camera saw, in REP 103's axes.

Frames: ``home`` (east, north, up of the first home) and ``base_link`` (forward, left, up of the vehicle).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F32, F64
from mapping.geometry.frames import LocalFrame
from mapping.sensor_frames import CloudFrame, RadarFrame
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.foxglove import enu_from_body_quaternion
from telemetry.recording.mcap_files.reader import Recording, open_recording
from telemetry.recording.ros.ros2_writer import Ros2Writer
from telemetry.recording.ros.transforms import FrameTrack, Gap
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState

HOME, BASE = "home", "base_link"
_LIBRARY = "hedgehop ros2"
_MOST_GAP_NS = 500_000_000
"""Between two attitudes; a position in a longer gap is left out."""
_Write = Callable[[Ros2Writer], None]
_Entry = tuple[int, _Write]


@dataclass(frozen=True, slots=True)
class Ros2Export:
    messages: dict[str, int]
    """Written, by topic."""
    faults: tuple[str, ...]
    """Of the recording: what was lost is not in the bag."""


def export_ros2(path: Path, out: Path) -> Ros2Export:
    """Raises RecordingError for what is no recording, or holds nothing of all this; then there is no ``out``."""
    with open_recording(path) as recording:
        states = [e.message for e in recording.entries((Topic.VEHICLE,)) if isinstance(e.message, VehicleState)]
        shift_s = recording.mono_minus_utc_s
        parts = (_poses(states, shift_s), _fixes(states, shift_s), _clouds(recording, shift_s))
        entries = heapq.merge(*parts, key=itemgetter(0))
        first = next(entries, None)
        if first is None:
            what = "It holds no poses, fixes or points: nothing to export."
            raise RecordingError(what, where=path.name, advice="Choose the recording of a flight.")
        with Ros2Writer(out, library=_LIBRARY) as writer:
            for _, write in (first, *entries):
                write(writer)
        return Ros2Export(dict(sorted(writer.counts.items())), tuple(recording.faults))


def _poses(states: list[VehicleState], shift_s: float) -> Iterator[_Entry]:
    """At each new position, with the attitude of that time."""
    attitudes, home = _attitudes(states, shift_s), next((h for h in map(_home, states) if h is not None), None)
    newest_ns = -1
    for state in states:
        if home is None or attitudes is None or state.position_t_mono_s is None:
            continue
        stamp_ns = _ns(state.position_t_mono_s - shift_s)
        p_enu_m, attitude = _place(state, home), attitudes.sample_at(stamp_ns, _MOST_GAP_NS)
        if stamp_ns > newest_ns and p_enu_m is not None and not isinstance(attitude, Gap):
            newest_ns = stamp_ns
            yield stamp_ns, _pose_writer(stamp_ns, p_enu_m, attitude[1])


def _pose_writer(stamp_ns: int, p_enu_m: F64, q_wxyz: F64) -> _Write:
    def write(writer: Ros2Writer) -> None:
        writer.odometry("/odom", stamp_ns, HOME, BASE, p_enu_m, q_wxyz)
        writer.transform(stamp_ns, HOME, BASE, p_enu_m, q_wxyz)

    return write


def _attitudes(states: list[VehicleState], shift_s: float) -> FrameTrack | None:
    found: dict[int, tuple[float, float, float, float]] = {}
    for state in states:
        roll, pitch, heading = state.roll_rad, state.pitch_rad, state.heading_rad
        if state.attitude_t_mono_s is None or roll is None or pitch is None or heading is None:
            continue
        x, y, z, w = enu_from_body_quaternion(roll, pitch, heading)
        found[_ns(state.attitude_t_mono_s - shift_s)] = (w, x, y, z)
    stamps = np.array(sorted(found), np.int64)
    turns = np.array([found[stamp] for stamp in stamps.tolist()], np.float64)
    return FrameTrack(HOME, BASE, stamps, np.zeros((len(stamps), 3)), turns) if found else None


def _home(state: VehicleState) -> tuple[float, float, float] | None:
    home = (state.home_lat_deg, state.home_lon_deg, state.home_alt_amsl_m)
    return None if None in home else home  # pyright: ignore[reportReturnType]


def _place(state: VehicleState, home: tuple[float, float, float]) -> F64 | None:
    """(3,) east, north, up of the first home."""
    lat_deg, lon_deg, up_m, home_alt_m = state.lat_deg, state.lon_deg, state.alt_rel_home_m, state.home_alt_amsl_m
    if lat_deg is None or lon_deg is None or up_m is None or home_alt_m is None:
        return None
    east, north, _ = LocalFrame(*home).to_enu(lat_deg, lon_deg, home[2])[0].tolist()
    return np.array([east, north, up_m + home_alt_m - home[2]])


def _fixes(states: list[VehicleState], shift_s: float) -> Iterator[_Entry]:
    newest_ns = -1
    for state in states:
        if state.position_t_mono_s is None or state.lat_deg is None or state.lon_deg is None:
            continue
        stamp_ns = _ns(state.position_t_mono_s - shift_s)
        if stamp_ns > newest_ns:
            newest_ns = stamp_ns
            alt_m = math.nan if state.gnss_alt_ellipsoid_m is None else state.gnss_alt_ellipsoid_m
            yield stamp_ns, _fix_writer(stamp_ns, (state.lat_deg, state.lon_deg, alt_m), state.gnss_fix)


def _fix_writer(stamp_ns: int, place: tuple[float, float, float], fix: str) -> _Write:
    has_fix = fix not in ("no_fix", "2d")
    return lambda writer: writer.fix("/fix", stamp_ns, BASE, place, has_fix=has_fix)


def _clouds(recording: Recording, shift_s: float) -> Iterator[_Entry]:
    for entry in recording.entries((Topic.RADAR_FRAME, Topic.CLOUD_FRAME)):
        frame = entry.message
        if not isinstance(frame, RadarFrame | CloudFrame) or not frame.is_whole:
            continue
        stamp_ns = _ns(frame.t_mono_s - shift_s)
        if isinstance(frame, CloudFrame):
            yield stamp_ns, _cloud_writer("/camera/points", stamp_ns, _axes(frame.points_m))
        else:
            xyz_m, speed_m_s, snr_db = frame.columns()
            columns = _axes(xyz_m) | {"radial_speed_m_s": speed_m_s, "snr_db": snr_db}
            yield stamp_ns, _cloud_writer("/radar/points", stamp_ns, columns)


def _axes(xyz_m: F32) -> dict[str, F32]:
    """Right, forward, up -> forward, left, up."""
    return {"x": xyz_m[:, 1], "y": -xyz_m[:, 0], "z": xyz_m[:, 2]}


def _cloud_writer(topic: str, stamp_ns: int, columns: dict[str, F32]) -> _Write:
    return lambda writer: writer.cloud(topic, stamp_ns, BASE, columns)


def _ns(t_utc_s: float) -> int:
    return max(0, round(t_utc_s * 1e9))
