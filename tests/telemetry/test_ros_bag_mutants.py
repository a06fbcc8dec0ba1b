"""Damaged and hostile bags: each is read as far as it goes or refused in words, in time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from telemetry.errors import RecordingError
from telemetry.recording.ros.bag import list_bag
from tests.telemetry.bag_mutants import entries, mutant
from tests.telemetry.bags import write_bag

COUNT = 300


@pytest.mark.slow
def test_no_damage_brings_anything_but_words(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.telemetry.bag_mutants", str(tmp_path), str(COUNT)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2], check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["faults"] == []
    assert found["placed"] + found["refused"] == COUNT
    assert min(found["placed"], found["refused"]) > COUNT // 20


@pytest.mark.parametrize("seed", range(3))
def test_through_the_confined_process_as_well(tmp_path: Path, seed: int) -> None:
    bag = write_bag(tmp_path, "ros1", entries("ros1"))
    (tmp_path / "cut").mkdir()
    path = mutant(bag, tmp_path / "cut", np.random.default_rng(seed))
    path.write_bytes(path.read_bytes()[: 1000 + 500 * seed])
    with pytest.raises(RecordingError) as caught:
        list_bag(path)
    assert caught.value.where == "run.bag"
    assert caught.value.advice
