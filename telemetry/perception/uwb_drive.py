"""A UWB radar's scans and the places where they were made, as they come: what a log holds, live or from a recording."""

from __future__ import annotations

import math
from collections import deque
from pathlib import Path

import numpy as np

from mapping.geometry import quaternions
from mapping.geometry.arrays import F32
from mapping.geometry.frames import LocalFrame
from mapping.geometry.poses import Pose, PoseTrack
from mapping.sensor_frames import UwbScan, rows
from mapping.uwb.uwb_params import UwbGeometry
from planning.ground.traversable import UwbScans
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.sensors.uwb_log import MOST_BYTES, read_uwb_log
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState

WAIT_S = 1.0
"""A scan waits so long for where the vehicle was then."""


class UwbDrive:
    """``on_state`` and ``on_scan`` in any order of arrival; times are of one monotonic clock.

    A scan's place is the vehicle's, its direction the nose's with the beam's bearing; the vehicle is taken to stand
    level enough. All scans of a drive lie in range as the first one's do.
    """

    def __init__(self, *, most_bytes: int = MOST_BYTES) -> None:
        self.source = ""
        self.unplaced = 0
        """Scans without a place: no position or attitude was known then, or they came out of order."""
        self.other_geometry = 0
        """Left out: they lie otherwise in range than the first one."""
        self._most_bytes, self._bytes = most_bytes, 0
        self._geometry: UwbGeometry | None = None
        self._frame: LocalFrame | None = None
        self._track = PoseTrack()
        self._waiting: deque[UwbScan] = deque()
        self._t_s: list[float] = []
        self._lat_lon_deg: list[tuple[float, float]] = []
        self._heading_rad: list[float] = []
        self._intensity: list[F32] = []

    def __len__(self) -> int:
        """Scans with a place."""
        return len(self._t_s)

    @property
    def is_full(self) -> bool:
        return self._bytes >= self._most_bytes

    def on_state(self, state: VehicleState) -> None:
        t_s, lat_deg, lon_deg = state.position_t_mono_s, state.lat_deg, state.lon_deg
        if t_s is not None and lat_deg is not None and lon_deg is not None:
            self._frame = self._frame or LocalFrame(lat_deg, lon_deg, 0.0)
            self._track.add_position(t_s, self._frame.to_enu(lat_deg, lon_deg, 0.0)[0])
        t_s, roll, pitch, heading = state.attitude_t_mono_s, state.roll_rad, state.pitch_rad, state.heading_rad
        if t_s is not None and roll is not None and pitch is not None and heading is not None:
            self._track.add_attitude(t_s, quaternions.from_attitude(heading, pitch, roll))
        self._place()

    def on_scan(self, scan: UwbScan) -> None:
        geometry = UwbGeometry(len(scan.intensity) // 4, scan.bin_m, scan.first_bin_m, scan.beamwidth_rad)
        self._geometry = self._geometry or geometry
        if geometry != self._geometry:
            self.other_geometry += 1
            return
        self.source = scan.source
        self._waiting.append(scan)
        self._place()

    def finish(self) -> None:
        """No more poses will come: what still waits is placed by those there are."""
        while self._waiting:
            self._take(self._waiting.popleft())

    @property
    def left_out(self) -> str:
        """What counts for nothing, and why, for people; empty: everything counts."""
        reasons = (
            (self.unplaced, "where the vehicle was is not known"),
            (self.other_geometry, "other range bins than at first"),
        )
        parts = [f"{count:,}, {why}" for count, why in reasons if count]
        return f"Scans left out: {'; '.join(parts)}." if parts else ""

    def scans(self) -> UwbScans:
        """Those with a place, in their order; times count from the first. At least one must be there."""
        assert self._geometry is not None
        t_s = np.array(self._t_s, np.float64)
        return UwbScans(
            t_s - t_s[0],
            np.array(self._lat_lon_deg, np.float64),
            np.array(self._heading_rad, np.float64),
            np.array(self._intensity, np.float32),
            self._geometry,
            self.left_out,
        )

    def _place(self) -> None:
        """Scans up to which poses are known, and those that have waited long enough."""
        if not self._waiting:
            return
        known_s = min(self._track.position_t_mono_s or -math.inf, self._track.attitude_t_mono_s or -math.inf)
        newest_s = self._waiting[-1].t_mono_s
        while self._waiting and (self._waiting[0].t_mono_s <= known_s or self._waiting[0].t_mono_s < newest_s - WAIT_S):
            self._take(self._waiting.popleft())

    def _take(self, scan: UwbScan) -> None:
        pose = self._track.at(scan.t_mono_s)
        late = bool(self._t_s) and scan.t_mono_s <= self._t_s[-1]
        if not isinstance(pose, Pose) or self._frame is None or late:
            self.unplaced += 1
            return
        if self.is_full:
            return
        lat_deg, lon_deg, _ = self._frame.to_geodetic(pose.position_enu_m)[0]
        self._t_s.append(scan.t_mono_s)
        self._lat_lon_deg.append((float(lat_deg), float(lon_deg)))
        self._heading_rad.append((pose.heading_rad + scan.bearing_rad) % (2.0 * math.pi))
        self._intensity.append(rows(scan.intensity, 1)[:, 0])
        self._bytes += len(scan.intensity)


def read_scans(path: Path, name: str) -> UwbScans:
    """Of a log, or of a recording by its ending. Raises FormatError, RecordingError."""
    return recorded_scans(path) if path.suffix.lower() == ".mcap" else read_uwb_log(path, name)


def recorded_scans(path: Path) -> UwbScans:
    """The scans of a recording with where the vehicle was then. Raises RecordingError where there are none."""
    with open_recording(path) as recording:
        if Topic.UWB_SCAN not in recording.topics():
            what = f"The recording holds no scans of a UWB radar ({Topic.UWB_SCAN})."
            raise RecordingError(what, where=path.name, advice="Choose another recording, or a .npz log.")
        drive = UwbDrive(most_bytes=MOST_BYTES)
        for entry in recording.entries((Topic.UWB_SCAN, Topic.VEHICLE)):
            match entry.message:
                case UwbScan():
                    drive.on_scan(entry.message)
                case VehicleState():
                    drive.on_state(entry.message)
        drive.finish()
    if drive.is_full:
        raise RecordingError(
            f"The recording holds more than {MOST_BYTES // 1000**2} MB of scans of a UWB radar.",
            where=path.name,
            advice="Record less at once: one map of what has been driven so far is made of all scans together.",
        )
    if not len(drive):
        raise RecordingError(
            f"None of its {drive.unplaced} UWB scans can be placed: no position or attitude was known then.",
            where=path.name,
            advice="Record the sensor together with the vehicle's link, in one recording.",
        )
    return drive.scans()
