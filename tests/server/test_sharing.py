"""One library on several machines: what goes over, what stays, what is never sent, what breaks off."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from server.errors import DataDirError, StorageFullError, TargetError
from server.library.directory_lock import DirectoryLock
from server.library.library import Library
from server.library.sharing import local_items, pull, shared_items
from server.library.sharing.catalog import read_catalog
from server.library.sharing.outcome import Outcome
from server.library.sharing.sharing_targets import BLOBS, FOLDER, ITEMS, FolderTarget, StoreTarget, Target, open_target
from tests.server.sharing_library import (
    PLAN_ID,
    BreakingTarget,
    add_radar,
    add_recording,
    add_terrain,
    bring,
    closed_mcap,
    full_library,
    send,
    shared_files,
    stick,
    write_plan,
)

__all__ = ["stick"]


@pytest.fixture(params=["folder", "memory"])
def target(request: pytest.FixtureRequest, tmp_path: Path) -> Target:
    if request.param == "memory":
        return open_target(f"memory://{tmp_path.name}-{os.getpid()}")
    (tmp_path / "disk").mkdir()
    return open_target((tmp_path / "disk").as_uri())


def test_a_library_arrives_whole_and_goes_once(tmp_path: Path, target: Target) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    full_library(one)
    sent = send(one, target)
    assert (len(sent.done), sent.there, sent.whole) == (7, 0, True)
    brought = bring(two, target)
    assert (len(brought.done), brought.whole) == (7, True)
    assert shared_files(two) == shared_files(one)
    assert not (two / pull.STAGING).exists()
    for again in (send(one, target), send(two, target), bring(one, target), bring(two, target)):
        assert (again.done, again.there, again.moved_bytes, again.whole) == ([], 7, 0, True)
    library = Library(two)
    try:
        assert not library.notices
        assert [plan.name for plan in library.plans()] == ["Slope"]
        assert library.load_terrain(library.terrains()[0].id).elevation_m.shape == (3, 4)
    finally:
        library.close()


SECRETS = (
    "accounts.json", "sessions.json", "sensor-token.txt", "lease.json", "audit.jsonl", "onboard.json", ".env",
    "tls/authority.key", "tls/console.pem", "keys/signing.json", "keys/audit.key", "vehicles/2/keys/signing.json",
    "vehicles/2/audit.jsonl", "run/link.json", "set-aside/plans-x/manifest.json", "uploads/x.mcap", "plans/token.txt",
    f"plans/{PLAN_ID}/key.pem", "recordings/signing.json", "recordings/.hidden.mcap", "recordings/deep/keys.mcap",
    "profiles/mine.toml",
)  # fmt: skip


def test_no_secret_is_ever_sent(tmp_path: Path, target: Target) -> None:
    root, secret = tmp_path / "one", b"hunter2-is-the-secret"
    full_library(root)
    for name in SECRETS:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(closed_mcap(secret))
    (root / "recordings" / "link.mcap").symlink_to(root / "accounts.json")
    (root / "recordings" / "linked.tlog").symlink_to(root / "keys")
    (root / "terrains" / "abcdef").symlink_to(root / "keys")
    sent = send(root, target)
    assert len(sent.done) == 7
    names = {left_out.where for left_out in sent.left_out}
    assert {"recordings/link.mcap", "recordings/deep", "terrains/abcdef", f"plans/{PLAN_ID}/key.pem"} <= names
    paths = [f"{folder}/{name}" for folder in (BLOBS, ITEMS) for name in _paths(target, folder)]
    assert len(paths) > 14
    for path in paths:
        data = target.read(path, 1 << 20)
        assert secret not in data
        assert not any(Path(name).name.encode() in data for name in SECRETS if not name.endswith("manifest.json"))


def _paths(target: Target, folder: str) -> list[str]:
    return [name if folder == ITEMS else f"{name[:2]}/{name}" for name in target.sizes(folder)]


def test_a_recording_under_way_is_left_out_and_said(tmp_path: Path, stick: FolderTarget) -> None:
    root = tmp_path / "one"
    add_recording(root, "now.mcap", closed_mcap(b"flying")[:-3])
    add_recording(root, "done.mcap", closed_mcap(b"landed"))
    sent = send(root, stick)
    assert [each.title for each in sent.done] == ["done.mcap"]
    assert [(each.where, each.what) for each in sent.left_out] == [
        ("recordings/now.mcap", "This recording is being written, or broke off.")
    ]


def test_a_file_that_changes_while_it_is_read_is_left_out(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "one"
    growing = add_recording(root, "growing.tlog", b"x" * 100)
    add_recording(root, "quiet.tlog", b"y" * 100)
    read = local_items.read_chunks

    def while_read(path: Path):
        for chunk in read(path):
            yield chunk
            if path == growing:
                with path.open("ab") as file:
                    file.write(b"more")

    monkeypatch.setattr(local_items, "read_chunks", while_read)
    sent = send(root, stick)
    assert [each.title for each in sent.done] == ["quiet.tlog"]
    assert [(each.where, each.what) for each in sent.left_out] == [("recording growing.tlog", "It is being written.")]


def test_two_machines_push_recordings_of_one_name_and_both_are_kept(tmp_path: Path, stick: FolderTarget) -> None:
    one, two, three = tmp_path / "one", tmp_path / "two", tmp_path / "three"
    add_recording(one, "flight.tlog", b"of the first")
    add_recording(two, "flight.tlog", b"of the second")
    send(one, stick)
    send(two, stick)
    for root, own in ((one, b"of the first"), (two, b"of the second")):
        brought = bring(root, stick)
        assert len(brought.done) == 1
        assert (root / "recordings" / "flight.tlog").read_bytes() == own
        other = root / "recordings" / brought.done[0].name
        assert {own, other.read_bytes()} == {b"of the first", b"of the second"}
        assert other.name.startswith("flight-")
        assert bring(root, stick).done == []
        assert send(root, stick).done == []
    assert len(bring(three, stick).done) == 2
    assert set(shared_files(three).values()) == {b"of the first", b"of the second"}


def test_a_plan_that_went_on_comes_as_its_newest_and_never_over_another(tmp_path: Path, stick: FolderTarget) -> None:
    one, two, three = tmp_path / "one", tmp_path / "two", tmp_path / "three"
    write_plan(one, "First")
    send(one, stick)
    bring(two, stick)
    first = write_plan(two, "Second").read_bytes()
    send(two, stick)
    assert bring(two, stick).done == []  # the first version is what the second was made of
    brought = bring(three, stick)
    assert [each.title for each in brought.done] == ["Second"]
    # Changed on both sides: both are there, under two ids.
    write_plan(one, "Otherwise")
    send(one, stick)
    (second,) = bring(one, stick).done
    assert (second.title, second.name != PLAN_ID) == ("Second", True)
    assert (one / "plans" / second.name / "manifest.json").read_bytes() == first
    assert b"Otherwise" in (one / "plans" / PLAN_ID / "manifest.json").read_bytes()
    assert bring(one, stick).done == []
    assert send(one, stick).done == []
    # What stands beside it is no earlier version of it.
    write_plan(one, "Further")
    send(one, stick)
    assert {each.title for each in bring(tmp_path / "four", stick).done} == {"Further", "Second"}


def test_a_deleted_thing_comes_back_and_a_lost_note_of_versions_loses_nothing(
    tmp_path: Path, stick: FolderTarget
) -> None:
    root = tmp_path / "one"
    plan = write_plan(root, "Mine")
    recording = add_recording(root, "flight.tlog", b"flown")
    send(root, stick)
    recording.unlink()
    plan.unlink()
    plan.parent.rmdir()
    (root / "shared-versions.json").write_text("{broken")
    assert len(bring(root, stick).done) == 2
    assert recording.read_bytes() == b"flown"
    assert plan.is_file()


def test_a_model_takes_what_was_seen_elsewhere_and_keeps_its_own(tmp_path: Path, stick: FolderTarget) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    terrain = add_terrain(one)
    send(one, stick)
    bring(two, stick)
    mine, theirs = (root / "terrains" / terrain for root in (one, two))
    (mine / "seen-1111111111111111.npz").write_bytes(b"by one")
    (theirs / "seen-2222222222222222.npz").write_bytes(b"by two")
    write_plan(one, "By one", plan_id="feedc0de00000002", seen_id="1111111111111111")
    write_plan(two, "By two", plan_id="feedc0de00000003", seen_id="2222222222222222")
    send(one, stick)
    bring(two, stick)
    send(two, stick)
    bring(one, stick)
    assert shared_files(one) == shared_files(two)
    assert len(shared_files(one)) == 6
    heights = (mine / "elevation.npy").read_bytes()
    (mine / "elevation.npy").write_bytes(heights[:-1] + bytes([heights[-1] ^ 1]))
    before = shared_files(one)
    brought = bring(one, stick)
    assert brought.done == []
    assert {each.what for each in brought.left_out} == {"The surface model here has the same id and other content."}
    assert shared_files(one) == before
    sent = send(one, stick)
    assert sent.done == []
    assert "one of the two is damaged" in sent.left_out[0].what
    assert bring(tmp_path / "three", stick).whole
    assert (tmp_path / "three" / "terrains" / terrain / "elevation.npy").read_bytes() == (
        theirs / "elevation.npy"
    ).read_bytes()


def test_the_configuration_of_a_radar_file_that_was_given_later_is_what_comes(
    tmp_path: Path, stick: FolderTarget
) -> None:
    from server.library.radar_files import RadarShelf

    one = tmp_path / "one"
    file_id = add_radar(one)
    send(one, stick)
    RadarShelf(one, lambda error: None).set_cfg(file_id, b"a configuration", "a.cfg")
    send(one, stick)
    assert bring(tmp_path / "two", stick).whole
    assert shared_files(tmp_path / "two") == shared_files(one)


def test_names_that_are_no_names_elsewhere_are_sent_under_plain_ones(tmp_path: Path, stick: FolderTarget) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    names = ["Flug Süd.tlog", "con.tlog", "a:b.bin", "x" * 200 + ".ulg", "-.tlog", "..tlog", "CON.TLOG.bin"]
    for number, name in enumerate(names):
        add_recording(one, name, b"%d" % number)
    assert send(one, stick).done
    brought = bring(two, stick)
    assert len(brought.done) == len([name for name in names if not name.startswith(".")])
    assert all(shared_items.is_name("recording", path.name) for path in (two / "recordings").iterdir())
    assert send(two, stick).done == []
    assert bring(one, stick).done == []


def test_what_is_damaged_or_has_no_readable_name_stops_nothing(tmp_path: Path, stick: FolderTarget) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    full_library(one)
    add_recording(one, os.fsdecode(b"\xff\xfe.tlog"), b"of a camera's disk")
    send(one, stick)
    (damaged,) = (one / "terrains").iterdir()
    (damaged / "manifest.json").write_text("{")
    sent = send(one, stick)
    assert f"terrains/{damaged.name}" in {each.where for each in sent.left_out}
    assert sent.stopped is None
    brought = bring(one, stick)
    assert [each.what for each in brought.left_out] == ["A damaged surface model stands here under its id."]
    assert (damaged / "manifest.json").read_text() == "{"
    assert len(bring(two, stick).done) == 8


def test_dry_runs_change_nothing(tmp_path: Path, stick: FolderTarget) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    full_library(one)
    would = send(one, stick, dry_run=True)
    assert (len(would.done), list(stick.folder.iterdir()), (one / "shared-versions.json").exists()) == (7, [], False)
    assert would.moved_bytes == send(one, stick).moved_bytes
    would = bring(two, stick, dry_run=True)
    assert (len(would.done), two.exists()) == (7, False)
    assert would.moved_bytes == bring(two, stick).moved_bytes


def test_pull_waits_for_no_server_and_push_needs_none(tmp_path: Path, stick: FolderTarget) -> None:
    root = tmp_path / "one"
    full_library(root)
    lock = DirectoryLock(root)
    try:
        assert send(root, stick).whole
        with pytest.raises(DataDirError, match="uses this data directory"):
            bring(root, stick)
    finally:
        lock.release()


def test_a_disk_without_room_is_said_before_anything_is_brought(
    tmp_path: Path, stick: FolderTarget, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_library(tmp_path / "one")
    send(tmp_path / "one", stick)
    monkeypatch.setattr(pull, "SPARE_BYTES", 1 << 60)
    with pytest.raises(StorageFullError, match="are to come"):
        bring(tmp_path / "two", stick)
    assert shared_files(tmp_path / "two") == {}


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("no-such-folder", "There is no such folder"),
        ("s3://me:secret@bucket/x", "password"),
        ("s3://me:sec/ret@bucket/x", "password"),
        ("s3://me:sec?ret@bucket/x", "password"),
        ("s3://me:sec#ret@bucket/x", "password"),
        ("s3://me@bucket/x", "a user"),
        ("https://host/x?token=me:secret", "a query"),
        ("file://media/x", "names no host"),
        ("nosuch://[bad", "not installed|cannot be opened"),
        ("simplecache::memory://x", "Chained"),
        ("nosuch://x", "not installed|cannot be opened"),
    ],
)
def test_targets_that_are_none(place: str, words: str) -> None:
    with pytest.raises(TargetError, match=words) as refused:
        open_target(place)
    assert not any(word in str(refused.value) for word in ("me:", "ret@", "token="))


def test_without_the_extra_a_folder_works_and_a_url_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr("importlib.import_module", absent)
    with pytest.raises(TargetError, match=r"s3:// is not installed.*hedgehop\[store\]"):
        StoreTarget("s3://bucket/prefix")
    assert open_target(str(tmp_path)).sizes(BLOBS) == {}


def test_a_target_inside_the_data_directory_or_without_a_library_is_refused(
    tmp_path: Path, stick: FolderTarget
) -> None:
    root = tmp_path / "one"
    full_library(root)
    with pytest.raises(TargetError, match="in the data directory itself"):
        send(root, FolderTarget(root / "recordings"))
    with pytest.raises(TargetError, match="No library was pushed here"):
        bring(root, stick)
    with pytest.raises(DataDirError, match="no such data directory"):
        send(tmp_path / "nowhere", stick)


RECORDINGS = st.dictionaries(
    st.sampled_from(["a.tlog", "b.bin", "c.ulg", "d e.tlog", "é.bin"]), st.binary(max_size=70), min_size=1
)


@settings(max_examples=15, deadline=None)
@given(
    held=RECORDINGS, other=RECORDINGS, push_at=st.integers(0, 30), pull_at=st.integers(0, 30), torn=st.booleans(),
    plan=st.booleans(),
)  # fmt: skip
def test_wherever_it_breaks_off_the_next_ones_end_with_the_same_content(
    held: dict[str, bytes], other: dict[str, bytes], push_at: int, pull_at: int, torn: bool, plan: bool
) -> None:
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as small:
        small.setattr(shared_items, "CHUNK_BYTES", 16)
        small.setattr(local_items, "CHUNK_BYTES", 16)
        small.setattr(os, "fsync", lambda handle: None)  # no power goes here, and disks are slow at it
        base = Path(folder)
        one, two, three, disk = (base / name for name in ("one", "two", "three", "disk"))
        disk.mkdir()
        for root, files in ((one, held), (two, other)):
            for name, data in files.items():
                add_recording(root, name, data)
        if plan:
            write_plan(one, "Plan")
        mine = shared_files(two)
        broken = BreakingTarget(disk, at=push_at, torn=torn)
        before = _try(send, one, broken)
        assert before.stopped is not None or broken.calls <= push_at
        # What broke off left a target that is whole: all that it names can be had.
        if (disk / FOLDER / "items").is_dir():
            catalog = read_catalog(FolderTarget(disk), lambda step, share: None)
            assert all(not catalog.missing(item.files) for item in catalog.items)
        assert send(one, FolderTarget(disk)).stopped is None
        _try(bring, two, BreakingTarget(disk, at=pull_at))
        assert {name: shared_files(two)[name] for name in mine} == mine
        assert bring(two, FolderTarget(disk)).whole
        assert {name: shared_files(two)[name] for name in mine} == mine
        assert set(shared_files(two).values()) == {*shared_files(one).values(), *mine.values()}
        assert bring(three, FolderTarget(disk)).whole
        assert sorted(set(shared_files(three).values())) == sorted(set(shared_files(one).values()))
        assert bring(two, FolderTarget(disk)).moved_bytes == 0


def _try(what, root: Path, target: Target) -> Outcome:
    try:
        return what(root, target)
    except TargetError:
        outcome = Outcome()
        outcome.stopped = local_items.LeftOut("", "")
        return outcome
