"""What the perception of every sensor does the same way: which frames are taken, what is searched, what is told."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64, Bools
from mapping.geometry.poses import Pose, PoseTrack
from mapping.perceiving.alerts import AlertBook
from mapping.perceiving.corridor import MissionLine, length_m, tube_points
from mapping.perceiving.flight_map import FlightMap
from mapping.perceiving.frame_result import FrameResult, SearchedRegion, Settings, State
from mapping.perceiving.ground import GroundGrid
from mapping.perceiving.obstacles import Found, obstacles, sweep
from mapping.perceiving.remembered import Field, Remembered, Way
from mapping.perceiving.roi import search_sector, sector_points, to_enu
from mapping.sensor_frames import SensorFrame
from mapping.voxels.map import VoxelMap

FUTURE_S = 0.05
"""A frame may be measured so much after now: clocks of one machine are read one after the other."""
TOO_OLD_S = 2.0
SILENT_S = 1.0
"""Without a frame for so long the sensor has stopped; likewise the vehicle's positions and attitudes."""
LARGEST_GAP = 10_000
"""More missing numbers than this are a source that counts from somewhere else."""
MOST_OBSTACLES = 16
SWEEP_EVERY_S = 0.2
ROI_STEP_M = 0.5
"""Bigazzi 2022, Table 1; voxels coarser than this are not searched more coarsely."""
LONGEST_CORRIDOR_M = 120.0
WITHIN_M, USUAL_ERROR_M = 1.0, 0.3


