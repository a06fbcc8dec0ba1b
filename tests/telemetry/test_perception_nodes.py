"""Perception nodes as processes: each does its work whatever happens to the other, and recordings give the same map."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from server.cli import app
from telemetry.perception.rebuilding.rebuild import rebuild
from telemetry.perception.sensor_kinds import KINDS
from telemetry.topics.deltas import FoldedMap
from telemetry.topics.looks import CloudLook, points_enu_m
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import MapDelta, PerceptionSettings
from telemetry.topics.recording_requests import StartRecording, StopRecording
from telemetry.topics.requests import WholeMap
from tests.telemetry import perception_flights as flights
from tests.telemetry.perception_processes import PATIENCE_S, Processes, Sky, fly


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    started = Processes(tmp_path)
    yield started
    started.end()


def obstacle_alerts(sky: Sky, sensor: str) -> int:
    return sum(a.sensor == sensor and a.kind == "obstacle" and a.phase == "begins" for a in sky.alerts)


def kill(processes: Processes, sky: Sky, sensor: str) -> None:
    processes.send(sensor, signal.SIGKILL)


def freeze(processes: Processes, sky: Sky, sensor: str) -> None:
    processes.send(sensor, signal.SIGSTOP)


def feed_garbage(processes: Processes, sky: Sky, sensor: str) -> None:
    for number in range(300):
        if sensor == "vision":
            cloud = flights.cloud_frame(0.0, number, 1e12, 1e12, count=10)
            sky.bus.publish(Topic.CLOUD_FRAME, replace(cloud, xyz_m=os.urandom(1 + number)))
        else:
            frame = flights.radar_frame(0.0, 10_000 + number, 1e12, 1e12)
            sky.bus.publish(Topic.RADAR_FRAME, replace(frame, xyz_m=os.urandom(1 + number)))


async def alerts_on_time(sky: Sky, sensor: str) -> None:
    """Within the second in which the wall comes into the region, whatever this machine does besides."""
    before, done = obstacle_alerts(sky, sensor), len(sky.statuses[sensor])
    sky.begin_anew()
    await sky.until(lambda: obstacle_alerts(sky, sensor) > before)
    accepted = [status for status in sky.statuses[sensor][done:] if status.points > 0]
    assert len(accepted) > {"radar": 20, "vision": 12}[sensor]
    late = sorted(status.done_t_mono_s - status.t_mono_s for status in accepted)
    assert late[len(late) // 2] < 0.5
    alert = next(a for a in reversed(sky.alerts) if a.sensor == sensor and a.phase == "begins")
    assert alert.obstacle is not None
    depth_m = {"radar": PerceptionSettings().radar_depth_m, "vision": PerceptionSettings().vision_depth_m}[sensor]
    assert alert.done_t_mono_s <= sky.reaches_mono_s(flights.WALL_NORTH_M - depth_m) + 1.0


def places_of_whole(deltas: list[MapDelta]) -> list[int]:
    return [place for place, delta in enumerate(deltas) if delta.whole]


async def works(sky: Sky, sensor: str) -> None:
    told = len(sky.statuses[sensor])
    await sky.until(lambda: any(status.points for status in sky.statuses[sensor][told:]))


@pytest.mark.parametrize(("harmed", "other"), [("vision", "radar"), ("radar", "vision")])
def test_harm_to_one_leaves_the_others_alerts_on_time(processes: Processes, harmed: str, other: str) -> None:
    """One harm after another: each finds a node that works."""
    processes.start("radar")
    processes.start("vision")

    async def act(sky: Sky) -> None:
        await works(sky, other)
        for harm in (feed_garbage, kill, freeze):
            try:
                await works(sky, harmed)
                harm(processes, sky, harmed)
                await alerts_on_time(sky, other)
            except BaseException as error:
                error.add_note(f"{harm.__name__} {harmed}")
                raise
            if processes.nodes[harmed].poll() is not None:
                processes.start(harmed)

    fly(processes, act)


def test_a_node_that_gets_garbage_says_so_and_goes_on(processes: Processes) -> None:
    processes.start("radar")

    async def act(sky: Sky) -> None:
        await sky.until(lambda: any(s.points for s in sky.statuses["radar"]))
        for number in range(50):
            frame = flights.radar_frame(0.0, 10_000 + number, 1e12, 1e12)
            sky.bus.publish(Topic.RADAR_FRAME, replace(frame, snr_db=os.urandom(7)))
        sky.bus._session.put(f"live/{Topic.RADAR_FRAME.value}", b"\xc1 no message at all")
        await sky.until(lambda: any(c.what == "broken frame" for c in sky.statuses["radar"][-1].dropped))
        told = len(sky.statuses["radar"])
        await sky.until(lambda: any(s.points and s.state == "running" for s in sky.statuses["radar"][told:]))
        assert processes.nodes["radar"].poll() is None

    fly(processes, act, sensors=("radar",))


def test_the_camera_tells_its_map_of_the_whole_flight_and_what_its_newest_frame_showed(processes: Processes) -> None:
    processes.start("vision")

    async def act(sky: Sky) -> None:
        deltas: list[MapDelta] = []
        looks: list[CloudLook] = []
        hearing = [
            asyncio.ensure_future(sky.hear(Topic.MAP_VISION_FLIGHT, deltas)),
            asyncio.ensure_future(sky.hear(Topic.CLOUD_LOOK, looks)),
        ]
        await sky.until(lambda: len(deltas) > 1 and len(looks) > 1)
        sky.frames = sky.again = False
        await sky.until(lambda: sky.statuses["vision"][-1].state == "stale")
        told = len(deltas)
        await sky.bus.call("vision", WholeMap(), result=type(None), timeout_s=PATIENCE_S)
        # Told once a second: what the last frame changed may come after the camera is called stale.
        whole = told + (await sky.until(lambda: places_of_whole(deltas[told:])))[0]
        status = sky.statuses["vision"][-1].flight_map
        assert status is not None
        late = FoldedMap().folded(deltas[whole:]).voxels
        assert len(late.keys) == status.voxels_occupied > 20
        np.testing.assert_array_equal(late.keys, FoldedMap().folded(deltas[:whole]).voxels.occupied().keys)
        assert np.abs(points_enu_m(looks[-1])[:, 1] - flights.WALL_NORTH_M).max() < 5.0
        for task in hearing:
            task.cancel()

    fly(processes, act, sensors=("vision",))


def test_it_speaks_every_second_without_frames_and_gives_its_map_to_who_comes_late(processes: Processes) -> None:
    processes.start("ranges")

    async def act(sky: Sky) -> None:
        sky.frames = False
        first = await sky.until(lambda: sky.statuses["ranges"] and sky.statuses["ranges"][-1])
        assert first.state == "waiting"
        assert first.text
        sky.frames = True
        sky.begin_anew()
        await sky.until(lambda: any(s.points and s.voxels_occupied > 3 for s in sky.statuses["ranges"]))
        sky.frames = sky.again = False
        await sky.until(lambda: sky.statuses["ranges"][-1].state == "stale")
        assert "Check the sensor" in sky.statuses["ranges"][-1].text
        deltas, told = sky.deltas["ranges"], len(sky.deltas["ranges"])
        await sky.bus.call("ranges", WholeMap(), result=type(None), timeout_s=PATIENCE_S)
        whole = told + (await sky.until(lambda: places_of_whole(deltas[told:])))[0]
        seen, late = FoldedMap().folded(deltas[:whole]), FoldedMap().folded(deltas[whole : whole + 1])
        np.testing.assert_array_equal(late.voxels.keys, seen.voxels.occupied().keys)
        sky.bus.publish(Topic.PERCEPTION_SETTINGS, PerceptionSettings(clear_count=1))
        await sky.until(lambda: sky.deltas["ranges"][-1].whole and not sky.deltas["ranges"][-1].keys)

    fly(processes, act, sensors=("ranges",))


def test_the_mission_ahead_is_checked_before_any_region_holds_the_wall(processes: Processes) -> None:
    processes.start("radar")

    async def act(sky: Sky) -> None:
        sky.bus.publish(Topic.PLAN, flights.mission())
        found = await sky.until(lambda: next((s for s in sky.statuses["radar"] if s.conflict is not None), None))
        assert found.conflict is not None
        assert found.conflict.item == 3
        assert 0.0 < found.conflict.ahead_m < 45.0
        assert found.conflict.enu_m[1] == pytest.approx(flights.WALL_NORTH_M, abs=2.0)
        conflict = await sky.until(lambda: next((a for a in sky.alerts if a.kind == "conflict"), None))
        assert conflict.phase == "begins"
        assert "item 3" in conflict.text

    fly(processes, act, sensors=("radar",))


def test_a_recording_gives_the_very_map_that_was_there_in_flight(processes: Processes, tmp_path: Path) -> None:
    """Voxel for voxel, for both sensors; also after the radar's node had died in between."""
    processes.recordings.mkdir()
    processes.start("recorder", "--recordings", str(processes.recordings))
    processes.start("radar")
    processes.start("vision")
    live: dict[str, FoldedMap] = {}
    name = ""

    async def act(sky: Sky) -> None:
        nonlocal name
        sky.armed = False
        name = await sky.bus.call("recorder", StartRecording("map"), result=str, timeout_s=PATIENCE_S)
        for sensor in sky.sensors:
            await sky.until(lambda sensor=sensor: sky.statuses[sensor])
        sky.begin_anew()
        sky.armed, sky.again = True, False
        await sky.until(lambda: any(s.frames > 30 for s in sky.statuses["radar"]))
        await sky.until(lambda: any(s.frames > 15 for s in sky.statuses["vision"]))
        sky.frames = False
        for sensor in sky.sensors:
            await sky.until(lambda sensor=sensor: sky.statuses[sensor][-1].state == "stale")
            live[sensor] = FoldedMap().folded(sky.deltas[sensor])
        await sky.bus.call("recorder", StopRecording(), result=type(None), timeout_s=PATIENCE_S)

    fly(processes, act)
    path = processes.recordings / name
    for sensor, folded in live.items():
        built = rebuild(path, KINDS[sensor])
        assert built.notes == ()
        assert built.frames > 15
        assert len(folded.voxels.keys) > 10
        for one, other in (
            (built.folded.voxels.keys, folded.voxels.keys),
            (built.folded.voxels.probability, folded.voxels.probability),
            (built.folded.voxels.explained, folded.voxels.explained),
        ):
            np.testing.assert_array_equal(one, other)
    result = CliRunner().invoke(
        app, ["map", str(path), "--sensor", "radar", "--out", str(tmp_path / "radar.ply"), "--json"]
    )
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    names = ["frames", "dropped", "points", "voxels_occupied", "resolution_m", "left_out", "extent_m", "seconds"]
    assert list(found) == names
    assert found["voxels_occupied"] == len(live["radar"].voxels.occupied().keys)
    assert (tmp_path / "radar.ply").read_bytes().startswith(b"ply")
