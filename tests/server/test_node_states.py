"""How long is waited for a node, which may have to load what it needs first; and what is done with one left behind."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any, cast

import pytest

from server.heard import node_states
from server.heard.node_states import _CALL_TIMEOUT_S, Nodes
from server.work.supervisor import NodeState, State
from telemetry.bus.liveness import START_S
from telemetry.topics.recording_requests import CloseRecording, ReplayRequest, StartRecording
from tests.server.fakes import Told


class Bus:
    """Keeps how long each call may take."""

    def __init__(self) -> None:
        self.patience_s: list[float] = []

    async def call(self, name: str, request: object, *, timeout_s: float, **_: object) -> None:
        self.patience_s.append(timeout_s)


class Supervised:
    """Every node is in the same state, whoever starts it."""

    def __init__(self, state: State) -> None:
        self.states = [NodeState(name, state) for name in ("link", "recorder", "replay")]

    async def start(self, name: str, arguments: list[str]) -> None:
        assert name in {state.name for state in self.states}


@pytest.mark.parametrize(
    ("state", "patience_s"),
    [
        ("starting", _CALL_TIMEOUT_S + START_S),
        ("running", _CALL_TIMEOUT_S),
        ("silent", _CALL_TIMEOUT_S),
        ("restarting", _CALL_TIMEOUT_S),  # it has failed before: soon said
    ],
)
def test_one_that_still_loads_is_waited_for_as_long_as_it_may_load(
    state: State, patience_s: float, tmp_path: Path
) -> None:
    bus = Bus()
    nodes = Nodes(cast(Any, bus), tmp_path, tmp_path, Told())
    nodes.supervisor = cast(Any, Supervised(state))

    async def whole() -> None:
        request: ReplayRequest = CloseRecording()
        await nodes.ask_replay(request)
        await nodes.ask_recorder(StartRecording())

    asyncio.run(whole())
    assert bus.patience_s == [patience_s, patience_s]


def test_a_node_that_an_earlier_server_left_running_is_ended_where_no_stations_are_met(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It would go on telling others of vehicles, under a name that this server does not have."""
    nodes = Nodes(cast(Any, None), tmp_path, tmp_path, Told())
    running, stopped = [True], list[str]()

    async def stop(name: str) -> None:
        stopped.append(name)
        running[0] = len(stopped) < 3  # at first it is not taken over yet

    monkeypatch.setattr(nodes.supervisor, "stop", stop)
    monkeypatch.setattr(node_states, "_LOOK_AGAIN_S", 0.0)
    monkeypatch.setattr(node_states, "running_node", lambda folder, name: name if running[0] else None)
    asyncio.run(nodes.no_stations())
    assert stopped == ["stations"] * 3
