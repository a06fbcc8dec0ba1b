"""A recording's map, made once more from its frames and poses: exactly the one that was there in flight, or another.

Frames are worked on in the order in which the node worked on them, each with what the node knew by then: its status
after each frame tells (``telemetry.topics.obstacles.Basis``). Where no node ran, every frame is worked on as it came.
``OtherMap`` asks for another resolution or memory limit than in flight.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from mapping.perceiving.ground import GroundGrid
from mapping.perceiving.settings_limits import COARSEST_CLOUD, check_gate, check_thinning
from mapping.radar.targets import Variant
from mapping.sensor_frames import SensorFrame, SlamPose
from mapping.voxels.checks import checked_size
from mapping.voxels.map import VoxelMap
from planning.terrain.dsm import Dsm
from telemetry.errors import RecordingError
from telemetry.perception.inbox import HOLD_S
from telemetry.perception.known_ground import GroundError, ground_around, why_none
from telemetry.perception.map_changes import ChangeTeller
from telemetry.perception.perceiver import GroundWanted, Perceiver
from telemetry.perception.sensor_kinds import AnyPerception, SensorKind
from telemetry.perception.status import full_text
from telemetry.recording.carried_ground import carried_ground
from telemetry.recording.mcap_files.reader import Entry, Recording, open_recording
from telemetry.topics.deltas import FoldedMap
from telemetry.topics.messages import FlightStatus, PlanRecord, Published, Topic
from telemetry.topics.obstacles import Basis, GroundNotice, PerceptionSettings, PerceptionStatus
from telemetry.topics.vehicle import VehicleState

_PATIENCE_S = 5.0
"""A frame of which no status has told by then was not worked on."""
_PLACING = {
    "home": "home_lat_deg",
    "position": "lat_deg",
    "time of the position": "position_t_mono_s",
    "attitude": "attitude_t_mono_s",
}
"""Fields of ``VehicleState`` without which no frame has a place."""
_RECORD_BOTH = "Record the sensor together with the vehicle's link, in one recording."


@dataclass(frozen=True, slots=True)
class OtherMap:
    """None: as it was in flight."""

    resolution_m: float | None = None
    memory_limit_bytes: int | None = None
    radar_variant: Variant | None = None
    radar_azimuth_deg: float | None = None
    radar_low_deg: float | None = None
    radar_high_deg: float | None = None
    cloud_voxel_m: float | None = None
    whole_flight: bool = False
    """Of the camera: all that it saw, not its last frame alone."""

    def applied(self, settings: PerceptionSettings) -> PerceptionSettings:
        other = {name: value for name in _TAKEN_AS_IS if (value := getattr(self, name)) is not None}
        settings = replace(settings, **other)
        if self.resolution_m is None:
            return settings
        # Nothing is searched for the map's sake: what is fine and large needs no fine and large region.
        small_m = self.resolution_m
        if self.cloud_voxel_m is None:
            settings = replace(settings, cloud_voxel_m=min(settings.cloud_voxel_m, COARSEST_CLOUD * small_m))
        return replace(
            settings,
            radar_resolution_m=small_m,
            vision_resolution_m=small_m,
            radar_depth_m=small_m,
            vision_depth_m=small_m,
            ranges_depth_m=small_m,
            height_m=small_m,
        )


_TAKEN_AS_IS = (
    "memory_limit_bytes",
    "radar_variant",
    "radar_azimuth_deg",
    "radar_low_deg",
    "radar_high_deg",
    "cloud_voxel_m",
)
AS_IN_FLIGHT = OtherMap()


@dataclass(frozen=True, slots=True)
class Rebuilt:
    folded: FoldedMap
    """The map at the recording's end."""
    frames: int
    """That went into the map, since it last began afresh."""
    dropped: int
    """Frames that were recorded since then but did not."""
    points: int
    """Of all frames, after the gates."""
    voxels_occupied: int
    extent_m: tuple[float, float, float]
    """East, north, up of all occupied voxels."""
    resolution_m: float
    left_out: int
    """Updates that found no room in the memory."""
    notes: tuple[str, ...]


def rebuild(
    path: Path,
    kind: SensorKind,
    *,
    other: OtherMap = AS_IN_FLIGHT,
    progress: Callable[[float], None] | None = None,
) -> Rebuilt:
    """Raises RecordingError for what is no recording, holds no frame of that sensor, or nothing to place them by.

    Raises ParameterError or CapacityError for another map that cannot be.
    """
    _check(kind, other.applied(PerceptionSettings()))
    with open_recording(path) as recording:
        if kind.frames not in recording.topics():
            what = f"The recording holds no frames of the {kind.sensor}."
            raise RecordingError(what, where=path.name, advice="Choose another sensor, or another recording.")
        _check_poses(recording, kind)
        has_bases = _has_bases(recording, kind)
        run = _Run(
            kind,
            other,
            has_bases=has_bases,
            mono_minus_utc_s=recording.mono_minus_utc_s,
            carried=carried_ground(recording),
        )
        span_s = max(recording.end_utc_s - recording.start_utc_s, 1e-9)
        for entry in recording.entries(run.topics):
            run.take(entry)
            if progress is not None:
                progress((entry.t_utc_s - recording.start_utc_s) / span_s)
        built = run.finished()
    if built.frames == 0 and not kind.uses_camera and run.untold:
        what = f"No frame of the {kind.sensor} could be placed: {Topic.VEHICLE} never tells the {_listed(run.untold)}."
        raise RecordingError(what, where=path.name, advice=_RECORD_BOTH)
    return built


