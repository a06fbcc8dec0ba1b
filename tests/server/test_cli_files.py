"""Writing the files of a plan: all of them or none."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from planning.errors import FormatError
from planning.formats.safe_text import MAX_BYTES
from server.cli.shared.files_in_out import check_directory, read_small, write_files
from server.errors import StorageError, StorageFullError
from tests.server.cli_runs import contents

FILES = {"a.txt": "one\r\n", "b.txt": "two ü"}


def test_writes_text_as_it_is(tmp_path: Path) -> None:
    write_files(tmp_path / "deep" / "out", FILES)
    assert contents(tmp_path / "deep" / "out") == {"a.txt": b"one\r\n", "b.txt": "two ü".encode()}
    assert (tmp_path / "deep" / "out" / "a.txt").stat().st_mode & 0o777 == 0o644


def test_replaces_and_keeps_what_is_not_its_own(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    (tmp_path / "mine.txt").write_text("mine")
    write_files(tmp_path, FILES)
    assert contents(tmp_path) == {"a.txt": b"one\r\n", "b.txt": "two ü".encode(), "mine.txt": b"mine"}


def full_at(call: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk is full from this call of fsync on."""
    calls = iter(range(1, 1000))
    real = os.fsync

    def fsync(handle: int) -> None:
        if next(calls) >= call:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(handle)

    monkeypatch.setattr("server.cli.shared.files_in_out.os.fsync", fsync)


@pytest.mark.parametrize("call", [1, 2])
def test_full_disk_leaves_an_earlier_run_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: int) -> None:
    (tmp_path / "a.txt").write_text("old a")
    (tmp_path / "b.txt").write_text("old b")
    full_at(call, monkeypatch)
    with pytest.raises(StorageFullError, match="No space left") as caught:
        write_files(tmp_path, FILES)
    assert contents(tmp_path) == {"a.txt": b"old a", "b.txt": b"old b"}
    assert caught.value.where == str(tmp_path)


def test_full_disk_leaves_no_new_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full_at(2, monkeypatch)
    with pytest.raises(StorageFullError):
        write_files(tmp_path / "deep" / "out", FILES)
    assert list(tmp_path.iterdir()) == []


def test_file_in_the_place_of_the_directory(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(StorageError, match="This is a file"):
        check_directory(tmp_path / "taken" / "below")
    with pytest.raises(StorageError):
        write_files(tmp_path / "taken", FILES)
    assert contents(tmp_path) == {"taken": b"mine"}


def test_directory_that_may_not_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.cli.shared.files_in_out.os.access", lambda *_: False)
    with pytest.raises(StorageError, match="cannot be written"):
        check_directory(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_endless_file_is_not_read(tmp_path: Path) -> None:
    large = tmp_path / "large.csv"
    with large.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(FormatError, match="more than 20 MB"):
        read_small(large)
