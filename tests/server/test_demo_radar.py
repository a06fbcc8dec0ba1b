"""How the demo's radar is simulated, from the option to the node's arguments."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import pytest

from server.errors import StartError
from server.heard.ground_task import Ground
from server.heard.node_states import SIMULATED_SENSORS, Nodes
from server.settings import load_settings
from telemetry.topics.vehicle import RadarKind
from tests.server.fakes import Told


@pytest.mark.parametrize("kind", ["model", "iq"])
def test_the_sensors_node_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: RadarKind) -> None:
    started: list[tuple[str, Sequence[str]]] = []

    async def start(name: str, arguments: Sequence[str]) -> None:
        started.append((name, arguments))

    nodes = Nodes(cast(Any, None), tmp_path, tmp_path, Told(), demo_radar=kind)
    monkeypatch.setattr(nodes.supervisor, "start", start)
    asyncio.run(nodes.simulated_sensors(Ground(tmp_path / "ground.tif", 0.0, 0.0, 0.0), tmp_path / "world.json"))
    (name, arguments), = started  # fmt: skip
    assert name == SIMULATED_SENSORS
    assert arguments[arguments.index("--radar") + 1] == kind


def test_it_is_a_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_settings().demo_radar == "model"
    monkeypatch.setenv("HEDGEHOP_DEMO_RADAR", "iq")
    assert load_settings().demo_radar == "iq"
    assert load_settings(demo_radar="model").demo_radar == "model"
    with pytest.raises(StartError) as refused:
        load_settings(demo_radar="sonar")
    assert "demo_radar" in refused.value.where
    assert "'model' or 'iq'" in str(refused.value)
