"""The recorder: takes what is published, decides when it is written, and goes on after a full disk.

Messages are taken in one thread (``on_message``, ``start``, ``stop``, ``on_tick``, ``status``) and written in another
(``work``), so that a slow disk holds up nothing but itself.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from mapping.sensor_frames import CloudFrame
from telemetry.errors import RecordingError, RecordingFullError
from telemetry.recording.disk_space import Measure, Space, full, running_out, space_at
from telemetry.recording.mcap_files.continuing import Unfinished, read_begun
from telemetry.recording.mcap_files.sink import Write, describe
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.recorded_topics import RECORDED
from telemetry.recording.trigger import Preroll, Stamped, Trigger
from telemetry.recording.waiting import CloudBudget, LocalMapBudget, Waiting
from telemetry.topics.messages import ErrorInfo, PlanRecord, Published, RecorderStatus
from telemetry.topics.obstacles import MapDelta
from telemetry.topics.vehicle import VehicleState

_TRY_AGAIN_S = 3.0
_MEASURE_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class _Open:
    path: Path
    name: str
    t_mono_s: float
    t_utc_s: float
    by_hand: bool = False
    continues: bool = False
    """The file of a recorder that was killed."""


@dataclass(frozen=True, slots=True)
class _Close:
    pass


class Recorder:
    """One at a time; files are named after the UTC time of their beginning and the plan."""

    def __init__(
        self,
        folder: Path,
        *,
        unfinished: Unfinished | None = None,
        now: Callable[[], float] = time.monotonic,
        utc: Callable[[], float] = time.time,
        measure: Measure = space_at,
        write: Write = os.write,
    ) -> None:
        self._folder, self._now, self._utc, self._measure, self._write = folder, now, utc, measure, write
        self._trigger, self._preroll = Trigger(), Preroll()
        self._plan_name = ""
        self._file: _Open | None = None
        self._asked_name = ""
        self._failed_s: float | None = None
        self._waiting: Waiting[_Open | _Close] = Waiting()
        self._clouds, self._local_maps = CloudBudget(), LocalMapBudget()
        # Of the writing thread; read by the other one.
        self._writer: RecordingWriter | None = None
        self._written: _Open | None = None
        self._failure: tuple[_Open | None, RecordingError] | None = None
        """The file that could not be written, and why."""
        self._space: Space | None = None
        self._measured_s = -_MEASURE_EVERY_S
        self._rate_bytes_s = 0.0
        if unfinished is not None:
            self._go_on(unfinished)

    @property
    def recording(self) -> bool:
        return self._file is not None

    @property
    def dropped(self) -> int:
        """Messages that a slow disk had no time for."""
        return self._waiting.dropped

    @property
    def error(self) -> RecordingError | None:
        """Why nothing is being recorded although it should be."""
        failure = self._failure
        mine = failure is not None and (self._file is None or failure[0] is self._file)
        return failure[1] if failure is not None and mine and self._trigger.wanted else None

    def on_message(self, topic: str, message: Published) -> None:
        if topic not in RECORDED:
            return
        stamped = Stamped(self._now(), topic, message)
        if isinstance(message, CloudFrame) and not self._clouds.takes(len(message.xyz_m), stamped.t_mono_s):
            return
        if isinstance(message, MapDelta) and not self._local_maps.takes(message, stamped.t_mono_s):
            return
        self._preroll.add(stamped)
        if isinstance(message, PlanRecord):
            self._plan_name = message.name
        if self._file is not None:
            self._waiting.put(stamped)
        if isinstance(message, VehicleState):
            self._trigger.on_state(message, stamped.t_mono_s)
            self._follow_trigger()

    def start(self, name: str = "") -> str:
        """The file's name; a recording that runs already goes on until it is stopped by hand."""
        self._trigger.start_by_hand()
        self._asked_name = name
        self._note_failure()
        self._failed_s = None
        self._follow_trigger()
        assert self._file is not None
        return self._file.path.name

    def stop(self) -> None:
        self._trigger.stop_by_hand()
        self._follow_trigger()

    def on_tick(self) -> None:
        """A few times a second."""
        self._trigger.on_tick(self._now())
        self._note_failure()
        self._follow_trigger()

    def status(self) -> RecorderStatus:
        writer, file = self._writer, self._file
        warning = self.error or self._warning()
        return RecorderStatus(
            t_mono_s=self._now(),
            recording=file is not None and self.error is None,
            name=file.path.name if file else None,
            started_utc_s=file.t_utc_s if file else None,
            bytes=writer.bytes if writer else 0,
            messages=writer.messages if writer else 0,
            free_bytes=self._space.free if self._space else None,
            error=ErrorInfo.of(warning) if warning else None,
        )

    def _note_failure(self) -> None:
        """The other thread could not write the present file: another one is begun when that may work."""
        if self._file is not None and self.error is not None:
            self._file, self._failed_s = None, self._now()

    def _follow_trigger(self) -> None:
        if self._trigger.wanted and self._file is None and self._may_begin():
            self._begin()
        elif not self._trigger.wanted:
            if self._file is not None:
                self._waiting.mark(_Close())
            self._file, self._failed_s, self._asked_name = None, None, ""

    def _may_begin(self) -> bool:
        if self._failed_s is None:
            return True
        ready = self._space is not None and self._space.enough_to_begin
        return ready and self._now() - self._failed_s >= _TRY_AGAIN_S

    def _begin(self) -> None:
        name = self._asked_name or self._plan_name
        utc_s = self._utc()
        path = free_path(self._folder, utc_s, name)
        self._file = _Open(path, name, self._now(), utc_s, by_hand=self._trigger.by_hand)
        self._failed_s = None
        self._waiting.mark(self._file)
        for stamped in self._preroll.take(self._now()):
            self._waiting.put(stamped)

    def _go_on(self, found: Unfinished) -> None:
        self._trigger.go_on(self._now(), by_hand=found.by_hand)
        self._file = _Open(found.path, found.name, found.t_mono_s, found.t_utc_s, by_hand=found.by_hand, continues=True)
        self._waiting.mark(self._file)

    def _warning(self) -> RecordingFullError | None:
        if self._space is None or self._file is None:
            return None
        return running_out(self._space, self._rate_bytes_s, str(self._folder.name))

    # From here on: the writing thread.

    def work(self) -> RecordingError | None:
        """Writes all that waits. Call it ten times a second. An error ends up in the status and is returned, too."""
        failed = None
        for item in self._waiting.take():
            try:
                self._do(item)
            except RecordingError as error:
                failed = self._give_up(error)
        try:
            if self._writer is not None:
                self._writer.commit()
            self._look_at_disk()
        except RecordingError as error:
            failed = self._give_up(error)
        return failed

    def _do(self, item: Stamped | _Open | _Close) -> None:
        if isinstance(item, _Open):
            self._written = item
            self._look_at_disk(now=True)
            self._writer = self._opened(item)
        elif isinstance(item, _Close):
            self._finish()
        elif self._writer is not None and self._written is not None:
            t_utc_s = self._written.t_utc_s + item.t_mono_s - self._written.t_mono_s
            self._writer.write(item.topic, item.message, t_utc_s)

    def _opened(self, file: _Open) -> RecordingWriter:
        now_s = self._now() if file.continues else file.t_mono_s
        return RecordingWriter(
            file.path,
            t_utc_s=file.t_utc_s + now_s - file.t_mono_s,
            t_mono_s=now_s,
            name=file.name,
            by_hand=file.by_hand,
            begun=read_begun(file.path) if file.continues else None,
            write=self._write,
        )

    def _finish(self) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _give_up(self, error: RecordingError) -> RecordingError:
        """What was committed is on disk; it lacks only its index."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.abandon()
        self._failure = (self._written, error)
        return error

    def _look_at_disk(self, *, now: bool = False) -> None:
        now_s = self._now()
        elapsed_s = now_s - self._measured_s
        if elapsed_s < _MEASURE_EVERY_S and not now:
            return
        try:
            before, self._space = self._space, self._measure(self._folder)
        except OSError as error:
            raise describe(error, self._folder) from error
        self._measured_s = now_s
        if before is not None and self._writer is not None and elapsed_s > 0:
            self._rate_bytes_s += 0.1 * (max(0, before.free - self._space.free) / elapsed_s - self._rate_bytes_s)
        if self._space.exhausted and (now or self._writer is not None):
            self._finish()
            raise full(self._folder.name)


def free_path(folder: Path, t_utc_s: float, name: str) -> Path:
    """A file name that does not exist yet: UTC time and what can stand in a name of the plan's."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-")[:40].strip("-")
    stem = f"{datetime.fromtimestamp(t_utc_s, UTC):%Y%m%dT%H%M%SZ}" + (f"_{plain}" if plain else "")
    number = 1
    while (path := folder / f"{stem}{f'_{number}' if number > 1 else ''}.mcap").exists():
        number += 1
    return path
