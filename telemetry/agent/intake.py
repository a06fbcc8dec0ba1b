"""The ground station's end of one sensor link, sans-IO: agent's messages in, frames for the bus and answers out."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F32
from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose, UwbScan, packed
from telemetry.agent import link_messages as wire
from telemetry.errors import SensorLinkError
from telemetry.topics.messages import VehicleText

LATE_S = 0.5
FUTURE_S = 0.05
"""Beyond what clocks that were laid over each other can differ."""
RATE_OVER_S = 5.0
NAME_MAX = 40
NOTICE_EVERY_S = 1.0
SCANS_MOST_HZ = 200
"""Of a UWB radar: what comes faster says nothing new of the ground, and fills recordings."""
WARNING, INFO = 4, 6
"""MAV_SEVERITY"""

Frame = RadarFrame | CloudFrame | SlamPose | UwbScan


@dataclass(frozen=True, slots=True)
class Taken:
    """What one message of the agent comes to."""

    frame: Frame | None = None
    answer: wire.FromServer | None = None
    notice: VehicleText | None = None
    """For the pilot, among what the vehicle itself says."""


class Intake:
    """Lives as long as one connection. Times are this machine's monotonic clock, and UTC for the records."""

    def __init__(self) -> None:
        self.name = ""
        self.received = self.lost = self.late = self.refused = 0
        self._why = ""
        self._numbers: dict[type[wire.FromAgent], int] = {}
        self._sizes: deque[tuple[float, int]] = deque()
        self._noticed_s = -math.inf
        self._scans: deque[float] = deque(maxlen=SCANS_MOST_HZ)
        """When the last ones came."""

    def on_data(self, data: bytes, *, now_mono_s: float, now_utc_s: float) -> Taken:
        """Raises SensorLinkError where the connection must end: no hello, or one of another version.

        What cannot be understood after that, or makes no sense, is counted and told in the next report.
        """
        self._sizes.append((now_mono_s, len(data)))
        try:
            message = wire.decode_from_agent(data)
        except SensorLinkError as error:
            if not self.name:
                raise
            return self._refuse(str(error))
        if isinstance(message, wire.Hello):
            return Taken(answer=self._greet(message, now_mono_s))
        if not self.name:
            raise SensorLinkError("An agent must say hello first.", where="sensor link")
        if isinstance(message, wire.Ping):
            return Taken(answer=wire.Pong(message.t_s, now_mono_s))
        if isinstance(message, wire.Notice):
            return Taken(notice=self._notice(message, now_mono_s, now_utc_s))
        try:
            frame = self._frame(message, now_mono_s, now_utc_s)
        except SensorLinkError as error:
            return self._refuse(str(error))
        self.received += 1
        return Taken(frame=frame)

    def report(self, now_mono_s: float) -> wire.ArrivalReport:
        while self._sizes and self._sizes[0][0] < now_mono_s - RATE_OVER_S:
            self._sizes.popleft()
        rate = sum(size for _, size in self._sizes) / RATE_OVER_S
        why, self._why = self._why, ""
        return wire.ArrivalReport(self.received, self.lost, self.late, self.refused, rate, why)

    def _refuse(self, why: str) -> Taken:
        self.refused, self._why = self.refused + 1, why
        return Taken()

    def _greet(self, hello: wire.Hello, now_mono_s: float) -> wire.Welcome:
        if hello.version != wire.PROTOCOL_VERSION:
            raise SensorLinkError(
                f"The agent speaks version {hello.version} of the sensor link, not {wire.PROTOCOL_VERSION}.",
                advice="Install the same version of Hedgehop on both computers.",
            )
        if not (0 < len(hello.name) <= NAME_MAX and hello.name.isprintable()):
            raise SensorLinkError(f"An agent's name has 1 to {NAME_MAX} printable characters.", where="sensor link")
        self.name = hello.name
        return wire.Welcome(now_mono_s)

    def _notice(self, message: wire.Notice, now_mono_s: float, now_utc_s: float) -> VehicleText | None:
        """None for one that comes too soon after another: an agent must not drown what the vehicle says."""
        if now_mono_s - self._noticed_s < NOTICE_EVERY_S:
            self._refuse("Notices come too often.")
            return None
        self._noticed_s = now_mono_s
        text = "".join(c if c.isprintable() else " " for c in message.text[: wire.NOTICE_LONGEST])
        return VehicleText(now_utc_s, WARNING if message.warning else INFO, f"{self.name}: {text}")

    def _frame(
        self, message: wire.RadarMessage | wire.Cloud | wire.Slam | wire.Uwb, now_mono_s: float, now_utc_s: float
    ) -> Frame:
        age_s = now_mono_s - message.t_s
        if not -FUTURE_S <= age_s < 3600.0:
            raise SensorLinkError(f"A frame was measured {-age_s:.2f} s from now.", where=type(message).__name__)
        self.late += age_s > LATE_S
        if isinstance(message, wire.Slam):
            if not all(math.isfinite(value) for value in (*message.position_m, *message.q_wxyz)):
                raise SensorLinkError("A pose holds what is no number.", where="slam")
            return SlamPose(message.t_s, message.position_m, message.q_wxyz, message.tracking)
        if isinstance(message, wire.Uwb):
            return self._scan(message, now_mono_s, now_utc_s - age_s)
        if isinstance(message, wire.RadarMessage):
            targets = self._whole(wire.targets_of(message))
            self._count(message)
            xyz_m, speed, snr = packed(targets[:, :3]), packed(targets[:, 3]), packed(targets[:, 4])
            return RadarFrame(message.t_s, now_utc_s - age_s, message.number, self.name, xyz_m, speed, snr)
        points = wire.points_of(message)
        self._count(message)
        xyz_m = packed(points)
        return CloudFrame(message.t_s, now_utc_s - age_s, message.number, self.name, xyz_m, message.voxel_m)

    def _whole(self, targets: F32) -> F32:
        """Those that are numbers. Raises SensorLinkError where none is: that must not look like an empty air."""
        whole = np.isfinite(targets).all(axis=1)
        if missing := len(targets) - int(np.count_nonzero(whole)):
            what = f"{missing:,} of {len(targets):,} targets hold what is no number."
            if missing == len(targets):
                raise SensorLinkError(what, where="radar", advice="Leave out what is not known.")
            self._refuse(what)
        return targets[whole]

    def _scan(self, message: wire.Uwb, now_mono_s: float, t_utc_s: float) -> UwbScan:
        intensity = packed(wire.intensity_of(message))
        self._count(message)
        if len(self._scans) == SCANS_MOST_HZ and now_mono_s - self._scans[0] < 1.0:
            raise SensorLinkError(f"More than {SCANS_MOST_HZ} scans a second come.", where="uwb", advice="Send fewer.")
        self._scans.append(now_mono_s)
        angles_rad = math.radians(message.beamwidth_deg), math.radians(message.bearing_deg)
        lies = message.bin_m, message.first_bin_m
        return UwbScan(message.t_s, t_utc_s, message.number, self.name, intensity, *lies, *angles_rad)

    def _count(self, message: wire.RadarMessage | wire.Cloud | wire.Uwb) -> None:
        """Numbers count up by one; a smaller one is an agent that began anew, or a frame out of order."""
        last = self._numbers.get(type(message))
        if last is not None and message.number > last + 1:
            self.lost += message.number - last - 1
        self._numbers[type(message)] = message.number
