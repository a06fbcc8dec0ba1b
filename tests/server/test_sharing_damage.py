"""Damage on either side, of disks, files and targets: it is named, and nothing else waits for it."""

from __future__ import annotations

import errno
import io
import itertools
import json
import os
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest

from server.errors import StorageError, StorageFullError, TargetError
from server.library.sharing import local_items, pull, push, shared_items, sharing_targets, versions
from server.library.sharing.sharing_targets import BLOBS, DAMAGED, FOLDER, ITEMS, FolderTarget, Target, open_target
from server.library.stored_arrays import read_array
from tests.server.sharing_library import (
    PLAN_ID,
    add_photo,
    add_radar,
    add_recording,
    add_terrain,
    bring,
    send,
    shared_files,
    stick,
    write_plan,
)

__all__ = ["stick"]


def header(text: str) -> bytes:
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode() + bytes(64)


def archive() -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, heights=np.zeros(3))
    return buffer.getvalue()


ARRAYS = {
    "empty": b"",
    "zip": b"PK\x03\x04xxxx",
    "npz": archive(),
    "too large": header("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999, 4), }"),
    "no end": header("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), "),
    "open quotes": header("'''"),
    "indented": header("  x\n y\n"),
    "deep": header("(" * 3000),
    "many signs": header("-" * 9000 + "1"),
    "no type": header("{'descr': '', 'fortran_order': False, 'shape': (3, 4), }"),
}


@pytest.mark.parametrize("how", ARRAYS)
def test_an_array_that_is_none_is_said_to_be_damaged(tmp_path: Path, how: str) -> None:
    path = tmp_path / "elevation.npy"
    path.write_bytes(ARRAYS[how])
    with pytest.raises(StorageError, match="The file is damaged"):
        read_array(path, shape=(3, 4), dtype=np.float32)


