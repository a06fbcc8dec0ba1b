"""``hedgehop audit``: a whole log, a broken one, and one whose last lines were taken away."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from server.library.audit_log import AuditVerdict, look_through, newest_of, read_key
from server.library.sharing.sharing_targets import FolderTarget
from telemetry.link.audit import open_audit
from telemetry.link.audit_chain import log_id
from telemetry.link.keys import audit_key_file
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import CommandRecord, LinkStatus, Topic
from tests.server.cli_runs import hedgehop
from tests.server.sharing_library import bring, send


def log_in(folder: Path, *words: str) -> str:
    with open_audit(folder / "audit.jsonl", audit_key_file(folder)) as log:
        for word in words:
            log.write(CommandRecord(1.0, "=Ada", word))
        log.write(CommandRecord(2.0, "=Ada", words[-1], "done"))
        return log.head


def test_a_whole_log_is_said_and_written_as_a_table(tmp_path: Path) -> None:
    log_in(tmp_path, "arm", "start")
    out = tmp_path / "commands.csv"
    ran = hedgehop("audit", tmp_path, "--csv", out)
    assert ran.code == 0
    assert "whole: 3 lines" in ran.err
    rows = list(csv.reader(out.read_text(encoding="utf-8").splitlines()))
    assert rows[0] == ["t_utc", "operator", "words", "result"]
    assert rows[-1][1:] == ["'=Ada", "start", "done"]


def test_a_changed_line_is_said(tmp_path: Path) -> None:
    log_in(tmp_path, "arm", "start")
    log = tmp_path / "audit.jsonl"
    log.write_bytes(log.read_bytes().replace(b'"arm"', b'"land"'))
    ran = hedgehop("audit", log)
    assert ran.code == 1
    assert "BROKEN at line 1." in ran.out + ran.err


def test_lines_taken_from_the_end_are_missed_by_the_recording_that_has_seen_them(tmp_path: Path) -> None:
    head = log_in(tmp_path, "arm", "start")
    (tmp_path / "recordings").mkdir()
    writer = RecordingWriter(tmp_path / "recordings" / "flight.mcap", t_utc_s=1.0, t_mono_s=0.0)
    writer.write(Topic.LINK, LinkStatus(1.0, audit_head=head), 2.0)
    writer.close()
    assert hedgehop("audit", tmp_path).code == 0
    log = tmp_path / "audit.jsonl"
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:-1]))
    ran = hedgehop("audit", tmp_path)
    assert ran.code == 1
    assert "LINES ARE MISSING: flight.mcap" in ran.out + ran.err


def recorded(path: Path, head: str, log: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = RecordingWriter(path, t_utc_s=1.0, t_mono_s=0.0)
    writer.write(Topic.LINK, LinkStatus(1.0, audit_head=head, audit_log=log), 2.0)
    writer.close()
    return path


def verdict_of(folder: Path) -> AuditVerdict:
    return look_through(folder / "audit.jsonl", read_key(folder))


@pytest.mark.parametrize("says", ["its log", "no log"])
def test_pulled_recordings_of_another_machine_are_no_alarm(tmp_path: Path, says: str) -> None:
    one, two, stick = tmp_path / "one", tmp_path / "two", tmp_path / "stick"
    stick.mkdir()
    for folder in (one, two):
        log_in(folder, "arm", folder.name)
    head = newest_of([one / "audit.jsonl"], 1)[0]["hash"]
    recorded(one / "recordings" / "flight.mcap", head, log_id(read_key(one)) if says == "its log" else "")
    assert send(one, FolderTarget(stick)).whole
    assert bring(two, FolderTarget(stick)).whole
    verdict = verdict_of(two)
    assert verdict.faults == ()
    assert verdict.notes == ("Pulled, and not held against this log: flight.mcap.",)
    assert verdict_of(one).sentences == ("The audit log is whole: 3 lines.",)


def test_no_list_keeps_a_recording_of_this_machine_from_being_held_against_its_log(tmp_path: Path) -> None:
    head = log_in(tmp_path, "arm", "start")
    recorded(tmp_path / "recordings" / "flight.mcap", head, log_id(read_key(tmp_path)))
    (tmp_path / "shared-versions.json").write_text('{"pulled": ["flight.mcap"]}', encoding="utf-8")
    assert verdict_of(tmp_path).faults == ()
    log = tmp_path / "audit.jsonl"
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:-1]))
    (fault,) = verdict_of(tmp_path).faults
    assert "LINES ARE MISSING: flight.mcap" in fault


def test_a_key_and_log_that_were_begun_anew_are_missed(tmp_path: Path) -> None:
    head = log_in(tmp_path, "arm", "start")
    recorded(tmp_path / "recordings" / "flight.mcap", head, log_id(read_key(tmp_path)))
    (tmp_path / "audit.jsonl").unlink()
    audit_key_file(tmp_path).unlink()
    log_in(tmp_path, "land")
    (fault,) = verdict_of(tmp_path).faults
    assert "or this machine's key was replaced" in fault


def test_nothing_to_look_at_is_said(tmp_path: Path) -> None:
    ran = hedgehop("audit", tmp_path)
    assert ran.code != 0
    assert "There is no audit.jsonl" in ran.out + ran.err


def test_the_newest_of_several_logs_are_told_also_where_somebody_has_changed_a_time(tmp_path: Path) -> None:
    (tmp_path / "1.jsonl").write_text('{"t_utc_s": 5.0, "words": "land"}\n', encoding="utf-8")
    for number, t_utc_s in enumerate(('"x"', "null", "NaN"), start=2):
        (tmp_path / f"{number}.jsonl").write_text(f'{{"t_utc_s": {t_utc_s}, "words": "arm"}}\n', encoding="utf-8")
    newest = newest_of(sorted(tmp_path.glob("*.jsonl")), 3)
    assert [entry["words"] for entry in newest] == ["land", "arm", "arm"]
