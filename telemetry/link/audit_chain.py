"""How the audit log's lines are chained: each names the one before, under a key of this machine.

Who has not the key cannot make a line that fits, nor mend the chain behind one that was changed. Lines that were
removed from the end are missed by whoever holds a later line's hash: every recording does.

A power cut while a line is being written leaves its beginning. That is the beginning of a line that would have fitted,
at the end of the log; the line that is written next says how long it is. All else that is no entry breaks the chain.
"""

from __future__ import annotations

import hashlib
import hmac
import io
import json
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FIRST = "0" * 64
"""Stands for the line before the first one."""
AT_ONCE = 200
"""Lines that are checked before others have their turn."""


@dataclass(frozen=True, slots=True)
class Broken:
    """The first place where the chain does not hold; 1 is the first line."""

    line: int
    why: str


@dataclass(frozen=True, slots=True)
class Checked:
    """``hashes``: of the lines that hold."""

    lines: int
    hashes: frozenset[str]
    broken: Broken | None
    torn: tuple[int, ...] = ()
    """Lines of which a power cut has left the beginning; their entries are lost."""


def log_id(key: bytes) -> str:
    """Which log it is, as each recording says it; empty without a key. It tells nothing of the key."""
    return hmac.new(key, b"hedgehop audit log", hashlib.sha256).hexdigest() if key else ""


def check_chain(content: bytes, key: bytes = b"") -> Broken | None:
    """Where the chain of an audit log's content is broken first; None: every line is as it was written."""
    return check_lines(io.BytesIO(content), key).broken


def check_file(path: Path, key: bytes, length: int | None = None) -> Checked:
    """The first ``length`` bytes, line by line. Waits for the disk. Raises OSError."""
    with path.open("rb") as file:
        return check_lines(_until(file, length), key)


def check_lines(lines: Iterable[bytes], key: bytes) -> Checked:
    """Each with its line end."""
    before, hashes, number, line = FIRST, set[str](), 0, b""
    torn: list[int] = []
    left: bytes | None = None
    """The beginning of the line before, which has to be the end of the log or to be named by this line."""
    for number, line in enumerate(lines, start=1):
        entry = parsed(line)
        if left is None and entry is None and is_beginning(line, before):
            left = line.removesuffix(b"\n")
            torn.append(number)
            continue
        why = ""
        if left is not None and (entry is None or entry.get("torn") != len(left)):
            number, why = number - 1, "The line is no entry, and the next one does not say that it was cut off."
        elif entry is None:
            why = "The line is no entry."
        elif entry.get("before") != before:
            why = "The line does not follow the one before it: lines were changed, removed or added."
        elif not hmac.compare_digest(str(entry.get("hash")), _hash(entry, key)):
            why = "The line was changed."
        if entry is None or why:
            return Checked(number, frozenset(hashes), Broken(number, why), tuple(torn))
        before, left = entry["hash"], None
        hashes.add(before)
        if number % AT_ONCE == 0:
            time.sleep(0.001)  # a long log is checked beside what feeds a vehicle
    if left is not None and line.endswith(b"\n"):
        return Checked(number, frozenset(hashes), Broken(number, "The line is no entry."), tuple(torn[:-1]))
    return Checked(number, frozenset(hashes), None, tuple(torn))


def is_beginning(line: bytes, before: str) -> bool:
    """Of an entry that follows ``before``, as far as it goes; what the disk never got may be zeros."""
    written, wanted = line.removesuffix(b"\n").rstrip(b"\0"), _beginning(before)
    return written[: len(wanted)] == wanted[: len(written)]


def chained(entry: dict[str, Any], before: str, key: bytes) -> tuple[bytes, str]:
    """The line, and its hash."""
    linked = {**entry, "before": before}
    hashed = _hash(linked, key)
    return _as_json({**linked, "hash": hashed}) + b"\n", hashed


def parsed(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) else None


def _until(file: Iterable[bytes], length: int | None) -> Iterable[bytes]:
    read = 0
    for line in file:
        if length is not None and read >= length:
            return
        read += len(line)
        yield line


def _hash(entry: dict[str, Any], key: bytes) -> str:
    kept = {name: value for name, value in entry.items() if name != "hash"}
    return hmac.new(key, _as_json(kept), hashlib.sha256).hexdigest()


def _beginning(before: str) -> bytes:
    # Keys are sorted: no other one comes before this one.
    return _as_json({"before": before})[:-1]


def _as_json(entry: dict[str, Any]) -> bytes:
    # Escaped throughout: a line break in a name must not become a second line.
    return json.dumps(entry, sort_keys=True, ensure_ascii=True, separators=(",", ":")).encode()