class _Run:
    """Frames, states and camera poses wait until the status of a frame says which of them it was made with."""

    def __init__(
        self, kind: SensorKind, other: OtherMap, *, has_bases: bool, mono_minus_utc_s: float, carried: Dsm | None
    ) -> None:
        self._kind, self._other, self._carried = kind, other, carried
        self._has_bases, self._mono_minus_utc_s = has_bases, mono_minus_utc_s
        self.topics = {kind.frames, kind.status, Topic.VEHICLE, Topic.SLAM_POSE, Topic.PLAN, Topic.FLIGHT}
        self.topics |= {Topic.PERCEPTION_SETTINGS, Topic.GROUND}
        self._frames: deque[tuple[float, SensorFrame]] = deque()
        self._states: deque[VehicleState] = deque()
        self._cameras: deque[SlamPose] = deque()
        self._bases: deque[tuple[float, Basis]] = deque()
        self._newest_state_s = self._newest_camera_s = 0.0
        self._settled: dict[type[Published], Published] = {}
        self._run = ""
        self._perceiver = self._new_perceiver()
        self._asked = GroundWanted(None, None)
        self._ground: GroundGrid | None = None
        self._begun = self._frames_seen = self._points = 0
        self._notes: dict[str, None] = {}
        self.untold = list(_PLACING)
        """Of what places a frame: what no state of the vehicle has told."""

    def take(self, entry: Entry) -> None:
        message, t_mono_s = entry.message, entry.t_utc_s + self._mono_minus_utc_s
        if isinstance(message, VehicleState):
            self._states.append(message)
            self.untold = [what for what in self.untold if getattr(message, _PLACING[what]) is None]
            self._newest_state_s = max(self._newest_state_s, message.t_utc_s)
        elif isinstance(message, SlamPose):
            self._cameras.append(message)
            self._newest_camera_s = max(self._newest_camera_s, message.t_mono_s)
        elif isinstance(message, SensorFrame):
            self._frames.append((t_mono_s, message))
        elif isinstance(message, PerceptionStatus):
            if message.basis is not None:
                self._bases.append((message.t_mono_s, message.basis))
        else:
            self._settled[type(message)] = message
            self._settle(message)
        self._go_on(t_mono_s)

    def _go_on(self, now_s: float) -> None:
        if not self._has_bases:
            self._work_as_they_came(now_s)
        while self._bases and self._is_complete(*self._bases[0], now_s):
            self._on_basis(*self._bases.popleft())

    def _is_complete(self, t_mono_s: float, basis: Basis, now_s: float) -> bool:
        """Whether all that the frame was worked on with has been read: its status comes from another process."""
        if now_s > basis.taken_t_mono_s + _PATIENCE_S:
            return True
        known = self._newest_state_s >= basis.vehicle_t_utc_s and self._newest_camera_s >= basis.camera_t_mono_s
        return known and any(frame.t_mono_s == t_mono_s for _, frame in self._frames)

    def finished(self) -> Rebuilt:
        self._go_on(math.inf)
        self._frames_seen += len(self._frames)
        perception, where = self._perceiver.perception, self._perceiver.where
        teller = ChangeTeller(self._kind.sensor, -self._mono_minus_utc_s)
        the_map = self._map_of(perception)
        folded = FoldedMap().folded(teller.changes(the_map, where.origin, 0.0))
        if the_map.is_full:
            self._notes[full_text(the_map)] = None
        return Rebuilt(
            folded=folded,
            frames=perception.frames,
            dropped=max(0, self._frames_seen - perception.frames),
            points=self._points,
            voxels_occupied=the_map.occupied_count,
            extent_m=_extent_m(folded),
            resolution_m=the_map.resolution_m,
            left_out=the_map.refused_updates,
            notes=tuple(self._notes),
        )

    def _map_of(self, perception: AnyPerception) -> VoxelMap:
        flight = perception.flight
        if not self._other.whole_flight or flight is None:
            return perception.map
        if flight.part > 1:
            self._notes[f"{flight.why}: this is part {flight.part} of the flight. Review shows the ones before it."] = (
                None
            )
        return flight.map

    def _settle(self, message: Published) -> None:
        if isinstance(message, PerceptionSettings):
            self._perceiver.on_settings(self._wanted(message))
        elif isinstance(message, GroundNotice):
            self._perceiver.on_ground(message)
        elif isinstance(message, PlanRecord) and self._other.resolution_m is None:
            self._perceiver.on_plan(message)
        elif isinstance(message, FlightStatus):
            self._perceiver.flown.flight = message

    def _wanted(self, settings: PerceptionSettings) -> PerceptionSettings:
        wanted = self._other.applied(settings)
        if wanted != settings:
            _check(self._kind, wanted)
        return wanted

    def _new_perceiver(self, run: str = "") -> Perceiver:
        perceiver = Perceiver(self._kind, run=run, utc_minus_mono_s=-self._mono_minus_utc_s)
        perceiver.on_settings(self._other.applied(PerceptionSettings()))
        return perceiver

    def _on_basis(self, t_mono_s: float, basis: Basis) -> None:
        """The frame of that time, with what was known when it was worked on."""
        if basis.run != self._run:
            self._start_again(basis.run)
        while self._states and self._states[0].t_utc_s <= basis.vehicle_t_utc_s:
            self._perceiver.on_state(self._states.popleft())
        while self._cameras and self._cameras[0].t_mono_s <= basis.camera_t_mono_s:
            self._perceiver.on_camera(self._cameras.popleft())
        found = next((number for number, (_, f) in enumerate(self._frames) if f.t_mono_s == t_mono_s), None)
        if found is not None:
            _, frame = self._frames[found]
            del self._frames[found]
            self._work(frame, basis.taken_t_mono_s, ground=basis.ground)
        while self._frames and self._frames[0][0] < basis.taken_t_mono_s - 2.0 * _PATIENCE_S:
            self._frames.popleft()
            self._frames_seen += 1

    def _work_as_they_came(self, now_s: float) -> None:
        """What the node would have done: each frame as soon as poses are known up to its time."""
        while self._states:
            self._perceiver.on_state(self._states.popleft())
        while self._cameras:
            self._perceiver.on_camera(self._cameras.popleft())
        while self._frames:
            came_s, frame = self._frames[0]
            if not frame.t_mono_s <= self._perceiver.pose_t_mono_s and now_s < came_s + HOLD_S:
                return
            self._frames.popleft()
            self._work(frame, came_s, ground=True)

    def _work(self, frame: SensorFrame, now_s: float, *, ground: bool) -> None:
        self._perceiver.feed()
        if self._perceiver.begun != self._begun:
            self._begun, self._frames_seen, self._points = self._perceiver.begun, 0, 0
        self._lay_ground(wanted=ground)
        outcome = self._perceiver.work(frame, lambda: now_s)
        self._perceiver.perception.accumulate()
        self._frames_seen += 1
        self._points += outcome.status.points if outcome.accepted else 0

    def _lay_ground(self, *, wanted: bool) -> None:
        asked = self._perceiver.ground_wanted
        if asked != self._asked:
            self._asked, self._ground = asked, self._loaded(asked)
        self._perceiver.set_ground(self._ground if wanted else None)
        if wanted and self._has_bases and self._ground is None:
            self._notes["In flight known ground was told from obstacles; its surface model is not there any more."] = (
                None
            )

    def _loaded(self, asked: GroundWanted) -> GroundGrid | None:
        if asked.notice is None or asked.origin is None:
            return None
        is_carried = self._carried is not None and self._carried.sha256 == asked.notice.sha256
        heights_m = self._carried.elevation_m if is_carried and self._carried is not None else None
        try:
            return ground_around(asked.notice, asked.origin, heights_m)
        except GroundError as error:
            self._notes[why_none(error)] = None
            return None

    def _start_again(self, run: str) -> None:
        """The node was started: its first frame, or one after it had died."""
        self._run = run
        self._perceiver = self._new_perceiver(run)
        self._begun = self._frames_seen = self._points = 0
        for message in self._settled.values():
            self._settle(message)


