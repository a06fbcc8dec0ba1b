"""The log of commands for people: whether it is whole, its newest entries, and all of it as a table."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from server.library.sharing.versions import pulled_recordings
from server.library.whole_files import storage_errors
from server.schemas.station_docs import FIRST_VEHICLE
from telemetry.errors import RecordingError
from telemetry.link.audit import END_BYTES
from telemetry.link.audit_chain import Checked, check_file, log_id, parsed
from telemetry.link.keys import audit_key_file
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.topics.messages import LinkStatus, Topic

COLUMNS = ("t_utc", "operator", "words", "result")
ADVICE = "Keep a copy of the log and of the recordings, and find out who could write to the data directory."

_NAMED = 5


@dataclass(frozen=True, slots=True)
class AuditVerdict:
    """``faults``: nothing of this happens by itself. ``notes``: what was lost by nobody's doing, or not looked at."""

    lines: int
    faults: tuple[str, ...]
    notes: tuple[str, ...]
    checked_utc_s: float

    @property
    def sentences(self) -> tuple[str, ...]:
        whole = () if self.faults else (f"The audit log is whole: {self.lines} lines.",)
        return (*self.faults, *whole, *self.notes)


def read_key(folder: Path) -> bytes:
    """This machine's key; empty: there is none."""
    file = audit_key_file(folder)
    return file.read_bytes() if file.is_file() else b""


def look_through(log: Path, key: bytes, *, report: object = None) -> AuditVerdict:
    """Holds it against the key and against what the recordings beside it have seen of it. Waits for the disk.

    ``report``: workers give one. Raises StorageError.
    """
    del report
    with storage_errors(log):
        checked = check_file(log, key)
        missing, others = _missing(log.parent, checked, log_id(key))
    torn = (_torn(line, is_last=line == checked.lines) for line in checked.torn)
    return AuditVerdict(checked.lines, (*_broken(checked), *missing), (*torn, *others), time.time())


def joined(verdicts: Mapping[int, AuditVerdict]) -> AuditVerdict:
    """Of the logs of several vehicles, by their numbers; each sentence about another than the first one says so."""

    def said(number: int, sentences: tuple[str, ...]) -> list[str]:
        return [text if number == FIRST_VEHICLE else f"Vehicle {number}: {text}" for text in sentences]

    return AuditVerdict(
        sum(verdict.lines for verdict in verdicts.values()),
        tuple(text for number, verdict in verdicts.items() for text in said(number, verdict.faults)),
        tuple(text for number, verdict in verdicts.items() for text in said(number, verdict.notes)),
        max(verdict.checked_utc_s for verdict in verdicts.values()),
    )


def newest_of(logs: Sequence[Path], count: int) -> list[dict[str, Any]]:
    """Of several logs together, the newest first."""
    entries = [entry for log in logs for entry in newest_entries(log, count)]
    if len(logs) < 2:
        return entries
    return sorted(entries, key=_t_utc_s, reverse=True)[:count]


def _t_utc_s(entry: dict[str, Any]) -> float:
    """Also of an entry whose time somebody has made something else of: just then the log is looked at."""
    t_utc_s = entry.get("t_utc_s")
    return t_utc_s if isinstance(t_utc_s, int | float) and math.isfinite(t_utc_s) else 0.0


def newest_entries(log: Path, count: int) -> list[dict[str, Any]]:
    """The newest first; lines that are no entries are left out."""
    with log.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - END_BYTES))
        lines = file.read().splitlines()
    entries = (parsed(line) for line in reversed(lines))
    return [entry for entry in entries if entry is not None][:count]


def as_table(log: Path) -> str:
    """All of it as CSV."""
    table = io.StringIO(newline="")
    writer = csv.writer(table)
    writer.writerow(COLUMNS)
    for line in log.read_bytes().splitlines():
        entry = parsed(line) or {"words": json.dumps(line.decode(errors="replace")), "result": "not readable"}
        t_utc_s = entry.get("t_utc_s")
        told = datetime.fromtimestamp(t_utc_s, UTC).isoformat() if isinstance(t_utc_s, int | float) else ""
        writer.writerow([told, *(_cell(entry.get(name, "")) for name in COLUMNS[1:])])
    return table.getvalue()


def _cell(value: object) -> str:
    """A program that opens the table must not take a name for a formula."""
    text = str(value)
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\r")) else text


def _broken(checked: Checked) -> list[str]:
    broken = checked.broken
    return [] if broken is None else [f"The audit log is BROKEN at line {broken.line}. {broken.why}"]


def _torn(line: int, *, is_last: bool) -> str:
    if is_last:
        return "The last entry was cut off by a power cut. The chain goes on behind it."
    return f"The entry of line {line} was cut off by a power cut. The chain goes on behind it."


def _missing(folder: Path, checked: Checked, own_id: str) -> tuple[list[str], list[str]]:
    """Faults: lines that a recording of this machine knew and the log has not any more. Notes: what was not looked at.

    A recording that says it is of this log is held against it, whatever else is told; one that says another log, or
    none, is passed over only where it was pulled. Behind a break nothing can be told.
    """
    if checked.broken is not None:
        return [], []
    aside = (line for path in folder.glob("audit-until-*.jsonl") for line in path.read_bytes().splitlines())
    known = checked.hashes | {(parsed(line) or {}).get("hash") for line in aside}
    pulled, faults, others = pulled_recordings(folder), list[str](), list[str]()
    for path in sorted((folder / "recordings").glob("*.mcap")):
        status = _last_status(path)
        if status is None or not status.audit_head.strip("0") or status.audit_head in known:
            continue
        if status.audit_log in ("", own_id):
            why = "was recorded when the log had a line that it has not any more."
        else:
            why = "was recorded beside another log: it was copied here by hand, or this machine's key was replaced."
        if status.audit_log != own_id and path.name in pulled:
            others.append(path.name)
        else:
            faults.append(f"LINES ARE MISSING: {path.name} {why}")
    names = ", ".join(others[:_NAMED]) + (f" and {len(others) - _NAMED} more" if len(others) > _NAMED else "")
    return faults, [f"Pulled, and not held against this log: {names}."] if others else []


def _last_status(path: Path) -> LinkStatus | None:
    """None: it has none, or it cannot be read, which has its own words in Review."""
    try:
        with open_recording(path) as recording:
            last = recording.latest(Topic.LINK, recording.end_utc_s)
    except RecordingError:
        return None
    return last.message if last is not None and isinstance(last.message, LinkStatus) else None
