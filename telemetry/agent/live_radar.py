"""A radar that stays a source of readings: opened again whenever it goes, and the pilot told of both."""

from __future__ import annotations

import abc
import time
from collections.abc import Callable, Generator, Iterator
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from telemetry.agent.client import NoticeReading, RadarReading
from telemetry.agent.link_messages import TARGETS_MAX
from telemetry.errors import SensorError
from telemetry.sensors.position2go.board_session import Position2GoCounts
from telemetry.sensors.ti_mmwave.packets import TiCounts

AGAIN_S = (0.5, 1.0, 2.0, 5.0)


@dataclass(slots=True)
class LiveStatus(abc.ABC):
    """What an agent tells of its radar."""

    interruptions: int = 0
    """Times that the radar went away: a pulled cable, no power, silence."""
    left_out: int = 0
    """Targets beyond the most of a frame: the weakest."""
    trouble: str = ""
    """Why nothing comes at present; empty while frames come."""

    @property
    @abc.abstractmethod
    def frames(self) -> int:
        """Since the agent began."""

    @abc.abstractmethod
    def as_dict(self) -> dict[str, int | str]: ...

    def crowded(self, targets: int) -> str:
        """Counts what is left out of a frame; words with the first such frame, for what is left out is not seen."""
        is_first, beyond = not self.left_out, max(0, targets - TARGETS_MAX)
        self.left_out += beyond
        if not (is_first and beyond):
            return ""
        return f"A frame has {targets:,} targets: the {TARGETS_MAX:,} strongest are passed on, the others are not."

    def _as_dict(self, counts: TiCounts | Position2GoCounts, **found: int) -> dict[str, int | str]:
        """``found``: in its frames."""
        own = {"left_out": self.left_out, "interruptions": self.interruptions, "trouble": self.trouble}
        return {"frames": self.frames, **found, **asdict(counts), **own}

    def told(self, counts: str) -> str:
        """``counts`` with what has gone wrong."""
        beyond = f", {self.left_out} beyond {TARGETS_MAX:,} of a frame left out" if self.left_out else ""
        text = f"radar: {counts}{beyond}, {self.interruptions} interruptions"
        return f"{text}; {self.trouble}" if self.trouble else text


class LiveRadar(abc.ABC):
    """``readings`` blocks, in a thread of its own; ``status`` may be read from any."""

    def __init__(
        self,
        status: LiveStatus,
        *,
        tell: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        """``tell`` hears one line when the radar goes away or sends garbage, and one when it is back."""
        self._live, self._tell, self._now, self._wait = status, tell, now, wait

    @abc.abstractmethod
    def _session(self) -> Iterator[RadarReading | NoticeReading]:
        """From the opening of its port on; ends with SensorError when the radar goes."""

    def readings(self) -> Generator[RadarReading | NoticeReading, None, None]:
        """For ever, with a notice for the pilot when the radar goes away and when it is back.

        Raises SensorError only while not a single frame has come: then somebody can still put it right.
        """
        failures = 0
        while True:
            try:
                for reading in self._session():
                    failures = 0
                    yield reading
            except SensorError as error:
                if not self._live.frames:
                    raise
                self._live.interruptions += failures == 0
                yield from self._trouble(error)
            self._wait(AGAIN_S[min(failures, len(AGAIN_S) - 1)])
            failures += 1

    def _trouble(self, error: SensorError) -> Iterator[NoticeReading]:
        if str(error) != self._live.trouble:
            self._live.trouble = str(error)
            yield self._notice(f"{error}", error.what)

    def _fine(self) -> Iterator[NoticeReading]:
        if self._live.trouble:
            self._live.trouble = ""
            self._tell("The radar sends frames again.")
            yield NoticeReading(self._now(), False, "radar: It sends frames again.")

    def _crowded(self, targets: int) -> Iterator[NoticeReading]:
        if words := self._live.crowded(targets):
            yield self._notice(words, words)

    def _notice(self, line: str, words: str) -> NoticeReading:
        """A warning: ``line`` for whoever reads along on board, ``words`` for the pilot."""
        self._tell(line)
        return NoticeReading(self._now(), True, f"radar: {words}")


def reading_of(
    t_s: float, xyz_m: NDArray[np.floating], speed_m_s: NDArray[np.floating], snr_db: NDArray[np.floating], lost: int
) -> RadarReading:
    """The strongest targets stay where there are too many, in their order."""
    targets = np.column_stack((xyz_m, speed_m_s, snr_db)).astype(np.float32)
    if len(targets) > TARGETS_MAX:
        strongest = np.argsort(-snr_db, kind="stable")[:TARGETS_MAX]
        targets = targets[np.sort(strongest)]
    return RadarReading(t_s, targets, lost)
