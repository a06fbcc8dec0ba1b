"""A TI radar as a source of readings: configured, read, counted, and found again after its cable was pulled."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mapping.errors import RadarDataError
from telemetry.agent.client import NoticeReading, RadarReading
from telemetry.agent.live_radar import LiveRadar, LiveStatus, reading_of
from telemetry.errors import SensorError
from telemetry.sensors.serial_port import open_port
from telemetry.sensors.ti_mmwave.config import LEAST_SNR_DB
from telemetry.sensors.ti_mmwave.differences import other_configuration
from telemetry.sensors.ti_mmwave.packets import TiCounts, TiStream
from telemetry.sensors.ti_mmwave.ti_config import TiConfig
from telemetry.sensors.ti_mmwave.ti_frame import TiFrame
from telemetry.sensors.ti_mmwave.ti_session import TiPorts, configure, empty, frames

USUAL_PERIOD_S = 0.1
LONGEST_PAUSE_S = 5.0
"""Between two frames of a capture: what is longer is a gap that nobody wants to wait for."""
ADVICE = "Give the .cfg that it runs with: --ti-config."
_CHUNK_BYTES = 4096


@dataclass(slots=True)
class TiStatus(LiveStatus):
    """What an agent tells of its TI radar."""

    stream: TiCounts = field(default_factory=TiCounts)
    points: int = 0

    @property
    def frames(self) -> int:
        return self.stream.frames

    def as_dict(self) -> dict[str, int | str]:
        return self._as_dict(self.stream, points=self.points)

    def __str__(self) -> str:
        s = self.stream
        damaged = s.damaged_packets + s.implausible_lengths
        return self.told(
            f"{s.frames} frames, {self.points} points, {s.lost_packets} packets lost, {damaged} damaged, "
            f"{s.bad_bytes} bad bytes"
        )


class ConfigurationComparison:
    """Once: whether frames come from a radar with the configuration that was given."""

    def __init__(self, config: TiConfig | None) -> None:
        self._config = config

    def first_difference(self, frame: TiFrame) -> str:
        """Empty where there is none, where a frame does not show it, and ever after."""
        if self._config is None or not len(frame.range_profile):
            return ""
        config, self._config = self._config, None
        return other_configuration(frame, config)


class TiRadar(LiveRadar):
    """Configured anew whenever it was away."""

    def __init__(
        self,
        config: TiConfig,
        ports: TiPorts,
        *,
        tell: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self._config, self._ports = config, ports
        self._stream = TiStream(velocity_cell_m_s=config.velocity_cell_m_s)
        self.status = TiStatus(stream=self._stream.counts)
        self._comparison = ConfigurationComparison(config)
        super().__init__(self.status, tell=tell, now=now, wait=wait)

    def _session(self) -> Iterator[RadarReading | NoticeReading]:
        self._stream.reset()
        with contextlib.closing(open_port(self._ports.data, self._ports.data_baud)) as port:
            empty(port)
            if self._ports.config is not None:
                configure(
                    self._ports.config,
                    self._ports.config_baud,
                    self._config.commands,
                    now=self._now,
                    before_start=lambda: empty(port),
                )
            for t_s, frame in frames(port, self._stream, period_s=self._config.frame_period_s, now=self._now):
                if frame is None:
                    yield from self._garbled()
                    continue
                yield from self._fine()
                yield from self._compare(frame)
                yield from self._crowded(len(frame.xyz_m))
                self.status.points += len(frame.xyz_m)
                yield frame_reading(frame, t_s, self._config.least_snr_db)

    def _compare(self, frame: TiFrame) -> Iterator[NoticeReading]:
        if what := self._comparison.first_difference(frame):
            yield self._notice(f"{what} {ADVICE}", what)

    def _garbled(self) -> Iterator[NoticeReading]:
        error = SensorError(
            "Bytes come from the radar and no frame is among them.",
            where=self._ports.data,
            advice=f"Check the baud rate ({self._ports.data_baud}; 921600 is usual) and that this is its data port.",
        )
        if not self._stream.counts.frames:
            raise error
        yield from self._trouble(error)


def frame_reading(frame: TiFrame, t_s: float, least_snr_db: float) -> RadarReading:
    """Of unknown strength: just strong enough to be detected."""
    snr_db = np.where(np.isnan(frame.snr_db), np.float32(least_snr_db), frame.snr_db)
    return reading_of(t_s, frame.xyz_m, frame.radial_speed_m_s, snr_db, frame.lost_before)


def captured_readings(
    path: Path, config: TiConfig | None, status: TiStatus, *, tell: Callable[[str], None]
) -> Iterator[tuple[float, RadarReading]]:
    """A data port's bytes from a file: seconds since the first frame, by the frames' numbers, and the reading.

    ``tell`` hears one line where they come from a radar with another configuration. Raises RadarDataError when there
    is no frame in it, or speeds that only a configuration explains; and OSError.
    """
    stream = TiStream(velocity_cell_m_s=config.velocity_cell_m_s if config else float("nan"))
    status.stream = stream.counts
    period_s = config.frame_period_s if config else USUAL_PERIOD_S
    least_snr_db = config.least_snr_db if config else LEAST_SNR_DB
    after_s, comparison = -period_s, ConfigurationComparison(config)
    for frame in _captured_frames(path, stream):
        after_s += min(frame.periods * period_s, max(period_s, LONGEST_PAUSE_S))
        if what := comparison.first_difference(frame):
            tell(f"{what} {ADVICE}")
        if np.isnan(frame.radial_speed_m_s).any():
            raise RadarDataError(
                f"Firmware of SDK {frame.sdk[0]}.{frame.sdk[1]} tells speeds in cells of unknown size.",
                where=path.name,
                advice="Give the radar's configuration with --ti-config.",
            )
        status.points += len(frame.xyz_m)
        if words := status.crowded(len(frame.xyz_m)):
            tell(words)
        yield after_s, frame_reading(frame, after_s, least_snr_db)
    if not stream.counts.frames:
        raise RadarDataError(
            f"There is no frame in its {stream.counts.bytes:,} bytes.",
            where=path.name,
            advice="Record the bytes of the radar's data port, at 921600 baud.",
        )


def _captured_frames(path: Path, stream: TiStream) -> Iterator[TiFrame]:
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK_BYTES):
            yield from stream.feed(chunk)
    yield from stream.reset()
