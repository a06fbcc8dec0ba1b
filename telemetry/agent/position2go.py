"""A Position2Go as a source of readings: its raw samples go through the radar's chain on board."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mapping.radar.chain import POSITION2GO_SETTINGS, RadarChain
from mapping.radar.radar_params import FmcwParams
from telemetry.agent.client import NoticeReading, RadarReading
from telemetry.agent.live_radar import LiveRadar, LiveStatus, reading_of
from telemetry.sensors.position2go.answers import CLIPPED
from telemetry.sensors.position2go.board_session import BoardSession, Position2GoCounts, TakenFrame
from telemetry.sensors.serial_port import open_port

BAUD = 115_200
"""Of a USB port, which has none of its own."""
TOO_STRONG = "Its receivers are driven to the end of their scale: something echoes strongly, and targets may be ghosts."


@dataclass(slots=True)
class Position2GoStatus(LiveStatus):
    """What an agent tells of its Position2Go."""

    counts: Position2GoCounts = field(default_factory=Position2GoCounts)
    targets: int = 0

    @property
    def frames(self) -> int:
        return self.counts.frames

    def as_dict(self) -> dict[str, int | str]:
        return self._as_dict(self.counts, targets=self.targets)

    def __str__(self) -> str:
        c = self.counts
        return self.told(
            f"{c.frames} frames, {self.targets} targets, {c.lost_frames} frames lost, {c.clipped_frames} clipped, "
            f"{c.bad_bytes} bad bytes"
        )


class Position2Go(LiveRadar):
    """Set up anew whenever it was away."""

    def __init__(
        self,
        device: str,
        *,
        tell: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self._device = device
        self._chain: RadarChain | None = None
        self._told_clipped = False
        self.status = Position2GoStatus()
        super().__init__(self.status, tell=tell, now=now, wait=wait)

    def _session(self) -> Iterator[RadarReading | NoticeReading]:
        with contextlib.closing(open_port(self._device, BAUD)) as port:
            session = BoardSession(port, self.status.counts, now=self._now, wait=self._wait)
            params = session.set_up()
            chain = self._chain_of(params)
            for taken in session.frames(params.chirps * params.chirp_interval_s / 2):
                yield from self._fine()
                yield from self._clipped(taken)
                yield from self._processed(chain, taken)

    def _chain_of(self, params: FmcwParams) -> RadarChain:
        """What the board sends is said once; the first frame must not wait for the compiler."""
        if self._chain is None or self._chain.params != params:
            self._tell(
                f"The radar's range cells are {params.range_resolution_m:.2f} m, to {params.max_range_m:.0f} m; speeds "
                f"to {params.max_velocity_m_s:.1f} m/s."
            )
            self._chain = RadarChain(params, POSITION2GO_SETTINGS)
            rng = np.random.default_rng(1)
            self._chain.process(rng.standard_normal((*params.shape, 2), np.float32).view(np.complex64)[..., 0])
        return self._chain

    def _clipped(self, taken: TakenFrame) -> Iterator[NoticeReading]:
        """Told once. Such a frame is processed all the same: what drives the receivers so far is near."""
        is_clipped = taken.frame.clipped > CLIPPED
        self.status.counts.clipped_frames += is_clipped
        if is_clipped and not self._told_clipped:
            self._told_clipped = True
            yield self._notice(TOO_STRONG, TOO_STRONG)

    def _processed(self, chain: RadarChain, taken: TakenFrame) -> Iterator[RadarReading | NoticeReading]:
        found = chain.process(taken.frame.cube)
        self.status.targets += len(found)
        yield from self._crowded(len(found))
        yield reading_of(taken.t_s, found.xyz_m, found.radial_speed_m_s, found.snr_db, taken.lost_before)
