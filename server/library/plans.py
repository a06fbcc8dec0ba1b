"""Plans on disk: ``plans/<id>/manifest.json``, the document with its undo history in one file: both always fit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from server.library.history import History
from server.library.shelf import MANIFEST, read_manifest, utc_now, write_manifest
from server.library.whole_files import new_directory, write_atomically

FOLDER = "plans"


class PlanSummary(BaseModel):
    """What of a stored plan stays in memory."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    format: int = 1
    saved_utc: str
    name: str
    terrain_id: str | None


class StoredPlan(PlanSummary):
    history: dict[str, Any]


def save_plan(directory: Path, history: History) -> PlanSummary:
    """Once this returns, the plan survives a kill at any moment; before, the previous version does."""
    stored = StoredPlan(
        saved_utc=utc_now(),
        name=history.present.name,
        terrain_id=history.present.terrain_id,
        history=history.to_json(),
    )
    if directory.is_dir():
        write_atomically(directory / MANIFEST, stored.model_dump_json().encode())
    else:
        with new_directory(directory) as folder:
            write_manifest(folder, stored)
    return PlanSummary.model_validate(stored.model_dump(exclude={"history"}))


def load_plan(directory: Path) -> History:
    """Raises ``ValueError`` or ``StorageError`` when the file is damaged."""
    try:
        return History.from_json(read_manifest(directory, StoredPlan).history)
    except (KeyError, TypeError) as error:
        raise ValueError(f"history lacks {error}") from error
