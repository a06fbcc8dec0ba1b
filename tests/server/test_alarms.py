"""What is wrong with the station stands on every page; the log of commands is looked through for whoever asks."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from server.api.access import Parts
from server.door.alarms import Alarms
from server.errors import StorageFullError
from server.schemas import AlarmsMessage, ErrorDoc, ServerMessage
from telemetry.link.audit import open_audit
from telemetry.link.keys import audit_key_file
from telemetry.topics.messages import CommandRecord
from tests.server.running import Running

FULL = ErrorDoc(code="disk_full", what="The disk is full: 3 MB are left.")


class Pages:
    def __init__(self) -> None:
        self.told: list[ServerMessage] = []

    def publish(self, message: ServerMessage) -> None:
        self.told.append(message)


def test_an_alarm_is_told_when_it_begins_changes_and_ends_and_keeps_its_beginning() -> None:
    pages = Pages()
    alarms = Alarms(pages)
    alarms.begin("disk", FULL)
    alarms.begin("disk", FULL)
    alarms.begin("disk", FULL.model_copy(update={"what": "The disk is full: 2 MB are left."}))
    alarms.end("audit")
    alarms.end("disk")
    told = [message.alarms for message in pages.told if isinstance(message, AlarmsMessage)]
    assert [[alarm.error.what[18:22] for alarm in each] for each in told] == [["3 MB"], ["2 MB"], []]
    assert told[0][0].began_utc_s == told[1][0].began_utc_s


@pytest.fixture
def log(served: Running) -> Path:
    folder = served.parts.library.root
    (folder / "audit.jsonl").unlink(missing_ok=True)
    with open_audit(folder / "audit.jsonl", audit_key_file(folder)) as audit:
        audit.write(CommandRecord(1.0, "Ada", "arm"))
        audit.write(CommandRecord(2.0, "Ada", "arm", "done"))
    return folder / "audit.jsonl"


def alarmed(parts: Parts) -> list[str]:
    return [alarm.kind for alarm in parts.alarms.message.alarms]


def test_a_changed_log_is_an_alarm_until_it_is_whole_again(served: Running, log: Path) -> None:
    found = served.http.post("/api/audit/verify").json()
    assert (found["state"], found["verdict"], found["lines"]) == ("whole", ["The audit log is whole: 2 lines."], 2)
    assert [(entry["words"], entry["result"]) for entry in found["newest"]] == [("arm", "done"), ("arm", "")]
    assert alarmed(served.parts) == []

    before = log.read_bytes()
    log.write_bytes(before.replace(b'"Ada"', b'"Eve"', 1))
    with zipfile.ZipFile(io.BytesIO(served.http.get("/api/audit/export").content)) as archive:
        assert "BROKEN at line 1" in archive.read("verdict.txt").decode()
        assert archive.read("commands.csv").decode().splitlines()[0] == "t_utc,operator,words,result"
    assert served.http.get("/api/audit").json()["state"] == "broken"
    assert alarmed(served.parts) == ["audit"]
    log.write_bytes(before)
    assert served.http.post("/api/audit/verify").json()["state"] == "whole"
    assert alarmed(served.parts) == []


def test_a_power_cut_while_a_line_was_written_is_no_break(served: Running, log: Path) -> None:
    log.write_bytes(log.read_bytes()[:-30])
    found = served.http.post("/api/audit/verify").json()
    assert found["state"] == "whole"
    assert found["verdict"][1] == "The last entry was cut off by a power cut. The chain goes on behind it."
    assert alarmed(served.parts) == []


def test_without_a_log_no_command_was_given(served: Running, log: Path) -> None:
    log.unlink()
    assert served.http.post("/api/audit/verify").json()["state"] == "none"


def test_whoever_signs_out_on_a_full_disk_is_out_and_stays_so(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    auth = served.parts.auth
    file = served.parts.library.root / "sessions.json"
    with served.stranger(headers={"Origin": served.origin}) as client:
        client.get("/login", params={"token": auth.new_link_token()})
        kept = file.read_bytes()
        with monkeypatch.context() as full:
            full.setattr("server.door.auth.write_atomically", _full)
            assert client.delete("/api/session").status_code == 204
            assert client.get("/api/state").status_code == 401
            auth.settle()
            assert file.read_bytes() == kept
        auth.settle()
        assert len(file.read_bytes()) < len(kept)
    assert not auth.owes_writing


def _full(path: Path, data: bytes) -> None:
    raise StorageFullError("The disk is full.", where=str(path))
