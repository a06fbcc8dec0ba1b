"""The audit log: written before the command, chained, continued, and honest about tampering and full disks."""

from __future__ import annotations

import contextlib
import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import RecordingError, RecordingFullError
from telemetry.link.audit import AuditLog, open_audit
from telemetry.link.audit_chain import check_chain, check_file
from telemetry.link.keys import audit_key_file
from telemetry.topics.messages import CommandRecord


def record(words: str = "arm", *, t_utc_s: float = 1.0) -> CommandRecord:
    return CommandRecord(t_utc_s=t_utc_s, operator="Ada", words=words)


def written(path: Path, *words: str) -> bytes:
    with AuditLog(path) as log:
        for word in words:
            log.write(record(word))
    return path.read_bytes()


def entries_of(path: Path) -> list[dict[str, Any]]:
    """Those that can be read."""
    entries = []
    for line in path.read_bytes().splitlines():
        with contextlib.suppress(ValueError):
            entries.append(json.loads(line))
    return entries


def test_each_command_is_one_line_that_names_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with AuditLog(path) as log:
        first = log.write(record("arm"))
        second = log.write(record("upload 88 items"))
    entries = entries_of(path)
    assert [entry["words"] for entry in entries] == ["arm", "upload 88 items"]
    assert entries[0]["hash"] == first == entries[1]["before"]
    assert entries[1]["hash"] == second
    assert check_chain(path.read_bytes()) is None