def _check(kind: SensorKind, wanted: PerceptionSettings) -> None:
    settings = kind.settings(wanted)
    checked_size(settings.resolution_m, kind.reach_m, settings.memory_limit_bytes)
    check_gate(settings)
    check_thinning(settings)


def _check_poses(recording: Recording, kind: SensorKind) -> None:
    needed, who = (Topic.SLAM_POSE, "the camera") if kind.uses_camera else (Topic.VEHICLE, "the vehicle")
    if needed in recording.topics():
        return
    what = f"Nothing says where {who} was: there are frames ({kind.frames}), but no {needed}."
    raise RecordingError(what, where=recording.name, advice=_RECORD_BOTH)


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _has_bases(recording: Recording, kind: SensorKind) -> bool:
    for entries in recording.backwards(kind.status, recording.end_utc_s):
        if any(isinstance(e.message, PerceptionStatus) and e.message.basis is not None for e in entries):
            return True
    return False


def _extent_m(folded: FoldedMap) -> tuple[float, float, float]:
    keys = folded.voxels.occupied().keys
    if folded.last is None or len(keys) == 0:
        return 0.0, 0.0, 0.0
    size = (keys.max(axis=0).astype(int) - keys.min(axis=0) + 1) * folded.last.resolution_m
    return float(size[0]), float(size[1]), float(size[2])
