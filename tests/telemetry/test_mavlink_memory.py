"""What a link node leaves for the next one."""

from pathlib import Path

import pytest

from telemetry.nodes.link import Memory, Wanted, read_memory, write_memory
from telemetry.topics.messages import Candidate, FlightStatus

FULL = Memory(
    (Wanted("udpin:0.0.0.0:14550", True, True), Wanted("/dev/ttyACM0:57600", False)),
    Candidate("id", "udpin:0.0.0.0:14550", "10.0.0.2:4000", 1, 1, "ardupilot", 2),
    FlightStatus("auto", "flying", 3, 88, 1.7e9),
    highest_token=1_795_000_000_000,
    avoid_by="sidestep",
    ways=(Candidate("id", "/dev/ttyACM0:57600", "/dev/ttyACM0", 1, 1, "ardupilot", 2),),
)


def test_it_comes_back_as_it_was(tmp_path: Path) -> None:
    write_memory(tmp_path / "link.json", FULL)
    assert read_memory(tmp_path / "link.json") == FULL


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"connections": 5}', b"\xff\xfe"])
def test_what_cannot_be_read_is_forgotten(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "link.json"
    assert read_memory(file) == Memory()
    file.write_bytes(content)
    assert read_memory(file) == Memory()


def test_a_folder_that_is_gone_costs_nothing_else(tmp_path: Path) -> None:
    write_memory(tmp_path / "gone" / "link.json", FULL)
    assert read_memory(tmp_path / "gone" / "link.json") == Memory()