class Perception:
    """One sensor's map, regions and alerts; a subclass says how its frames become voxels.

    Nothing here waits, reads a clock or touches another sensor's map. ``dropped`` counts what was refused, frames and
    points and poses, by reason.
    """

    name = "sensor"
    field = Field(nearest_m=0.5, aside_rad=math.radians(30.0))
    """Where it sees what stands at the vehicle's height."""

    def __init__(self, settings: Settings, *, alert_prefix: str = "") -> None:
        self.settings = settings
        self.map = VoxelMap(resolution_m=settings.resolution_m, memory_limit_bytes=settings.memory_limit_bytes)
        self.track = PoseTrack()
        self.alerts = AlertBook(self.name, prefix=alert_prefix)
        self.dropped: Counter[str] = Counter()
        self.frames = 0
        self.lost_frames = 0
        self.offset_enu_m: F64 = np.zeros(3)
        """Of this map's frame against the vehicle's own positions."""
        self._ground: GroundGrid | None = None
        self._line: MissionLine | None = None
        self._flying = True
        self._has_fix = True
        self._newest: tuple[float, int, str] | None = None
        self._came_mono_s = -math.inf
        """When that came, which may be a good while after it was measured."""
        self._sweep: tuple[float, tuple[float | None, ...]] = (-math.inf, ())
        self._sector = self._sector_points(settings)
        self._remembered = Remembered(settings.resolution_m)

    # What is known

    def feed_position(
        self, t_mono_s: float, enu_m: ArrayLike, velocity_enu_m_s: ArrayLike | None = None, *, has_fix: bool = True
    ) -> None:
        """The vehicle's own position; without a fix it is not believed."""
        self._has_fix = has_fix
        refused = self.track.add_position(t_mono_s, enu_m, velocity_enu_m_s) if has_fix else None
        if refused is not None:
            self.dropped[f"pose: {refused}"] += 1

    def feed_attitude(self, t_mono_s: float, roll_rad: float, pitch_rad: float, heading_rad: float) -> None:
        refused = self.track.add_attitude(t_mono_s, quaternions.from_attitude(heading_rad, pitch_rad, roll_rad))
        if refused is not None:
            self.dropped[f"pose: {refused}"] += 1

    def set_ground(self, ground: GroundGrid | None) -> None:
        """The surface model that explains echoes; voxels that are in the map already keep their verdict."""
        self._ground = ground

    def set_line(self, points_enu: ArrayLike | None) -> None:
        """The mission's line, (M, 3); None or a single point: there is no corridor."""
        points = None if points_enu is None else np.asarray(points_enu, np.float64).reshape(-1, 3)
        self._line = MissionLine(points) if points is not None and len(points) > 1 else None

    def set_flying(self, flying: bool) -> None:
        """On the ground nothing alarms: everything that stands there is near."""
        self._flying = flying

    def set_settings(self, settings: Settings) -> None:
        """Other regions at once; another resolution or memory limit begins the map anew.

        Raises ParameterError or CapacityError for what cannot be; then everything stays as it was.
        """
        sector = self._sector_points(settings)
        if self.settings.makes_another_map(settings):
            self.map = VoxelMap(resolution_m=settings.resolution_m, memory_limit_bytes=settings.memory_limit_bytes)
            self._forget()
        self.settings, self._sector = settings, sector

    @property
    def flight(self) -> FlightMap | None:
        """All that was seen on the flight, where ``map`` is local."""
        return None

    def accumulate(self) -> None:
        """What of a frame can wait until it has been told."""

    def clear(self) -> None:
        """Empty the map."""
        self.map.clear()
        self._forget()

    def _forget(self) -> None:
        """What a subclass knows beside the map."""
        self._sweep = (-math.inf, ())
        self._remembered = Remembered(self.map.resolution_m)

    @staticmethod
    def reach_down(settings: Settings) -> float:
        """See ``corridor.tube_points``."""
        return 0.0

    @staticmethod
    def _sector_points(s: Settings) -> F64:
        return sector_points(
            depth_m=s.depth_m, fov_rad=s.fov_rad, height_m=s.height_m, resolution_m=min(ROI_STEP_M, s.resolution_m)
        )

    @property
    def _within_m(self) -> float:
        """How near to the surface model is known ground: 1 m for a position that is good to 0.3 m."""
        return WITHIN_M + max(0.0, self.settings.position_error_m - USUAL_ERROR_M)

    @property
    def placed(self) -> bool:
        """Whether the map lies in the vehicle's own positions: otherwise ground and mission say nothing about it."""
        return True

    @property
    def _known_ground(self) -> GroundGrid | None:
        return None if self.settings.paper_bare or not self.placed else self._ground

    # Frames

    def _refusal(self, frame: SensorFrame, now_mono_s: float) -> str | None:
        """Why a frame is not taken at all; counts the frames that are missing before one that is."""
        if not frame.is_whole:
            return "columns of different length"
        t = frame.t_mono_s
        if not math.isfinite(t):
            return "time not finite"
        if t > now_mono_s + FUTURE_S:
            return "from the future"
        if t < now_mono_s - TOO_OLD_S:
            return "too late"
        if self._newest is not None:
            newest_t, number, source = self._newest
            if source == frame.source and number == frame.number:
                return "duplicate"
            if t <= newest_t:
                return "out of order"
            missing = frame.number - number - 1
            if source == frame.source and 0 < missing < LARGEST_GAP:
                self.lost_frames += missing
        self._newest, self._came_mono_s = (t, frame.number, frame.source), now_mono_s
        return None

    def _pose_for(self, frame: SensorFrame, now_mono_s: float) -> Pose | FrameResult:
        """Where the vehicle was when the frame was measured, by GNSS; what comes of a frame that cannot be placed."""
        refusal = self._refusal(frame, now_mono_s)
        if refusal is None and not self._has_fix:
            refusal = "no GNSS position"
        pose = self.track.at(frame.t_mono_s) if refusal is None else refusal
        return self._drop(frame, pose, now_mono_s) if isinstance(pose, str) else pose

    def _drop(self, frame: SensorFrame, reason: str, now_mono_s: float) -> FrameResult:
        self.dropped[reason] += 1
        state, text = self._state(now_mono_s)
        alerts = self.alerts.pass_time(now_mono_s) if state != "running" else []
        return FrameResult(
            t_mono_s=frame.t_mono_s,
            state=state,
            text=text,
            accepted=False,
            alerts=tuple(alerts),
        )

    def on_tick(self, now_mono_s: float) -> FrameResult:
        """Time has passed without a frame."""
        state, text = self._state(now_mono_s)
        alerts = self.alerts.pass_time(now_mono_s)
        return FrameResult(t_mono_s=now_mono_s, state=state, text=text, accepted=False, alerts=tuple(alerts))

    def _state(self, now_mono_s: float) -> tuple[State, str]:
        if self._newest is None:
            return "waiting", f"No {self.name} frame has come yet."
        silent_s = now_mono_s - self._came_mono_s
        if silent_s > SILENT_S:
            return "stale", f"No {self.name} frame for {silent_s:.0f} s. Check the sensor."
        return self._pose_state(now_mono_s)

    def _pose_state(self, now_mono_s: float) -> tuple[State, str]:
        if not self._has_fix:
            return "frozen", f"No GNSS position: the {self.name} map stands still."
        if self.track.is_doubting:
            return "frozen", f"The vehicle's position jumped: the {self.name} map stands still."
        for what, newest in (
            ("position", self.track.position_t_mono_s),
            ("attitude", self.track.attitude_t_mono_s),
        ):
            if newest is None or now_mono_s - newest > SILENT_S:
                return "frozen", f"No {what} from the vehicle: the {self.name} map stands still."
        return "running", ""

    # What is searched and told

    def _look(self, t_mono_s: float, now_mono_s: float, pose: Pose, points: int) -> FrameResult:
        """Regions, obstacles and alerts, after a frame has gone into the map."""
        self.frames += 1
        inside = self._in_sector(pose)
        hidden_m = self._hidden_m(inside, pose)
        corridor_m, on_way = self._in_corridor(pose)
        found = self._found(inside, on_way, pose)
        alerts = self.alerts.observe(found if self._flying else [], t_mono_s)
        state, text = self._state(now_mono_s)
        return FrameResult(
            t_mono_s=t_mono_s,
            state=state,
            text=text,
            accepted=True,
            pose=pose,
            points=points,
            region=self._region(pose, len(inside) > 0, hidden_m),
            corridor_m=corridor_m,
            corridor_occupied=len(on_way) > 0,
            obstacles=tuple(found[:MOST_OBSTACLES]),
            sweep_m=self._swept(t_mono_s, pose),
            alerts=tuple(alerts),
        )

    def _in_sector(self, pose: Pose) -> F64:
        """(N, 3) centres of believed, occupied voxels in the sector ahead, the nearest first."""
        p, psi = pose.position_enu_m, pose.heading_rad
        hits = search_sector(self.map, self._sector, p, psi, include_explained=self.settings.paper_bare)
        return self._centres(to_enu(self._sector[hits], p, psi))

    def _in_corridor(self, pose: Pose) -> tuple[float, F64]:
        """(length, (N, 3) centres) of the corridor along the mission ahead; 0 and none without a mission."""
        s = self.settings
        if self._line is None or s.paper_bare or not self._flying or not self.placed:
            return 0.0, np.empty((0, 3))
        place = self._line.place(pose.position_enu_m - self.offset_enu_m)
        if place is None:
            return 0.0, np.empty((0, 3))
        speed = float(np.linalg.norm(pose.velocity_enu_m_s))
        ahead_m = min(length_m(speed, s.braking) + s.vehicle_radius_m, LONGEST_CORRIDOR_M)
        line = self._line.ahead(place.s_m, ahead_m) + self.offset_enu_m
        tube = tube_points(
            line,
            radius_m=s.vehicle_radius_m + s.position_error_m,
            step_m=s.resolution_m / 2,
            reach_down=self.reach_down(s),
        )
        return ahead_m, self._centres(tube[self._occupied(tube)])

    def _centres(self, points_enu: F64) -> F64:
        """The voxels that hold these places, each once, as centres."""
        keys = np.floor(np.asarray(points_enu, np.float64).reshape(-1, 3) / self.map.resolution_m)
        return (np.unique(keys, axis=0) + 0.5) * self.map.resolution_m

    def _found(self, inside: F64, on_way: F64, pose: Pose) -> list[Found]:
        shared = {
            "resolution_m": self.map.resolution_m,
            "position_enu_m": pose.position_enu_m,
            "velocity_enu_m_s": pose.velocity_enu_m_s,
            "heading_rad": pose.heading_rad,
        }
        beyond = on_way[~(on_way[:, None, :] == inside[None, :, :]).all(axis=2).any(axis=1)]
        found = obstacles(inside, region="roi", **shared) + obstacles(beyond, region="corridor", **shared)
        return sorted(found, key=lambda f: f.distance_m)

    def _hidden_m(self, inside: F64, pose: Pose) -> float | None:
        """Distance of the nearest thing that stood in the way and cannot be seen now: nobody knows its height."""
        s = self.settings
        self._remembered.remember(inside)
        way = Way(self._depth_m, s.fov_rad / 2, s.vehicle_radius_m + s.position_error_m, s.height_m)
        hidden = self._remembered.look(pose, way, self._sees, self._occupied)
        return float(hidden[0]) if len(hidden) else None

    def _sees(self, range_m: F64, aside_rad: F64) -> Bools:
        return self.field.sees(range_m, aside_rad)

    def _occupied(self, points_enu: F64) -> Bools:
        """(N,) Whether an unexplained voxel stands at each place."""
        taken = self.map.probability(points_enu) > 0.5
        if not self.settings.paper_bare:
            taken[taken] = ~self.map.explained(points_enu[taken])
        return taken

    @property
    def _depth_m(self) -> float:
        """Of what is searched ahead."""
        return self.settings.depth_m

    def _region(self, pose: Pose, occupied: bool, hidden_m: float | None) -> SearchedRegion | None:
        """None where this frame looks elsewhere."""
        s, p = self.settings, pose.position_enu_m
        tip = (float(p[0]), float(p[1]), float(p[2]))
        return SearchedRegion(
            tip, pose.heading_rad, self._depth_m, s.fov_rad, s.height_m, occupied, self.field.nearest_m, hidden_m
        )

    def _swept(self, t_mono_s: float, pose: Pose) -> tuple[float | None, ...]:
        if t_mono_s - self._sweep[0] >= SWEEP_EVERY_S:
            centres = self.map.occupied(explained=None if self.settings.paper_bare else False)
            around = sweep(centres, position_enu_m=pose.position_enu_m, heading_rad=pose.heading_rad)
            self._sweep = (t_mono_s, around)
        return self._sweep[1]

    def _count(self, what: str, count: int) -> None:
        if count:
            self.dropped[what] += count
