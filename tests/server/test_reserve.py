"""What is kept for a full disk, on disks that say what they are told to."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from server.door.accounts import Accounts
from server.door.auth import Auth
from server.errors import StorageFullError
from server.library.reserve import MOST_BYTES, Reserve

Disk = Callable[[int], None]
GB = 10**9


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    """Of 10 GB; says how much of it is free."""

    def says(free: int) -> None:
        monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(total=10 * GB, free=free))

    says(5 * GB)
    return says


def test_it_is_given_up_when_the_disk_is_full_and_made_again_when_there_is_room(tmp_path: Path, disk: Disk) -> None:
    kept = Reserve(tmp_path)
    kept.look()
    assert kept.notice is None
    assert (tmp_path / "reserve").stat().st_blocks * 512 >= MOST_BYTES
    disk(0)
    kept.look()
    assert kept.notice is not None
    assert "Delete old recordings" in kept.notice.advice
    assert not (tmp_path / "reserve").exists()
    # What was given up is no room: pages are told until there is some.
    disk(MOST_BYTES)
    kept.look()
    assert kept.notice is not None
    assert not (tmp_path / "reserve").exists()
    disk(5 * GB)
    kept.look()
    assert kept.notice is None
    assert (tmp_path / "reserve").is_file()


def test_a_folder_that_is_gone_is_said(tmp_path: Path) -> None:
    kept = Reserve(tmp_path / "gone")
    kept.look()
    assert kept.notice is not None
    assert "cannot be looked at" in kept.notice.what


def test_a_disk_that_takes_nothing_keeps_nobody_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, data: bytes) -> None:
        raise StorageFullError("The disk is full.", where=str(path))

    auth = Auth(tmp_path / "sessions.json", Accounts(tmp_path))
    monkeypatch.setattr("server.door.auth.write_atomically", full)
    session = auth.redeem(auth.new_link_token())
    assert auth.identity(session) is not None