def test_a_log_that_exists_is_continued(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    written(path, "arm")
    content = written(path, "disarm")
    assert len(content.splitlines()) == 2
    assert check_chain(content) is None
    with AuditLog(path) as log:
        assert log.check() == ""


def test_only_the_owner_may_read_it(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    written(path, "arm")
    assert path.stat().st_mode & 0o077 == 0


def test_a_changed_line_is_told(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    content = written(path, "arm", "start", "land")
    path.write_bytes(content.replace(b'"start"', b'"stare"'))
    with AuditLog(path) as log:
        assert "BROKEN at line 2." in log.check()


@pytest.mark.parametrize("gone", [0, 1])
def test_a_removed_line_is_told(tmp_path: Path, gone: int) -> None:
    lines = written(tmp_path / "audit.jsonl", "arm", "start", "land").splitlines(keepends=True)
    broken = check_chain(b"".join(line for k, line in enumerate(lines) if k != gone))
    assert broken is not None
    assert broken.line == gone + 1


def test_swapped_and_foreign_lines_are_told(tmp_path: Path) -> None:
    one, two, three = written(tmp_path / "audit.jsonl", "arm", "start", "land").splitlines(keepends=True)
    cut = two[:-20] + b"\n"
    for content, line in (
        (two + one + three, 1),
        (one + b"nonsense\n" + two, 2),
        (one + b"[1]\n", 2),
        (b"\xff\n", 1),
        (one + cut, 2),
        (one + cut + two + three, 2),
        (one + cut + cut, 2),
        (one + three[:-20], 2),
    ):
        broken = check_chain(content)
        assert broken is not None
        assert broken.line == line


@given(data=st.data())
def test_any_flipped_bit_is_told(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.mktemp("audit") / "audit.jsonl"
    content = bytearray(written(path, "arm", "start"))
    place = data.draw(st.integers(0, len(content) - 1))
    content[place] ^= 1 << data.draw(st.integers(0, 7))
    path.with_suffix(".flipped").write_bytes(content)
    checked = check_file(path.with_suffix(".flipped"), b"")
    assert checked.broken or checked.torn or same_entries(bytes(content), path.read_bytes())


def same_entries(a: bytes, b: bytes) -> bool:
    """A line end or a blank may be written in another way without a change of what is said."""
    return [json.loads(line) for line in a.splitlines()] == [json.loads(line) for line in b.splitlines()]


@pytest.mark.parametrize("zeros", [0, 100])
@pytest.mark.parametrize("lost", [1, 20, 150, 10_000])
def test_a_line_that_a_power_cut_has_cut_off_is_no_break_and_the_chain_goes_on(
    tmp_path: Path, lost: int, zeros: int
) -> None:
    path = tmp_path / "audit.jsonl"
    first = written(path, "arm")
    last = written(path, "start")[len(first) :]
    left = last[:-lost].rstrip(b"\n") + bytes(zeros)
    path.write_bytes(first + left)
    with AuditLog(path) as log:
        assert log.check() == ""
        log.write(record("land"))
    checked = check_file(path, b"")
    assert checked.broken is None
    is_lost = lost > 1 or zeros > 0
    assert checked.torn == ((2,) if is_lost and left else ())
    words = [entry["words"] for entry in entries_of(path)]
    assert words == (["arm", "land"] if is_lost else ["arm", "start", "land"])
    path.write_bytes(path.read_bytes().replace(left + b"\n", b""))
    assert not is_lost or check_file(path, b"").broken is None  # what was lost is lost, and nothing else


def test_line_breaks_in_a_name_stay_in_their_line(tmp_path: Path) -> None:
    content = written(tmp_path / "audit.jsonl", 'evil"\n{"words": "arm"}\r\u2028')
    assert len(content.splitlines()) == 1
    assert check_chain(content) is None


def test_a_full_disk_is_told_and_leaves_no_half_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "audit.jsonl"
    written(path, "arm")
    whole_write = os.write
    with AuditLog(path) as log:

        def full(descriptor: int, data: Any) -> int:
            monkeypatch.setattr(os, "write", fails)
            return whole_write(descriptor, bytes(data[:10]))

        def fails(descriptor: int, data: Any) -> int:
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(os, "write", full)
        with pytest.raises(RecordingFullError, match="was not sent"):
            log.write(record("start"))
        monkeypatch.setattr(os, "write", whole_write)
        log.write(record("land"))
    content = path.read_bytes()
    assert check_chain(content) is None
    assert [entry["words"] for entry in entries_of(path)] == ["arm", "land"]


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be written"):
        AuditLog(tmp_path / "missing" / "audit.jsonl")


def test_every_line_is_on_the_disk_before_write_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    path = tmp_path / "audit.jsonl"
    really = os.fsync
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(path.stat().st_size) or really(descriptor))
    with AuditLog(path) as log:
        log.write(record("arm"))
        assert synced == [path.stat().st_size]


def test_who_has_not_the_key_cannot_mend_the_chain(tmp_path: Path) -> None:
    path, key_file = tmp_path / "audit.jsonl", audit_key_file(tmp_path)
    with open_audit(path, key_file) as log:
        log.write(record("arm"))
    assert key_file.stat().st_mode & 0o077 == 0
    assert key_file.parent.stat().st_mode & 0o077 == 0
    path.unlink()
    written(path, "something else", "arm")  # a whole chain, under no key
    with open_audit(path, key_file) as log:
        assert "BROKEN at line 1. The line was changed." in log.check()
        assert log.note == ""


def test_a_log_without_a_key_is_set_aside_and_that_is_said(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    before = written(path, "arm")
    with open_audit(path, audit_key_file(tmp_path)) as log:
        (aside,) = tmp_path.glob("audit-until-*.jsonl")
        assert aside.read_bytes() == before
        assert aside.name in log.check()
        log.write(record("start"))
    with open_audit(path, audit_key_file(tmp_path)) as log:
        assert log.check() == ""


def test_what_came_of_a_command_stands_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with AuditLog(path) as log:
        log.write(record("disarm"))
        log.write(CommandRecord(2.0, "Ada", "disarm", "not done: The vehicle is in the air."))
    assert [entry.get("result") for entry in entries_of(path)] == [None, "not done: The vehicle is in the air."]
    assert check_chain(path.read_bytes()) is None


def test_a_check_looks_at_what_was_there_before_however_much_is_written_meanwhile(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    written(path, *["arm"] * 1000)
    with AuditLog(path) as log:
        length = path.stat().st_size
        log.write(record("start"))
        assert log.check() == ""
        assert check_file(path, b"", length).lines == 1000
        assert log.head in check_file(path, b"").hashes
