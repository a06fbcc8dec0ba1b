"""Moving objects for the pages: ten times a second at most, what changes at once, and nothing of a node that died."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

from server.door.page import key_of
from server.heard.node_states import Nodes
from server.heard.present import Present
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_watch import DEAD_S
from server.obstacles.sensor_nodes import SensorNodes
from server.schemas import TracksMessage
from tests.server.fakes import Told
from tests.server.track_messages import tracks_status


class Heard:
    """A watch with a clock that is set by hand."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.told = Told()
        self.alerts: list[Any] = []
        around: Any = SimpleNamespace(on_alert=self.alerts.append)
        self.watch = TracksWatch("live", self.told, around, now_mono_s=lambda: self.now_s, now_utc_s=lambda: 5.0)


def test_pages_hear_ten_times_a_second_at_most() -> None:
    it = Heard()
    for _ in range(100):
        it.watch.on_status(tracks_status())
        it.now_s += 0.02
    assert 15 <= len(it.told) <= 25
    assert it.told[-1].source == "live"
    assert it.told[-1].status.tracks[0].id == 7


def test_another_state_is_told_at_once() -> None:
    it = Heard()
    for state in ("waiting", "running", "running", "frozen"):
        it.watch.on_status(tracks_status(state))
    assert [m.status.state for m in it.told] == ["waiting", "running", "frozen"]


def test_a_node_that_falls_silent_leaves_nothing_behind_and_is_alerted_once() -> None:
    it = Heard()
    it.watch.on_status(tracks_status())
    it.now_s += DEAD_S + 0.1
    it.watch.tick()
    it.watch.tick()
    last = it.told[-1].status
    assert (last.state, last.tracks, last.cones, last.proposal) == ("stale", (), (), None)
    assert "may have died" in last.text
    assert [(a.kind, a.phase) for a in it.alerts] == [("sensor", "begins")]
    it.watch.on_status(tracks_status())
    assert [(a.kind, a.phase) for a in it.alerts] == [("sensor", "begins"), ("sensor", "ends")]
    assert it.alerts[0].id == it.alerts[1].id


def test_one_that_only_waited_is_missed_by_nobody() -> None:
    it = Heard()
    it.watch.on_status(tracks_status("waiting", tracks=()))
    it.now_s += 60.0
    it.watch.tick()
    assert it.alerts == []
    assert it.watch.status is not None
    assert it.watch.status.state == "stale"


def test_manoeuvres_are_made_from_what_is_of_now() -> None:
    it = Heard()
    assert it.watch.fresh() is None
    it.watch.on_status(replace(tracks_status(), t_mono_s=99.5))
    assert it.watch.fresh() == it.watch.status
    it.now_s += 0.6
    assert it.watch.fresh() is None
    it.watch.on_status(replace(tracks_status("frozen"), t_mono_s=it.now_s))
    assert it.watch.fresh() is None


def test_a_proposal_that_flickers_stands_for_a_few_frames() -> None:
    it = Heard()
    it.watch.on_status(tracks_status(t_mono_s=it.now_s))
    it.now_s += 0.4
    it.watch.on_status(tracks_status(t_mono_s=it.now_s, proposal=None))
    kept = it.watch.fresh()
    assert kept is not None
    assert kept.proposal == tracks_status().proposal
    it.watch.on_status(tracks_status(t_mono_s=it.now_s, proposal=None, no_proposal="Too slow."))
    assert it.watch.fresh() == it.watch.status
    it.now_s += 0.2
    it.watch.on_status(tracks_status(t_mono_s=it.now_s, proposal=None))
    assert it.watch.fresh() == it.watch.status


def test_the_age_of_a_proposal_counts_from_its_frame_not_from_its_arrival() -> None:
    it = Heard()
    it.watch.on_status(tracks_status(t_mono_s=it.now_s - 0.8))
    it.watch.on_status(tracks_status(t_mono_s=it.now_s - 0.5, proposal=None))
    kept = it.watch.fresh()
    assert kept is not None
    assert kept.proposal == tracks_status().proposal
    it.now_s += 0.3
    assert it.watch.fresh() == it.watch.status
    assert it.watch.status is not None
    assert it.watch.status.proposal is None


def test_another_recording_forgets_them() -> None:
    it = Heard()
    it.watch.forget()
    assert it.told == []
    it.watch.on_status(tracks_status())
    it.watch.forget()
    assert it.told[-1].status is None
    it.watch.tick()
    assert len(it.told) == 2


def message(source: Any = "live", status: Any = None) -> TracksMessage:
    return TracksMessage(source=source, now_mono_s=1.0, status=status or tracks_status())


def test_a_slow_page_gets_the_latest_of_each_source() -> None:
    assert key_of(message()) == key_of(message(status=tracks_status("frozen")))
    assert key_of(message("replay")) != key_of(message())


def test_a_page_that_opens_later_sees_them_at_once_with_their_age_from_then_on() -> None:
    present = Present(Told())
    for source in ("live", "replay"):
        present.publish(message(source))
    live, replay = cast(list[TracksMessage], present.messages())
    assert live.now_mono_s > 1.0
    assert replay.now_mono_s == 1.0
    present.forget_replay()
    assert [cast(TracksMessage, each).source for each in present.messages()] == ["live"]


class FakeNodes:
    def __init__(self) -> None:
        self.started: list[str] = []

    async def sensor(self, sensor: str) -> None:
        self.started.append(sensor)

    async def tracks(self) -> None:
        self.started.append("tracks")


def test_their_node_runs_beside_the_radars_and_no_other() -> None:
    nodes = FakeNodes()
    asyncio.run(SensorNodes(cast(Any, None), cast(Nodes, nodes)).start("vision", "radar"))
    assert nodes.started == ["vision", "radar", "tracks"]
