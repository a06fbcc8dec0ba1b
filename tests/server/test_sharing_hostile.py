"""What a target may hold that nobody sane has put there: refused and named, nothing written, the others brought."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from server.errors import StorageFullError
from server.library.sharing import push
from server.library.sharing.shared_items import CHUNK_BYTES, MOST_ITEM_BYTES, digest_of
from server.library.sharing.sharing_targets import BLOBS, FOLDER, FolderTarget
from tests.server.sharing_library import add_radar, add_recording, add_terrain, bring, closed_mcap, send, write_plan

GOOD = b"an honest flight"
ZEROS = "0" * 64


@pytest.fixture
def stick(tmp_path: Path) -> FolderTarget:
    """With one honest recording."""
    (tmp_path / "stick").mkdir()
    target = FolderTarget(tmp_path / "stick")
    add_recording(tmp_path / "honest", "honest.tlog", GOOD)
    assert send(tmp_path / "honest", target).whole
    return target


def put_item(target: FolderTarget, told: Any, *, name: str | None = None) -> str:
    data = told if isinstance(told, bytes) else json.dumps(told).encode()
    named = name or f"{digest_of(data)}.json"
    target.write(f"items/{named}", data)
    return named


def put_blob(target: FolderTarget, data: bytes) -> dict[str, Any]:
    digest = digest_of(data)
    target.write(f"{BLOBS}/{digest[:2]}/{digest}", data)
    return {"bytes": len(data), "chunks": [digest]}


def an_item(**changed: Any) -> dict[str, Any]:
    entry = {"name": "recording.tlog", "bytes": 0, "chunks": []}
    return {"format": 1, "kind": "recording", "name": "x.tlog", "title": "X", "files": [entry], "after": []} | changed


def a_file(**changed: Any) -> dict[str, Any]:
    return {"files": [an_item()["files"][0] | changed]}


NAMES = (
    "../x.tlog", "/etc/x.tlog", "a/b.tlog", "..\\x.tlog", "C:\\x.tlog", "c:x.tlog", "con.tlog", "NUL.tlog",
    "x.tlog ", "x.tlog.", ".x.tlog", "x.sh", "x.tlog\n", "x\x00.tlog", "x\u202e.tlog", "", "y" * 200 + ".tlog",
    "accounts.json", "~x.tlog", "-x.tlog", "com1.x.tlog",
)  # fmt: skip
HOSTILE: dict[str, Any] = {
    **{f"name {name!r}": an_item(name=name) for name in NAMES},
    "plan's name": an_item(kind="plan", name="../x", files=[{"name": "manifest.json", "bytes": 0, "chunks": []}]),
    "file's name": an_item(**a_file(name="../../accounts.json")),
    "file of another kind": an_item(**a_file(name="manifest.json")),
    "secret's name": an_item(kind="plan", name="abc", files=[{"name": "authority.key", "bytes": 0, "chunks": []}]),
    "no manifest": an_item(kind="terrain", name="abc", files=[{"name": "elevation.npy", "bytes": 0, "chunks": []}]),
    "two of one name": an_item(files=an_item()["files"] * 2),
    "no file": an_item(files=[]),
    "huge": an_item(**a_file(bytes=1 << 62)),
    "negative": an_item(**a_file(bytes=-1)),
    "bytes as text": an_item(**a_file(bytes="1")),
    "short digest": an_item(**a_file(bytes=1, chunks=["ab"])),
    "digest that is a path": an_item(**a_file(bytes=1, chunks=["../" * 21 + "a"])),
    "upper digest": an_item(**a_file(bytes=1, chunks=["A" * 64])),
    "other format": an_item(format=2),
    "other kind": an_item(kind="account"),
    "unknown field": an_item(mode="0777"),
    "no JSON": b"{",
    "deep JSON": b"[" * 100_000,
    "a list": [],
    "no text": b"\xff\xfe",
    "empty": b"",
    "too long": b" " * (MOST_ITEM_BYTES + 1),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_items_are_refused_and_honest_ones_come(tmp_path: Path, stick: FolderTarget, kind: str) -> None:
    named = put_item(stick, HOSTILE[kind])
    before = {path for path in tmp_path.rglob("*") if "two" not in path.parts}
    brought = bring(tmp_path / "two", stick)
    assert [each.title for each in brought.done] == ["honest.tlog"]
    assert [each.where for each in brought.left_out] == [f"items/{named}"]
    assert {path for path in tmp_path.rglob("*") if "two" not in path.parts} == before
    there = {path.relative_to(tmp_path / "two").as_posix() for path in (tmp_path / "two").rglob("*") if path.is_file()}
    assert there == {"recordings/honest.tlog", "shared-versions.json", "lock"}


def test_a_damaged_blob_is_named_others_come_and_a_check_mends_it(tmp_path: Path, stick: FolderTarget) -> None:
    add_recording(tmp_path / "honest", "second.tlog", b"the second flight")
    send(tmp_path / "honest", stick)
    digest = digest_of(GOOD)
    blob = stick.folder / FOLDER / BLOBS / digest[:2] / digest
    blob.write_bytes(b"another content!")
    brought = bring(tmp_path / "two", stick)
    assert [each.title for each in brought.done] == ["second.tlog"]
    (left_out,) = brought.left_out
    assert digest in left_out.what
    assert left_out.where == "recording honest.tlog"
    assert not brought.whole
    assert send(tmp_path / "honest", stick).moved_bytes == 0
    mended = send(tmp_path / "honest", stick, check=True)
    assert (len(mended.done), mended.moved_bytes) == (1, len(GOOD))
    assert [each.title for each in bring(tmp_path / "two", stick).done] == ["honest.tlog"]


@pytest.mark.parametrize("how", ["gone", "torn", "longer", "link", "pipe", "folder"])
def test_a_blob_that_is_no_whole_file_is_sent_anew(tmp_path: Path, stick: FolderTarget, how: str) -> None:
    digest = digest_of(GOOD)
    blob = stick.folder / FOLDER / BLOBS / digest[:2] / digest
    blob.unlink()
    (tmp_path / "elsewhere").write_bytes(GOOD)
    if how == "torn":
        blob.write_bytes(GOOD[:5])
    elif how == "longer":
        blob.write_bytes(GOOD + b"!")
    elif how == "link":
        blob.symlink_to(tmp_path / "elsewhere")
    elif how == "pipe":
        os.mkfifo(blob)
    elif how == "folder":
        blob.mkdir()
    brought = bring(tmp_path / "two", stick)
    assert brought.done == []
    assert "missing or torn" in brought.left_out[0].what
    assert digest in brought.left_out[0].what
    if how != "folder":
        assert send(tmp_path / "honest", stick).moved_bytes == len(GOOD)
        assert bring(tmp_path / "two", stick).whole
    else:
        assert send(tmp_path / "honest", stick).stopped is not None


def test_a_blob_of_one_chunk_repeated_for_ever_finds_no_room(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = shutil.disk_usage(tmp_path)._replace(free=1 << 39)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: free)
    entry = put_blob(stick, bytes(CHUNK_BYTES))
    many = 100_000
    put_item(stick, an_item(**a_file(bytes=CHUNK_BYTES * many, chunks=entry["chunks"] * many)))
    with pytest.raises(StorageFullError, match="are to come"):
        bring(tmp_path / "two", stick)


def test_what_calls_itself_another_thing_or_reaches_outside_is_refused(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(push, "prove_own", lambda local: None)
    evil = tmp_path / "evil"
    terrain, radar, plan = add_terrain(evil), add_radar(evil), write_plan(evil, "Evil")
    (evil / "terrains" / terrain).rename(evil / "terrains" / "0123456789abcdef")
    manifest = evil / "radar" / radar / "manifest.json"
    manifest.write_text(manifest.read_text().replace(f"{radar}.npy", "../../accounts.json"))
    plan.write_text(plan.read_text().replace('"position":0', '"position":7'))
    add_recording(evil, "cut.mcap", closed_mcap(b"x"))
    send(evil, stick)
    put_item(
        stick,
        an_item(name="cut2.mcap", files=[{"name": "recording.mcap"} | put_blob(stick, closed_mcap(b"y")[:-1])]),
    )
    (tmp_path / "two").mkdir()
    (tmp_path / "two" / "accounts.json").write_text("mine")
    brought = bring(tmp_path / "two", stick)
    assert {each.title for each in brought.done} == {"honest.tlog", "cut.mcap"}
    words = " ".join(each.words() for each in brought.left_out)
    assert len(brought.left_out) == 4
    for told in ("calls itself", "../../accounts.json is missing", "history contradicts itself", "it has no end"):
        assert told in words
    assert not any(
        (tmp_path / "two" / name).exists() for name in ("pulling", f"radar/{radar}", "terrains/0123456789abcdef")
    )
    assert (tmp_path / "two" / "accounts.json").read_text() == "mine"


def test_items_that_claim_to_be_after_each_other_are_both_brought(tmp_path: Path, stick: FolderTarget) -> None:
    source = tmp_path / "source"
    for name in ("A", "B"):
        write_plan(source, name)
        send(source, stick)
    items = [json.loads(path.read_bytes()) for path in (stick.folder / FOLDER / "items").iterdir()]
    plans = [item for item in items if item["kind"] == "plan"]
    contents = {digest for item in plans for digest in item["after"]}
    assert len(contents) == 1
    from server.library.sharing.shared_items import Item

    both = [Item.model_validate_json(json.dumps(item)).content for item in plans]
    for item, other in zip(plans, reversed(both), strict=True):
        put_item(stick, item | {"after": [other]})
    assert {each.title for each in bring(tmp_path / "two", stick).done} == {"A", "B", "honest.tlog"}
