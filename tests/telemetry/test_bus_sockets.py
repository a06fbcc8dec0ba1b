"""The private directory of the sockets: whose it is, how long its path may be, and who is in it."""

import os
import socket
from pathlib import Path

import pytest

from telemetry.bus.bus import Bus
from telemetry.bus.sockets import neighbours, private_directory, socket_directory
from telemetry.errors import BusError
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.bus_runs import run, short_folder


@pytest.fixture
def short(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A place for the directories of short name."""
    path = tmp_path_factory.mktemp("s")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(path))
    return path


def test_a_short_path_is_taken_as_it_is() -> None:
    with short_folder() as folder:
        assert socket_directory(folder / "run") == (folder / "run").resolve()


def test_a_bus_works_in_a_directory_whose_path_is_too_long_for_sockets(tmp_path: Path, short: Path) -> None:
    long = tmp_path / ("a" * 100) / ("b" * 100)

    async def whole() -> None:
        async with await Bus.open(long, "link") as link, await Bus.open(long, "server") as server:
            reader = server.subscribe(Topic.VEHICLE)
            link.publish(Topic.VEHICLE, VehicleState(5, 1))
            assert (await anext(reader))[1] == VehicleState(5, 1)

    run(whole)
    (used,) = short.iterdir()
    assert used.stat().st_mode & 0o777 == 0o700


def test_all_agree_on_the_place_of_the_sockets_even_with_other_environments(
    tmp_path: Path, short: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = tmp_path / ("a" * 120)
    first = socket_directory(long)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("other")))
    assert socket_directory(long) == first
    first.rmdir()  # by a clean-up of temporary files
    assert socket_directory(long) == first
    assert first.is_dir()


def test_a_link_to_elsewhere_is_not_followed(tmp_path: Path, short: Path) -> None:
    target = tmp_path / "target"
    target.mkdir(mode=0o700)
    planted = tmp_path / "run"
    planted.symlink_to(target)
    with pytest.raises(BusError, match="belongs to somebody else"):
        private_directory(planted)


def test_a_file_in_its_place_is_named(tmp_path: Path) -> None:
    (tmp_path / "run").touch()
    with pytest.raises(BusError, match="cannot be made"):
        private_directory(tmp_path / "run")


def test_each_pair_of_well_known_names_has_one_connection() -> None:
    names = ("server", "link", "recorder", "replay", "simulator")
    nowhere = Path("/nonexistent")
    pairs = [{name, other} for name in names for other in neighbours(nowhere, name)]
    assert len(pairs) == len({frozenset(pair) for pair in pairs}) == 10
    assert neighbours(nowhere, "cli-1") == list(names)


def test_guests_are_found_and_dead_ones_forgotten(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as living, socket.socket(socket.AF_UNIX) as dead:
        living.bind(str(tmp_path / "cli-1.sock"))
        living.listen()
        dead.bind(str(tmp_path / "cli-2.sock"))
        assert "cli-1" in neighbours(tmp_path, "server")
        assert "cli-2" not in neighbours(tmp_path, "server")
        assert (tmp_path / "cli-2.sock").exists()  # it may just be about to listen
        os.utime(tmp_path / "cli-2.sock", (0, 0))
        assert neighbours(tmp_path, "server") == ["cli-1"]
        assert not (tmp_path / "cli-2.sock").exists()
