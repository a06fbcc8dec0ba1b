"""What is known of the mission on board: the plan it came from, kept on disk so that a new server knows it again."""

from __future__ import annotations

import json
import math
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import msgspec

from server.library.whole_files import write_atomically
from server.schemas import FenceDoc, OnboardDoc, PlanDoc
from telemetry.errors import MissionUnknownError
from telemetry.topics.messages import LinkStatus, PlanRecord
from telemetry.topics.onboard_lists import Rounded

_ROUNDED_KEPT = 200
"""The page lists them; the sentence counts them all."""


@dataclass(frozen=True, slots=True)
class Onboard:
    """A mission that was uploaded from here and read back."""

    record: PlanRecord
    items: int
    rounded: tuple[Rounded, ...]
    note: str


class Aboard:
    """The plan that was uploaded last, held against what the link says of the vehicle and its mission."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._kept = read_onboard(file)
        self._read_back_mono_s = -math.inf
        self._status: LinkStatus | None = None

    @property
    def record(self) -> PlanRecord | None:
        """Of the mission that is on board, or was when the vehicle was last heard; None for a foreign one."""
        kept, status = self._kept, self._status
        if kept is None or (status is not None and status.mission_digest not in (None, kept.record.digest)):
            return None
        return kept.record

    @property
    def uploaded(self) -> PlanRecord | None:
        """Of the plan that was uploaded last, whatever is on board by now."""
        return None if self._kept is None else self._kept.record

    @property
    def digest(self) -> str:
        """Of the plan that was uploaded last."""
        return "" if self._kept is None else self._kept.record.digest

    @property
    def vehicle(self) -> str | None:
        """Id of the candidate that is adopted."""
        adopted = None if self._status is None else self._status.adopted
        return None if adopted is None else adopted.id

    def known_record(self, digest: str) -> PlanRecord:
        """Raises MissionUnknownError unless the mission of this digest came from here."""
        if self._kept is None or self._kept.record.digest != digest:
            raise MissionUnknownError(
                "The mission on board was not uploaded from this plan.", advice="Upload the plan, then check again."
            )
        return self._kept.record

    def on_link(self, status: LinkStatus) -> None:
        """One that was told before the last read-back, and waited on its way, does not know of that mission yet."""
        if self._kept is not None and status.t_mono_s < self._read_back_mono_s:
            status = _holding(status, self._kept)
        self._status = status

    def read_back(self, kept: Onboard) -> None:
        """The vehicle holds what was sent just now; the link may say so a moment later."""
        self._read_back_mono_s = time.monotonic()
        if self._status is not None:
            self._status = _holding(self._status, kept)
        self._kept = kept

    def certified(self, certificate_json: str) -> None:
        """The mission on board was certified anew."""
        if self._kept is not None:
            record = replace(self._kept.record, certificate_json=certificate_json)
            self._kept = replace(self._kept, record=record)

    def save(self) -> None:
        """Blocks. Raises StorageError."""
        write_atomically(self._file, msgspec.json.encode(self._kept))

    def doc(self, open_plan: PlanDoc) -> OnboardDoc:
        status, kept = self._status, self._kept
        if status is None or status.mission_state != "verified" or kept is None:
            return OnboardDoc(state="unknown" if status is None else status.mission_state)
        if status.mission_digest != kept.record.digest:
            return OnboardDoc(state="verified", digest=status.mission_digest)
        floor_m, ceiling_m = _heights(kept.record.plan_json)
        return OnboardDoc(
            state="verified",
            digest=kept.record.digest,
            plan_name=kept.record.name,
            is_open_plan=is_plan(kept.record, open_plan),
            items=kept.items,
            rounded=list(kept.rounded),
            rounded_note=kept.note,
            taken_up=kept.record.taken_up,
            floor_rel_home_m=floor_m,
            ceiling_rel_home_m=ceiling_m,
        )


def _holding(status: LinkStatus, kept: Onboard) -> LinkStatus:
    return replace(status, mission_state="verified", mission_digest=kept.record.digest)


def onboard(record: PlanRecord, items: int, rounded: Sequence[Rounded]) -> Onboard:
    return Onboard(record, items, tuple(rounded[:_ROUNDED_KEPT]), rounded_note(rounded))


def is_plan(record: PlanRecord, document: PlanDoc) -> bool:
    """Whether flying the document now would be flying this record: names and pictures do not matter."""
    try:
        return _flown_part(json.loads(record.plan_json)) == _flown_part(document.model_dump(mode="json"))
    except ValueError:
        return False


@lru_cache(maxsize=4)
def _heights(plan_json: str) -> tuple[float | None, float | None]:
    """Floor and ceiling above home, of the plan's fence."""
    try:
        fence = FenceDoc.model_validate(json.loads(plan_json).get("fence") or {})
    except (ValueError, AttributeError):
        return None, None
    return fence.floor_rel_home_m, fence.ceiling_rel_home_m


def _flown_part(document: dict[str, object]) -> dict[str, object]:
    # Plans from before obstacles, or a fence, could be taken into them do not say that none were.
    flown = {"seen_id": None, "fence": FenceDoc().model_dump(mode="json"), "rally": []} | document
    return {key: value for key, value in flown.items() if key not in ("name", "orthophoto_id", "seen_lacks")}


def read_onboard(file: Path) -> Onboard | None:
    """None when there is none; a damaged one costs an upload."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=Onboard)
    except (FileNotFoundError, msgspec.MsgspecError):
        return None


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
