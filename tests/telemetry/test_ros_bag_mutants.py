"""Damaged and hostile bags: each is read as far as it goes or refused in words, in time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, DataEnd, Footer, Header

from telemetry.errors import RecordingError
from telemetry.recording.file_types import MCAP_MAGIC
from telemetry.recording.ros.bag import list_bag
from tests.telemetry.bag_mutants import entries, mutant
from tests.telemetry.bags import T0_NS, write_bag

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


def test_a_chunk_that_unpacks_to_gigabytes_is_refused_within_its_memory(tmp_path: Path) -> None:
    packed, size = zstandard.ZstdCompressor(level=1).compressobj(), 64 * 2**26
    data = b"".join([*(packed.compress(bytes(2**26)) for _ in range(64)), packed.flush()])
    written = RecordBuilder()
    Header(library="somebody", profile="ros2").write(written)
    Chunk("zstd", data, T0_NS, T0_NS, uncompressed_crc=0, uncompressed_size=size).write(written)
    DataEnd(0).write(written)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(written)
    bag = tmp_path / "bomb.mcap"
    bag.write_bytes(MCAP_MAGIC + written.end() + MCAP_MAGIC)
    assert bag.stat().st_size < 2_000_000
    with pytest.raises(RecordingError) as caught:
        list_bag(bag)
    assert "more memory than allowed" in caught.value.what
    assert "Cut a shorter piece" in caught.value.advice


def test_files_that_are_packed_as_a_whole_are_not_unpacked(tmp_path: Path) -> None:
    bag = write_bag(tmp_path, "db3", entries("db3"))
    about = bag / "metadata.yaml"
    said = about.read_text()
    assert "compression_mode: ''" in said
    about.write_text(said.replace("compression_mode: ''", "compression_mode: FILE"))
    with pytest.raises(RecordingError, match="compressed as a whole") as caught:
        list_bag(bag)
    assert "ros2 bag convert" in caught.value.advice


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
