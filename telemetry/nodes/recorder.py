"""The recorder node: ``python -m telemetry.nodes.recorder --runtime DIR --recordings DIR``.

It lives on when the server dies, and ends by itself when nothing is recorded and no server has been there for long.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from telemetry.bus.bus import Bus
from telemetry.bus.node import LOOK_EVERY_S, NodeContext, run_node
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.continuing import find_unfinished
from telemetry.recording.mcap_files.mend import mend
from telemetry.recording.recorder import Recorder
from telemetry.topics.messages import RecorderStatus, Topic
from telemetry.topics.recording_requests import RecorderRequest, StartRecording

_log = logging.getLogger(__name__)

WORK_EVERY_S = 0.1
"""What is lost at SIGKILL is what came in this time, and what waits in the bus."""
_STATUS_EVERY_S = 1.0
_MOST_UNREAD = 20_000


class RecorderNode:
    """A recorder on the bus. Files are written by one thread of its own, messages are taken in the event loop."""

    def __init__(self, bus: Bus, context: NodeContext, folder: Path) -> None:
        self._bus, self._context, self._folder = bus, context, folder
        # The flight that a recorder was killed in goes on in the same file.
        self._going_on = find_unfinished(folder, t_utc_s=time.time(), t_mono_s=time.monotonic())
        self._recorder = Recorder(folder, unfinished=self._going_on)
        self._disk = ThreadPoolExecutor(1, thread_name_prefix="recording")
        self._told: RecorderStatus | None = None
        self._dropped = 0
        self._heard_mono_s = time.monotonic()

    async def run(self) -> None:
        """Until nobody needs it any more; a running recording is finished when this is cancelled."""
        await self._bus.serve("recorder", self._handle, RecorderRequest)
        try:
            async with asyncio.TaskGroup() as group:
                tasks = [group.create_task(part()) for part in (self._listen, self._mend)]
                await self._work()
                for task in tasks:
                    task.cancel()
        finally:
            self._recorder.stop()
            await self._write()
            self._disk.shutdown()

    async def _listen(self) -> None:
        subscription = self._bus.subscribe("**", keep_all=True, limit=_MOST_UNREAD)
        try:
            async for topic, message in subscription:
                if topic == Topic.VEHICLE:
                    self._heard_mono_s = time.monotonic()
                self._recorder.on_message(topic, message)
                if subscription.dropped + self._recorder.dropped > self._dropped:
                    self._dropped = subscription.dropped + self._recorder.dropped
                    _log.warning("%d messages came faster than they could be recorded", self._dropped)
        finally:
            subscription.close()

    async def _work(self) -> None:
        """A disk that takes its time holds up what is written, not this: the node is alive all the same."""
        writing = asyncio.ensure_future(self._keep_writing())
        try:
            while self._context.is_needed(self._heard_mono_s if self._recorder.recording else None):
                self._context.set_replaceable(not self._recorder.recording)
                await asyncio.wait((writing,), timeout=LOOK_EVERY_S)
                if writing.done():
                    break
        finally:
            writing.cancel()
            await asyncio.wait((writing,))
        if not writing.cancelled():
            writing.result()

    async def _keep_writing(self) -> None:
        while True:
            await self._write()
            await asyncio.sleep(WORK_EVERY_S)

    async def _write(self) -> None:
        loop = asyncio.get_running_loop()
        error = await loop.run_in_executor(self._disk, self._recorder.work)
        if error is not None:
            _log.error("%s", error)
        self._recorder.on_tick()
        self._tell()

    def _tell(self) -> None:
        status, told = self._recorder.status(), self._told
        if told is None or status.t_mono_s - told.t_mono_s >= _STATUS_EVERY_S or _differ(status, told):
            self._told = status
            self._bus.publish(Topic.RECORDER, status)

    async def _handle(self, request: RecorderRequest) -> str | None:
        """Answers when the file is there, or when it is finished."""
        name = None
        if isinstance(request, StartRecording):
            name = self._recorder.start(request.name)
        else:
            self._recorder.stop()
        await self._write()
        if name is not None and (error := self._recorder.error) is not None:
            raise error
        return name

    async def _mend(self) -> None:
        """Recordings of a killed recorder get their index."""
        await asyncio.to_thread(mend_all, self._folder, but=self._going_on.path if self._going_on else None)


def _differ(status: RecorderStatus, told: RecorderStatus) -> bool:
    return (status.recording, status.name, status.error is None) != (told.recording, told.name, told.error is None)


def mend_all(folder: Path, *, but: Path | None = None) -> None:
    """What cannot be mended is logged and left as it is."""
    for path in sorted(set(folder.glob("*.mcap")) - {but}):
        started_s = time.monotonic()
        try:
            if mend(path):
                _log.info("%s had not been finished and was mended in %.1f s", path.name, time.monotonic() - started_s)
        except RecordingError as error:
            _log.warning("%s", error)


def main() -> int:
    parser = argparse.ArgumentParser(prog="recorder", description="Records flights.")
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    parser.add_argument("--recordings", type=Path, required=True, help="where the files go")
    options = parser.parse_args()
    folder: Path = options.recordings
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    async def live(bus: Bus, context: NodeContext) -> None:
        await RecorderNode(bus, context, folder).run()

    return run_node("recorder", options.runtime, live)


if __name__ == "__main__":
    sys.exit(main())
