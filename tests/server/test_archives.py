"""ZIP archives: what is refused before anything of it is read or written, and in which words."""

from __future__ import annotations

import contextlib
import io
import shutil
import struct
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.errors import BadRequestError, StorageFullError, TooLargeError
from server.plan import archives

GIB = 2**30


def unpacked(upload: Path, *, rename: str = "") -> list[Path]:
    """All its files, by their names or one name of ours."""
    folder = upload.with_suffix("")
    with archives.opened(upload, "run.zip") as archive:
        wanted = {rename or archives.name_of(member): member for member in archive.infolist()}
        archives.unpack(archive, wanted, folder, "run.zip", most_bytes=GIB, report=lambda step, share: None)
    return sorted(folder.iterdir())


def packed(path: Path, method: int, *names: str) -> Path:
    with zipfile.ZipFile(path, "w", method) as archive:
        for name in names:
            archive.writestr(name, b"words " * 2000)
    return path


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_what_any_program_packs_comes_back(tmp_path: Path, method: int) -> None:
    found = unpacked(packed(tmp_path / "a.zip", method, "run/a.db3", "../../b.db3"))
    assert [path.name for path in found] == ["a.db3", "b.db3"]
    assert {path.read_bytes() for path in found} == {b"words " * 2000}


@pytest.mark.parametrize(("method", "words"), [(zipfile.ZIP_BZIP2, "bzip2"), (zipfile.ZIP_LZMA, "lzma")])
def test_other_ways_of_packing_are_refused_by_their_names(tmp_path: Path, method: int, words: str) -> None:
    upload = packed(tmp_path / "a.zip", method, "a.db3")
    with pytest.raises(BadRequestError, match=f"^run.zip: .*packed by {words}") as refused:
        unpacked(upload)
    assert "deflate" in refused.value.advice
    assert list(tmp_path.iterdir()) == [upload]


def test_names_that_no_disk_takes_are_the_archives_fault(tmp_path: Path) -> None:
    with pytest.raises(BadRequestError, match="name in the archive has 304 bytes"):
        unpacked(packed(tmp_path / "a.zip", zipfile.ZIP_STORED, "\u00e9" * 150 + ".db3"))
    assert unpacked(packed(tmp_path / "b.zip", zipfile.ZIP_STORED, "x" * 300), rename="own")


def test_a_directory_that_is_too_large_is_never_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    upload = packed(tmp_path / "a.zip", zipfile.ZIP_STORED, "a.db3", "b.db3")
    read: list[int] = []
    once = archives._Bounded.read

    def counted(self: Any, size: int | None = -1) -> bytes:
        data = once(self, size)
        read.append(len(data))
        return data

    monkeypatch.setattr(archives._Bounded, "read", counted)
    data = bytearray(upload.read_bytes())
    data[-10:-6] = struct.pack("<I", 40_000_000)  # of the directory, by the end record
    upload.write_bytes(bytes(50_000_000) + bytes(data))
    with pytest.raises(TooLargeError, match=r"^run.zip: The archive has a directory of 40.0 MB"):
        unpacked(upload)
    assert sum(read) <= 2**16 + 2**10
    monkeypatch.setattr(archives, "MOST_MEMBERS", 1)
    with pytest.raises(TooLargeError, match="more than 1 files"):
        unpacked(packed(tmp_path / "b.zip", zipfile.ZIP_STORED, "a.db3", "b.db3"))


def test_room_for_the_recorder_is_left_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    upload = packed(tmp_path / "a.zip", zipfile.ZIP_DEFLATED, "a.db3")
    for free, fits in ((archives.LEFT_FREE_BYTES + 11_999, False), (archives.LEFT_FREE_BYTES + 12_000, True)):
        usage = SimpleNamespace(free=free)
        monkeypatch.setattr(shutil, "disk_usage", lambda path, usage=usage: usage)
        if fits:
            assert unpacked(upload)
        else:
            with pytest.raises(TooLargeError, match=r"there is room for 0\.0 GB"):
                unpacked(upload)


def test_a_full_disk_is_said_to_be_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    upload = packed(tmp_path / "a.zip", zipfile.ZIP_DEFLATED, "a.db3")

    def full(*_: object) -> Any:
        return FullDisk()

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(StorageFullError):
        unpacked(upload)


class FullDisk(io.BytesIO):
    def write(self, data: object, /) -> int:
        raise OSError(28, "No space left on device")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return packed(tmp_path_factory.mktemp("archives") / "whole.zip", zipfile.ZIP_DEFLATED, "a.db3", "b.db3")


@given(changes=st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), min_size=1, max_size=6))
def test_damage_is_unpacked_or_said_and_is_never_the_disks_fault(whole: Path, changes: list[tuple[int, int]]) -> None:
    data = bytearray(whole.read_bytes())
    for place, value in changes:
        data[place % len(data)] = value
    upload = whole.with_name("damaged.zip")
    upload.write_bytes(bytes(data))
    with contextlib.suppress(BadRequestError, TooLargeError):
        unpacked(upload)
    shutil.rmtree(upload.with_suffix(""), ignore_errors=True)
