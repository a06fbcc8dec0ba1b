"""Examples of the documents are what the programs take."""

from __future__ import annotations

import ast
import json
import sys
import time
import tomllib
from pathlib import Path

import pytest

from planning.missions.vehicle_profile import parse_profile
from telemetry.agent.client import RadarReading
from telemetry.agent.driver_lines import reading_of
from telemetry.simulation.simulator.scene.world_file import read_world
from tests.docs.pages import DOCS, PAGES, blocks, rows
from tests.server.running import running

EXAMPLES = [block for page in PAGES for block in blocks(page)]


def test_python_examples_are_python() -> None:
    found = [block for block in EXAMPLES if block.language == "python"]
    assert found
    for block in found:
        ast.parse(block.text)


def test_json_and_toml_examples_are_well_formed() -> None:
    for block in EXAMPLES:
        if block.language == "json":
            json.loads(block.text)
        elif block.language == "toml":
            tomllib.loads(block.text)


def test_the_vehicle_profile_is_accepted() -> None:
    (example,) = [block for block in blocks(DOCS / "vehicle-profile.md") if block.language == "toml"]
    assert parse_profile(example.text.encode(), where="example").rotors == 6


def test_the_world_is_accepted(tmp_path: Path) -> None:
    (example,) = [block for block in blocks(DOCS / "own-world.md") if block.language == "json"]
    file = tmp_path / "site.json"
    file.write_text(example.text, encoding="utf-8")
    assert len(read_world(file).shapes) == 3


def test_the_driver_writes_lines_that_the_agent_takes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (example,) = [block for block in blocks(DOCS / "own-sensor.md") if block.language == "python"]
    monkeypatch.setattr(time, "sleep", sys.exit)
    with pytest.raises(SystemExit):
        exec(compile(example.text, "driver.py", "exec"), {})
    reading = reading_of(capsys.readouterr().out.encode(), now_s=0.0)
    assert isinstance(reading, RadarReading)
    assert reading.targets.tolist() == [pytest.approx([0.5, 12.0, 0.2, -3.1, 18.0])]


def test_what_lies_in_a_data_directory_is_on_the_page(tmp_path: Path) -> None:
    told = "".join(row[0] for row in rows("files", "name"))
    with running(tmp_path / "data"):
        names = {path.name for path in (tmp_path / "data").iterdir()}
    assert "plans" in names
    assert [name for name in sorted(names) if name not in told] == []
