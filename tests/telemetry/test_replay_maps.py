"""Maps, regions and alerts played again: wherever a replay is moved to, the map is the one of then."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.player import Due, Player
from telemetry.topics.deltas import FoldedMap, in_parts
from telemetry.topics.messages import REPLAY_PREFIX, Published, Topic
from telemetry.topics.obstacles import MapDelta, MapOrigin, Obstacle, ObstacleAlert, PerceptionStatus
from tests.telemetry import perception_flights as flights
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S, opened, state_at

NOW_S = 90_000.0
SECONDS = 200
CLEARED_S = 120
ORIGIN = MapOrigin(*flights.HOME)
OBSTACLE = Obstacle("roi", 5.0, 0.0, 0.0, 1.0, None, (0.0, 5.0, 0.0), 45.0, 10.0, 120.0, 3, (1.0, 1.0, 1.0))


def delta(t_s: float, keys: list[list[int]], *, whole: bool = False, sensor: str = "radar") -> list[MapDelta]:
    head = MapDelta(sensor, T0_MONO_S + t_s, T0_UTC_S + t_s, int(t_s * 10), whole, 0, 1, ORIGIN, 1.0, b"", b"", b"")  # type: ignore[arg-type]
    n = len(keys)
    return in_parts(head, np.array(keys, np.int32).reshape(-1, 3), np.full(n, 200, np.uint8), np.zeros(n, np.uint8))


def flight() -> Iterator[tuple[float, str, Published]]:
    """A voxel every half second; the radar's map begins afresh at 120 s, the camera's with every frame."""
    t_s = 0.0
    for k in range(2 * SECONDS):
        t_s = k / 2 + 0.25
        yield t_s, Topic.VEHICLE, state_at(t_s)
        yield t_s, Topic.RADAR_FRAME, flights.radar_frame(t_s, k, T0_MONO_S, T0_UTC_S)
        yield t_s, Topic.CLOUD_FRAME, flights.cloud_frame(t_s, k, T0_MONO_S, T0_UTC_S, count=10)
        if t_s > 10.0:
            for part in delta(t_s, [[k, -k, 3]], whole=k in (20, 2 * CLEARED_S)):
                yield t_s, Topic.MAP_RADAR, part
            for part in delta(t_s, [[k, 0, 0], [k, 1, 0]], whole=True, sensor="vision"):
                yield t_s, Topic.MAP_VISION, part
        status = PerceptionStatus("radar", "running", "", T0_MONO_S + t_s, T0_UTC_S + t_s, T0_MONO_S + t_s)
        yield t_s, Topic.PERCEPTION_RADAR, replace(status, obstacles=(OBSTACLE,), sweep_m=(None, 2.0))
    alert = ObstacleAlert("a-1", "radar", "obstacle", "begins", T0_MONO_S + t_s, T0_UTC_S + t_s, T0_MONO_S + t_s, "!")
    yield t_s, Topic.ALERT, alert


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("maps") / "a.mcap"
    clock = [0.0]
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, now=lambda: clock[0])
    for t_s, topic, message in flight():
        clock[0] = t_s
        writer.write(topic, message, T0_UTC_S + t_s)
    writer.close()
    return path


@pytest.fixture
def player(path: Path) -> Iterator[Player]:
    with opened(path, NOW_S) as player:
        yield player


def move(player: Player, t_s: float) -> list[Due]:
    return player.play(NOW_S, playing=False, at_utc_s=T0_UTC_S + t_s, speed=None)


def keys_of(due: list[Due], topic: str) -> list[list[int]]:
    deltas = [message for name, message in due if name == topic and isinstance(message, MapDelta)]
    assert deltas[0].whole
    return FoldedMap().folded(deltas).voxels.keys.tolist()


@pytest.mark.parametrize("at_s", [199.0, 10.6, 119.9, 120.4, 3.0, 150.2, 60.1])
def test_moved_to_any_time_the_map_is_the_one_of_then(player: Player, at_s: float) -> None:
    for t_s in (90.0, at_s, 180.0, at_s):
        due = move(player, t_s)
    last = int((at_s - 0.25) * 2)
    first = 2 * CLEARED_S if at_s > CLEARED_S + 0.25 else 20
    assert keys_of(due, Topic.MAP_RADAR) == [[k, -k, 3] for k in range(first, last + 1)]
    assert keys_of(due, Topic.MAP_VISION) == ([[last, 0, 0], [last, 1, 0]] if at_s > 10.0 else [])


def test_from_there_on_it_grows_as_it_did(player: Player) -> None:
    due = move(player, 50.1)
    before = keys_of(due, Topic.MAP_RADAR)
    player.play(NOW_S, playing=True, at_utc_s=None, speed=None)
    for step in range(1, 11):
        due += player.on_tick(NOW_S + step * 0.2)
    assert len(keys_of(due, Topic.MAP_RADAR)) == len(before) + 4
    assert {topic for topic, _ in due} & {Topic.RADAR_FRAME, Topic.CLOUD_FRAME, Topic.TRUTH} == set()


def test_paused_the_map_is_not_told_again(player: Player) -> None:
    move(player, 50.0)
    topics = {topic for step in range(1, 20) for topic, _ in player.on_tick(NOW_S + step)}
    assert Topic.VEHICLE in topics
    assert Topic.PERCEPTION_RADAR in topics
    assert Topic.MAP_RADAR not in topics


def test_alerts_and_what_was_known_of_obstacles_come_back_whole(path: Path) -> None:
    with open_recording(path) as recording:
        (alert,) = [entry.message for entry in recording.entries((Topic.ALERT,))]
        assert isinstance(alert, ObstacleAlert)
        status = next(iter(recording.entries((Topic.PERCEPTION_RADAR,)))).message
        assert isinstance(status, PerceptionStatus)
        assert status.obstacles == (OBSTACLE,)
        assert status.sweep_m == (None, 2.0)
        assert recording.faults == []
    assert not any(str(topic).startswith(REPLAY_PREFIX) for topic in recording.topics())
