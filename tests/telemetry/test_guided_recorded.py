"""The navigation script on a recorded flight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from telemetry.flight.guided.guided import GuidedScript
from telemetry.mavlink.actions import Action, Send
from telemetry.mavlink.reduce import reduce
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.requests import StartGuided
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.guided_requests import request
from tests.telemetry.lossy import VEHICLE


def recorded(path: Path) -> list[tuple[float, Any]]:
    log = mavutil.mavlink_connection(str(path))
    messages = []
    try:
        while (message := log.recv_match(blocking=False)) is not None:
            messages.append((message._timestamp, message))
    finally:
        log.close()
    return messages


def test_on_the_recorded_flight_targets_are_handed_over_when_the_recorded_script_did(shared_data: Path) -> None:
    """The recorded states drive the script; its targets must come in the recorded order, near the recorded times."""
    messages = recorded(shared_data / "logs" / "arducopter" / "guided.tlog")
    theirs = [(t, m) for t, m in messages if m.get_type() == "SET_POSITION_TARGET_GLOBAL_INT"]
    ready_s = next(t for t, m in messages if m.get_type() == "COMMAND_ACK" and (m.command, m.result) == (400, 0))
    targets = tuple(
        GuidedTarget(k, m.lat_int * 1e-7, m.lon_int * 1e-7, m.alt, 3.0) for k, (_, m) in enumerate(theirs, start=2)
    )
    asked = replace(request(targets), takeoff_alt_rel_home_m=13.55)
    ours = replay(messages, asked, from_s=ready_s - 0.01)
    assert len(ours) == len(theirs) == 30
    for (_, sent), (_, recorded_one) in zip(ours, theirs, strict=True):
        assert (sent.lat_int, sent.lon_int) == (recorded_one.lat_int, recorded_one.lon_int)
        assert sent.alt == pytest.approx(recorded_one.alt, abs=1e-5)
    apart_s = [our_s - their_s for (our_s, _), (their_s, _) in zip(ours, theirs, strict=True)]
    assert max(map(abs, apart_s[:2])) < 4.0  # the recorded script stood still for a while after the take-off
    assert max(map(abs, apart_s[2:])) < 0.5


def replay(messages: list[tuple[float, Any]], asked: StartGuided, *, from_s: float) -> list[tuple[float, Any]]:
    """Targets that the script hands over, each once, when it hears a recorded vehicle."""
    state: VehicleState | None = None
    machine: GuidedScript | None = None
    out: dict[tuple[int, int, float], tuple[float, Any]] = {}
    for t, message in messages:
        if message.get_srcSystem() != 1:
            continue
        state = reduce(state, message, t_mono_s=t, t_utc_s=t)
        if state is None or t < from_s:
            continue
        actions: list[Action] = []
        if machine is None:
            machine = GuidedScript(
                replace(asked, takeoff_alt_rel_home_m=13.55), state, firmware="ardupilot", target=VEHICLE
            )
            actions += machine.start(t)
        actions += [*machine.on_message(message, t), *machine.on_state(state, t), *machine.on_tick(t)]
        for action in actions:
            if isinstance(action, Send) and action.message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
                place = (action.message.lat_int, action.message.lon_int, action.message.alt)
                out.setdefault(place, (t, action.message))
    return list(out.values())
