"""What is known of the mission on board: the plan it came from, kept on disk so that a new server knows it again."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from server.library.whole_files import write_atomically
from server.schemas import PlanDoc
from telemetry.topics.messages import PlanRecord, Rounded

_ROUNDED_KEPT = 200
"""The page lists them; the sentence counts them all."""


@dataclass(frozen=True, slots=True)
class Onboard:
    """A mission that was uploaded from here and read back."""

    record: PlanRecord
    items: int
    rounded: tuple[Rounded, ...]
    note: str


def onboard(record: PlanRecord, items: int, rounded: Sequence[Rounded]) -> Onboard:
    return Onboard(record, items, tuple(rounded[:_ROUNDED_KEPT]), rounded_note(rounded))


def is_plan(record: PlanRecord, document: PlanDoc) -> bool:
    """Whether flying the document now would be flying this record: names and pictures do not matter."""
    try:
        return _flown_part(json.loads(record.plan_json)) == _flown_part(document.model_dump(mode="json"))
    except ValueError:
        return False


def _flown_part(document: dict[str, object]) -> dict[str, object]:
    # Plans from before obstacles could be taken into them do not say that none were.
    flown = {"seen_id": None} | document
    return {key: value for key, value in flown.items() if key not in ("name", "orthophoto_id")}


def read_onboard(file: Path) -> Onboard | None:
    """None when there is none; a damaged one costs an upload."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=Onboard)
    except (FileNotFoundError, msgspec.MsgspecError):
        return None


def write_onboard(file: Path, kept: Onboard) -> None:
    write_atomically(file, msgspec.json.encode(kept))


def rounded_note(rounded: Sequence[Rounded]) -> str:
    """One sentence on what the vehicle changed: "The vehicle cut 12 heights to whole centimetres, at most 0.9 cm." """
    if not rounded:
        return ""
    by_field: dict[str, list[Rounded]] = defaultdict(list)
    for change in rounded:
        by_field[change.field].append(change)
    return "The vehicle " + _joined([_clause(field, changes) for field, changes in by_field.items()]) + "."


def _clause(field: str, changes: list[Rounded]) -> str:
    most = max((abs(c.sent - c.kept) for c in changes if c.sent is not None and c.kept is not None), default=0.0)
    if field == "altitude":
        return f"cut {_count(changes, 'height')} to whole centimetres, at most {100 * most:.1f} cm"
    if field == "parameter 1" and most > 0:
        return f"cut {_count(changes, 'time')} to whole seconds, at most {most:.1f} s"
    if field in ("latitude", "longitude"):
        return f"rounded {_count(changes, field)} by a centimetre"
    return f"dropped {field} of {_count(changes, 'item')}, which changes nothing"


def _count(changes: list[Rounded], noun: str) -> str:
    return f"{len(changes)} {noun}{'' if len(changes) == 1 else 's'}"


def _joined(clauses: list[str]) -> str:
    return clauses[0] if len(clauses) == 1 else ", ".join(clauses[:-1]) + " and " + clauses[-1]
