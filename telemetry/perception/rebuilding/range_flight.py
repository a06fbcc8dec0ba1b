"""A vehicle's own log, or a ground station's, as a recording of its distance sensors, from which their map is made.

Directions of sensors that are fixed to the body turn with its attitude. Poses are interpolated between the log's own
times as those of live frames are; a measurement without a pose of its time is left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mapping.geometry.frames import LocalFrame
from mapping.geometry.poses import Missing, Pose, PoseTrack, TrackParams
from mapping.geometry.quaternions import from_attitude
from mapping.sensor_frames import RangeFrame
from telemetry.errors import RecordingError
from telemetry.mavlink.ranges import Scan, from_nose
from telemetry.perception.convert import frame_of
from telemetry.perception.rebuilding.log_readers import LogKind, RangeLog, read_range_log
from telemetry.perception.whereabouts import has_fix, home_of, velocity_enu_m_s
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.recorded_flight import state_at
from telemetry.recording.vehicle_logs.logged_ranges import Measured, in_time
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.vehicle import VehicleState

_SOURCE = "log"


class _Records(NamedTuple):
    """What tells it in a log."""

    position: str
    attitude: str
    ranges: str


_NEEDED: dict[LogKind, _Records] = {
    "dataflash": _Records("POS or AHR2", "ATT, XKF1 or AHR2", "RFND, PRX or PRXR"),
    "ulog": _Records(
        "vehicle_global_position or vehicle_local_position", "vehicle_attitude", "distance_sensor or obstacle_distance"
    ),
    "tlog": _Records("GLOBAL_POSITION_INT", "ATTITUDE", "DISTANCE_SENSOR or OBSTACLE_DISTANCE"),
}
_LOG_MORE = "Log it as well (LOG_BITMASK, SDLOG_PROFILE, or the stream's rate), or choose another log."


@dataclass(frozen=True, slots=True)
class RangeFlight:
    notes: tuple[str, ...]
    frames: int
    left_out: int
    """Measurements at whose time nobody knows where the vehicle was, or how it lay."""


def write_range_flight(
    path: Path, out: Path, kind: LogKind, *, progress: Callable[[float], None] = lambda share: None
) -> RangeFlight:
    """The log as a recording ``out``. Raises RecordingError: what is missing in the log."""
    log = read_range_log(path, kind)
    if not log.ranges.measured:
        what = " ".join([f"It holds no distance that could be mapped ({_NEEDED[kind].ranges}).", *_said(log)])
        raise RecordingError(what, where=path.name, advice="Choose the log of a vehicle that has distance sensors.")
    _check_poses(log.states, kind, path.name)
    origin, about_origin = _origin(log.states)
    poses, left_out = _Poses(log.states, origin), Counter[str]()
    moments, frames = in_time(log.ranges.measured), 0
    start_s = moments[0][0].t_s
    writer = RecordingWriter(out, t_utc_s=start_s, t_mono_s=start_s, name=path.stem, now=lambda: 0.0)
    for number, moment in enumerate(moments):
        t_s = moment[0].t_s
        pose = poses.at(t_s)
        if isinstance(pose, Pose):
            state = state_at(t_s, pose.position_enu_m, pose.velocity_enu_m_s, pose.rotation_enu_body, poses.frame)
            writer.write(Topic.VEHICLE, state, t_s)
            writer.write(Topic.RANGE_FRAME, frame_at(moment, pose, frames), t_s)
            frames += 1
        else:
            left_out[pose] += len(moment)
        if number % 1000 == 0:
            progress(number / len(moments))
    writer.close()
    if not frames:
        raise _nowhere(left_out, poses.refused, path.name)
    lost = [f"{count:,} measurements were left out: {why}." for why, count in left_out.most_common()]
    lost += [f"{count:,} positions were not believed: {why}." for why, count in poses.refused.most_common()]
    return RangeFlight((*_said(log), about_origin, *lost), frames, sum(left_out.values()))


def frame_at(moment: Sequence[Measured], pose: Pose, number: int) -> RangeFrame:
    """What was measured at one time, in directions from the nose and the horizontal plane.

    It tells no directions in which nothing was hit: nothing is called clear by it.
    """
    beams = [beam for each in moment for beam in _levelled(each.scan, pose)]
    bearing, elevation, range_m = zip(*beams, strict=True) if beams else ((), (), ())
    t_s = moment[0].t_s
    return RangeFrame(t_s, t_s, number, _SOURCE, bearing, elevation, range_m)


def _levelled(scan: Scan, pose: Pose) -> list[tuple[float, float, float]]:
    if scan.axes != "body":
        level = from_nose(scan, pose.heading_rad)
        return [] if level is None else level.beams
    if not scan.beams:
        return []
    bearing, elevation, range_m = np.array(scan.beams).T
    level_part = np.cos(elevation)
    body = np.stack([level_part * np.sin(bearing), level_part * np.cos(bearing), np.sin(elevation)])
    east, north, up = pose.rotation_enu_body @ body
    turned = (np.arctan2(east, north) - pose.heading_rad) % math.tau
    raised = np.arctan2(up, np.hypot(east, north))
    return list(zip(turned.tolist(), raised.tolist(), range_m.tolist(), strict=True))


class _Poses:
    """Where the vehicle was at any time, asked for in the order of time."""

    def __init__(self, states: Iterable[VehicleState], origin: MapOrigin) -> None:
        self.frame: LocalFrame = frame_of(origin)
        self.refused = Counter[str]()
        """Positions, by why."""
        self._states, self._track = iter(states), PoseTrack()
        self._read_until_s = -math.inf
        self._position_t_s: float | None = None

    def at(self, t_s: float) -> Pose | Missing:
        while self._read_until_s <= t_s + TrackParams().longest_gap_s:
            state = next(self._states, None)
            if state is None:
                break
            self._read_until_s = state.t_utc_s
            self._take(state)
        return self._track.at(t_s)

    def _take(self, state: VehicleState) -> None:
        t_s, heading, pitch, roll = state.attitude_t_mono_s, state.heading_rad, state.pitch_rad, state.roll_rad
        if t_s is not None and heading is not None and pitch is not None and roll is not None:
            self._track.add_attitude(t_s, from_attitude(heading, pitch, roll))
        t_s, place = state.position_t_mono_s, _place_of(state)
        if t_s is None or t_s == self._position_t_s or place is None:
            return
        self._position_t_s = t_s
        p_enu_m = self.frame.to_enu(place.lat_deg, place.lon_deg, place.alt_amsl_m)[0]
        why = self._track.add_position(t_s, p_enu_m, velocity_enu_m_s(state)) if has_fix(state) else "no fix"
        if why is not None:
            self.refused[why] += 1


def _origin(states: Sequence[VehicleState]) -> tuple[MapOrigin, str]:
    """Home as it was last while armed, else as it was last, else the first position."""
    for chosen in (True, False):
        for state in reversed(states):
            home = home_of(state) if state.armed or not chosen else None
            if home is not None:
                return home, f"The map counts from home: {_words(home)}."
    first = next(place for state in states if (place := _place_of(state)) is not None)
    return first, f"The log tells no home: the map counts from the first position, {_words(first)}."


def _words(origin: MapOrigin) -> str:
    where = f"{origin.lat_deg:.7f}°, {origin.lon_deg:.7f}°, {origin.alt_amsl_m:.2f} m above sea level"
    return f"{where} as the autopilot has it"


def _place_of(state: VehicleState) -> MapOrigin | None:
    if state.lat_deg is None or state.lon_deg is None or state.alt_amsl_m is None:
        return None
    return MapOrigin(state.lat_deg, state.lon_deg, state.alt_amsl_m)


def _check_poses(states: Sequence[VehicleState], kind: LogKind, where: str) -> None:
    needed = _NEEDED[kind]
    if all(_place_of(state) is None for state in states):
        what = f"It tells no position with a height above sea level ({needed.position}): its sensors were nowhere."
        raise RecordingError(what, where=where, advice=_LOG_MORE)
    if not any(state.heading_rad is not None and state.attitude_t_mono_s is not None for state in states):
        what = f"It tells no attitude ({needed.attitude}): nobody knows which way its sensors looked."
        raise RecordingError(what, where=where, advice=_LOG_MORE)


def _nowhere(left_out: Counter[str], refused: Counter[str], where: str) -> RecordingError:
    reasons = [f"{count:,}: {why}" for why, count in left_out.most_common()]
    reasons += [f"{count:,} positions: {why}" for why, count in refused.most_common()]
    what = f"No measurement could be placed ({'; '.join(reasons)})."
    longest_s = TrackParams().longest_gap_s
    advice = f"Positions and attitudes must be logged at least every {longest_s:g} s while distances are measured."
    return RecordingError(what, where=where, advice=advice)


def _said(log: RangeLog) -> list[str]:
    return [*log.ranges.sentences(), *log.faults]
