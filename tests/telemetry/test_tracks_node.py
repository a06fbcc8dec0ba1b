"""The tracks node as a process: on the bus, recorded, and on time whatever happens to it or beside it."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from telemetry.bus.bus import Bus
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.topics.messages import ServerAlive, Topic
from telemetry.topics.obstacles import ObstacleAlert, PerceptionStatus
from telemetry.topics.recording_requests import StartRecording, StopRecording
from telemetry.topics.tracks import TracksStatus
from tests.telemetry import perception_flights as flights
from tests.telemetry.moving_flights import frame, straight
from tests.telemetry.perception_processes import PATIENCE_S, Flight, Processes, flown

FLOWN_S = 9.0
"""After that the flight begins anew: what came head-on has been met."""
HEAD_ON = straight((0.0, 76.0), (0.0, -4.0))


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    started = Processes(tmp_path)
    yield started
    started.end()


class Sky(Flight):
    """Flies northwards again and again, each time towards something that comes head-on."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus)
        self.tracks: list[TracksStatus] = []
        self.maps: list[PerceptionStatus] = []
        self.alerts: list[ObstacleAlert] = []
        self.frames = True
        self._number = 0

    async def live(self) -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(self._fly())
            for topic, into in (
                (Topic.TRACKS, self.tracks),
                (Topic.PERCEPTION_RADAR, self.maps),
                (Topic.ALERT, self.alerts),
            ):
                group.create_task(self.hear(topic, into))

    def begun(self) -> int:
        return sum(alert.kind == "approach" and alert.phase == "begins" for alert in self.alerts)

    async def _fly(self) -> None:
        """States at 20 Hz, frames at 10 Hz; between two flights it stands at home for a second, disarmed."""
        while True:
            t0_mono_s, t0_utc_s = time.monotonic() + 1.0, time.time() + 1.0
            tick = 0
            while (t_s := time.monotonic() - t0_mono_s) < FLOWN_S:
                self.bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), 1))
                self.bus.publish(Topic.VEHICLE, flights.state_at(t_s, t0_mono_s, t0_utc_s, armed=t_s >= 0.0))
                if self.frames and t_s >= 0.0 and tick % 2 == 0:
                    self._number += 1
                    made = frame(t_s, self._number, [HEAD_ON], t0_mono_s=t0_mono_s, t0_utc_s=t0_utc_s)
                    self.bus.publish(Topic.RADAR_FRAME, made)
                tick += 1
                await asyncio.sleep(0.05)


def fly(processes: Processes, act: Callable[[Sky], Awaitable[object]]) -> None:
    """Runs ``act`` while flights go on."""
    flown(processes, Sky, act)


def moving(status: TracksStatus) -> bool:
    return any(track.moving for track in status.tracks)


def test_what_comes_near_is_told_recorded_and_alerted_before_it_is_near(processes: Processes) -> None:
    processes.recordings.mkdir()
    processes.start("recorder", "--recordings", str(processes.recordings))
    processes.start("tracks")
    name = ""

    async def act(sky: Sky) -> None:
        nonlocal name
        name = await sky.bus.call("recorder", StartRecording("tracks"), result=str, timeout_s=PATIENCE_S)
        await sky.until(lambda: any(moving(status) for status in sky.tracks))
        await sky.until(sky.begun)
        await sky.until(lambda: any(alert.phase == "ends" for alert in sky.alerts))
        sky.frames = False
        await sky.until(lambda: sky.tracks[-1].state == "stale" and not sky.tracks[-1].tracks)
        await sky.bus.call("recorder", StopRecording(), result=type(None), timeout_s=PATIENCE_S)
        first = next(alert for alert in sky.alerts if alert.phase == "begins")
        assert first.text.startswith("Moving object ")
        status = next(s for s in sky.tracks if s.t_mono_s == first.t_mono_s)
        assert status.tracks[0].range_m > 3 * status.safety_radius_m
        assert status.cones
        assert status.proposal is not None

    fly(processes, act)
    with open_recording(processes.recordings / name) as recording:
        kept = [entry.message for entry in recording.entries([Topic.TRACKS])]
    assert any(isinstance(status, TracksStatus) and moving(status) for status in kept)


def test_harm_to_it_leaves_the_radars_map_on_time(processes: Processes) -> None:
    processes.start("radar")
    processes.start("tracks")

    async def act(sky: Sky) -> None:
        await sky.until(lambda: any(moving(status) for status in sky.tracks))
        await sky.until(lambda: any(status.points for status in sky.maps))
        for harm in (signal.SIGSTOP, signal.SIGKILL):
            processes.send("tracks", harm)
            told = len(sky.maps)
            await sky.until(lambda told=told: sum(status.points > 0 for status in sky.maps[told:]) > 25)
            late = sorted(s.done_t_mono_s - s.t_mono_s for s in sky.maps[told:] if s.points)
            assert late[len(late) // 2] < 0.5

    fly(processes, act)


def test_harm_to_the_radars_map_leaves_its_alerts_on_time(processes: Processes) -> None:
    processes.start("radar")
    processes.start("tracks")

    async def act(sky: Sky) -> None:
        await sky.until(lambda: any(status.points for status in sky.maps))
        await sky.until(lambda: any(moving(status) for status in sky.tracks))
        processes.send("radar", signal.SIGSTOP)
        before, told = sky.begun(), len(sky.tracks)
        await sky.until(lambda: sky.begun() > before)
        late = sorted(s.done_t_mono_s - s.t_mono_s for s in sky.tracks[told:] if s.detections)
        assert late[len(late) // 2] < 0.5

    fly(processes, act)


def test_garbage_is_said_and_it_goes_on(processes: Processes) -> None:
    processes.start("tracks")

    async def act(sky: Sky) -> None:
        await sky.until(lambda: any(moving(status) for status in sky.tracks))
        for number in range(300):
            made = frame(0.0, 10_000 + number, [HEAD_ON], t0_mono_s=1e12, t0_utc_s=1e12)
            sky.bus.publish(Topic.RADAR_FRAME, replace(made, snr_db=os.urandom(7)))
        sky.bus._session.put(f"live/{Topic.RADAR_FRAME.value}", b"\xc1 no message at all")
        sky.bus.publish(Topic.PLAN, replace(flights.mission(), profile_toml="max_speed_m_s = \x00"))
        await sky.until(lambda: any(count.what == "broken frame" for count in sky.tracks[-1].dropped))
        told, begun = len(sky.tracks), sky.begun()
        await sky.until(lambda: any(moving(status) for status in sky.tracks[told:]))
        await sky.until(lambda: sky.begun() > begun)
        assert processes.nodes["tracks"].poll() is None

    fly(processes, act)