@pytest.mark.parametrize("how", ["empty", "npz", "no end", "transform", "crs"])
def test_a_damaged_model_in_the_target_stops_no_pull(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    monkeypatch.setattr(push, "prove_own", lambda local: None)
    _damage(tmp_path / "one" / "terrains" / add_terrain(tmp_path / "one"), how)
    add_recording(tmp_path / "one", "flight.tlog", b"flown")
    send(tmp_path / "one", stick)
    brought = bring(tmp_path / "two", stick)
    assert [each.title for each in brought.done] == ["flight.tlog"]
    assert [each.where for each in brought.left_out] == ["surface model Hill"]


def _damage(model: Path, how: str) -> None:
    if how in ARRAYS:
        (model / "elevation.npy").write_bytes(ARRAYS[how])
        return
    told = json.loads((model / "manifest.json").read_bytes())
    told |= {"transform": ["x"] * 6} if how == "transform" else {"crs_wkt": "x" * 10}
    (model / "manifest.json").write_text(json.dumps(told))


def test_an_error_of_any_kind_leaves_out_the_one_thing(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    from server.library.sharing import proving

    add_terrain(tmp_path / "one")
    write_plan(tmp_path / "one", "Slope")
    send(tmp_path / "one", stick)

    def fails(folder: Path) -> None:
        raise MemoryError

    monkeypatch.setattr(proving, "load_terrain", fails)
    brought = bring(tmp_path / "two", stick)
    assert [each.title for each in brought.done] == ["Slope"]
    assert "MemoryError" in brought.left_out[0].what


def test_a_damaged_thing_is_not_sent_and_does_not_keep_the_whole_one_out(tmp_path: Path, stick: FolderTarget) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    model, photo = add_terrain(one), add_photo(one, "feed")
    plan = write_plan(one, "Slope")
    radar = add_radar(one)
    shutil.copytree(one, two)
    (two / "terrains" / model / "elevation.npy").write_bytes(b"")
    (two / "orthophotos" / photo / "pixels.npy").write_bytes(b"")
    (two / "radar" / radar / f"{radar}.npy").unlink()
    (two / "plans" / plan.parent.name / "manifest.json").write_text('{"name": "Slope"}')
    assert [each.kind for each in send(two, stick, dry_run=True).done] == []
    sent = send(two, stick)
    assert (sent.done, sent.moved_bytes) == ([], 0)
    assert [each.where for each in sent.left_out] == [
        "surface model Hill", "orthophoto Photo", "radar file capture.npy", "plan Slope",
    ]  # fmt: skip
    assert send(one, stick).whole
    assert bring(tmp_path / "three", stick).whole
    assert shared_files(tmp_path / "three") == shared_files(one)


@pytest.mark.parametrize("turn", range(4))
def test_no_branch_of_a_plan_is_taken_for_one_that_is_here(tmp_path: Path, stick: FolderTarget, turn: int) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    write_plan(one, "V1")
    send(one, stick)
    bring(two, stick)
    write_plan(two, f"V2 {turn}")
    send(two, stick)
    write_plan(one, f"V3 {turn}")
    send(one, stick)
    shutil.rmtree(one / "plans" / PLAN_ID)
    assert len(bring(one, stick).done) == 2
    assert _plans(one) == [f"V2 {turn}", f"V3 {turn}"]
    assert bring(one, stick).done == []
    under_id = json.loads((one / "plans" / PLAN_ID / "manifest.json").read_bytes())["name"]
    write_plan(one, f"V4 {turn}")
    send(one, stick)
    assert bring(tmp_path / "three", stick).whole
    assert _plans(tmp_path / "three") == sorted({f"V4 {turn}", f"V2 {turn}", f"V3 {turn}"} - {under_id})


def _plans(root: Path) -> list[str]:
    return sorted(json.loads(path.read_bytes())["name"] for path in (root / "plans").glob("*/manifest.json"))


class Unreadable(FolderTarget):
    """One read of a blob, by its number, fails."""

    def __init__(self, folder: Path, number: int) -> None:
        super().__init__(folder)
        self._number, self._reads = number, itertools.count(1)

    def read(self, path: str, most_bytes: int) -> bytes:
        if path.startswith(BLOBS) and next(self._reads) == self._number:
            raise TargetError("Input/output error.", where=self.text)
        return super().read(path, most_bytes)


def test_a_check_goes_on_behind_a_blob_that_cannot_be_read(tmp_path: Path, stick: FolderTarget) -> None:
    for number in range(4):
        add_recording(tmp_path / "one", f"{number}.tlog", b"flight %d" % number)
    send(tmp_path / "one", stick)
    for blob in [path for path in (stick.folder / FOLDER / BLOBS).rglob("*") if path.is_file()]:
        blob.write_bytes(b"X" * blob.stat().st_size)
    checked = send(tmp_path / "one", Unreadable(stick.folder, 1), check=True)
    assert (checked.stopped, len(checked.done)) == (None, 4)
    assert bring(tmp_path / "two", stick).whole


def test_a_blob_counts_only_in_its_own_place(tmp_path: Path, target: Target) -> None:
    add_recording(tmp_path / "one", "flight.tlog", b"flown")
    data = b"flown"
    digest = shared_items.digest_of(data)
    target.write(f"{BLOBS}/{digest[:2]} (copy)/{digest}", data)
    assert target.sizes(BLOBS) == {}
    assert send(tmp_path / "one", target).moved_bytes == len(data)
    assert bring(tmp_path / "two", target).whole


@pytest.fixture(params=["folder", "memory"])
def target(request: pytest.FixtureRequest, tmp_path: Path) -> Target:
    if request.param == "memory":
        return open_target(f"memory://damage-{tmp_path.name}-{os.getpid()}")
    (tmp_path / "disk").mkdir()
    return FolderTarget(tmp_path / "disk")


def test_a_read_that_fails_once_throws_nothing_away(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shared_items, "CHUNK_BYTES", 16)
    monkeypatch.setattr(local_items, "CHUNK_BYTES", 16)
    add_recording(tmp_path / "one", "long.tlog", bytes(range(160)))
    add_recording(tmp_path / "one", "z.tlog", b"short")
    send(tmp_path / "one", stick)
    brought = bring(tmp_path / "two", Unreadable(stick.folder, 9))
    assert ([each.title for each in brought.done], len(brought.left_out)) == (["z.tlog"], 1)
    again = bring(tmp_path / "two", stick)
    assert again.whole
    assert again.moved_bytes <= 48
    assert not (tmp_path / "two" / pull.STAGING).exists()


def test_a_torn_item_is_set_aside_once_it_is_old_and_all_is_well_again(tmp_path: Path, stick: FolderTarget) -> None:
    one = tmp_path / "one"
    write_plan(one, "V1")
    send(one, stick)
    (item,) = (stick.folder / FOLDER / ITEMS).iterdir()
    item.write_bytes(b"torn")
    write_plan(one, "V2")
    young = send(one, stick)
    assert "does not match its name" in young.left_out[0].what
    assert item.exists()
    os.utime(item, (0, 0))
    assert not send(one, stick, dry_run=True).whole
    assert item.exists()
    old = send(one, stick)
    assert "set aside" in old.left_out[0].what
    assert (stick.folder / FOLDER / DAMAGED / item.name).read_bytes() == b"torn"
    assert send(one, stick).whole
    assert bring(tmp_path / "two", stick).whole
    assert _plans(tmp_path / "two") == ["V2"]


def test_setting_aside_waits_for_who_may_be_writing_and_survives_who_was_first(
    target: Target, monkeypatch: pytest.MonkeyPatch
) -> None:
    target.write(f"{ITEMS}/torn.json", b"torn")
    assert not target.set_aside("torn.json")
    monkeypatch.setattr(sharing_targets, "_STALE_S", -1.0)
    assert target.set_aside("torn.json")
    assert not target.set_aside("torn.json")
    target.settle()
    assert (target.sizes(ITEMS), target.sizes(DAMAGED)) == ({}, {"torn.json": 4})


def test_a_full_disk_keeps_the_account_of_what_was_brought(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_recording(tmp_path / "one", "flight.tlog", b"flown")
    send(tmp_path / "one", stick)

    def full(path: Path, data: bytes) -> None:
        raise StorageFullError("No space left.", where=str(path))

    monkeypatch.setattr(versions, "write_atomically", full)
    brought = bring(tmp_path / "two", stick)
    assert [each.title for each in brought.done] == ["flight.tlog"]
    assert brought.left_out
    assert (tmp_path / "two" / "recordings" / "flight.tlog").is_file()


@pytest.mark.parametrize("code", [errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EXDEV])
def test_disks_without_second_names_and_libraries_over_two_disks(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    add_recording(one, "flight.tlog", b"flown")
    add_terrain(one)
    send(one, stick)
    link, rename = os.link, os.rename

    def far(given: Path, place: Path) -> bool:
        return pull.STAGING in given.parts and pull.STAGING not in place.parts

    def no_link(given: Path, place: Path) -> None:
        if code != errno.EXDEV or far(given, place):
            raise OSError(code, os.strerror(code))
        link(given, place)

    def no_rename(given: Path, place: Path) -> None:
        if code == errno.EXDEV and far(given, place):
            raise OSError(code, os.strerror(code))
        rename(given, place)

    monkeypatch.setattr(os, "link", no_link)
    monkeypatch.setattr(os, "rename", no_rename)
    assert bring(two, stick).whole
    assert shared_files(two) == shared_files(one)
    staged, place = two / "staged", two / "recordings" / "flight.tlog"
    staged.write_bytes(b"another")
    with pytest.raises(FileExistsError):
        pull._give_name(staged, place)
    assert place.read_bytes() == b"flown"


def test_old_leftovers_that_cannot_be_removed_stop_no_push(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_recording(tmp_path / "one", "flight.tlog", b"flown")
    old = [stick.folder / FOLDER / f".tmp-{name}" for name in "ab"]
    old[0].parent.mkdir()
    for path in old:
        path.write_bytes(b"half")
        os.utime(path, (0, 0))
    unlink = os.unlink

    def refused(path: str) -> None:
        if path == str(old[0]):
            raise PermissionError(errno.EPERM, "not permitted")
        unlink(path)

    monkeypatch.setattr(os, "unlink", refused)
    assert send(tmp_path / "one", stick).whole
    assert [path.exists() for path in old] == [True, False]


@pytest.mark.parametrize("where", ["", BLOBS, ITEMS])
def test_a_link_in_a_target_is_refused(tmp_path: Path, where: str) -> None:
    (tmp_path / "victim").mkdir()
    place = tmp_path / "stick" / FOLDER / where
    place.parent.mkdir(parents=True)
    place.symlink_to(tmp_path / "victim")
    with pytest.raises(TargetError, match="a link to elsewhere"):
        FolderTarget(tmp_path / "stick")


def test_a_model_with_too_many_files_is_left_out_with_words(tmp_path: Path, stick: FolderTarget) -> None:
    model = tmp_path / "one" / "terrains" / add_terrain(tmp_path / "one")
    for number in range(1000):
        (model / f"seen-{number:016x}.npz").touch()
    write_plan(tmp_path / "one", "Slope")
    sent = send(tmp_path / "one", stick)
    assert [each.title for each in sent.done] == ["Slope"]
    assert "at most 1000" in sent.left_out[0].what


def test_a_stray_file_where_things_are_on_their_way_stops_nothing(tmp_path: Path, stick: FolderTarget) -> None:
    add_recording(tmp_path / "one", "flight.tlog", b"flown")
    send(tmp_path / "one", stick)
    (tmp_path / "two" / pull.STAGING).mkdir(parents=True)
    (tmp_path / "two" / pull.STAGING / "note.txt").write_text("mine")
    assert bring(tmp_path / "two", stick).whole
    assert (tmp_path / "two" / pull.STAGING / "note.txt").read_text() == "mine"
