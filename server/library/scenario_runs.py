"""What scenarios came to: ``scenarios/<id>/manifest.json``, the last of them kept."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict

from server.library.shelf import OnDamage, Shelf, write_manifest
from server.library.whole_files import new_directory
from server.schemas import ScenarioResultDoc, ScenarioRunDoc

FOLDER = "scenarios"
MOST_KEPT = 50


class ScenarioManifest(BaseModel):
    model_config = ConfigDict(frozen=True)

    format: int = 1
    doc: ScenarioResultDoc


class ScenarioShelf:
    """Blocking calls, for threads."""

    def __init__(self, root: Path, on_damage: OnDamage) -> None:
        self._root = root / FOLDER
        self._shelf = Shelf(root, kind="scenario's result", folder=FOLDER, model=ScenarioManifest, on_damage=on_damage)

    def runs(self) -> list[ScenarioRunDoc]:
        """Newest first; from memory."""
        runs = [manifest.doc.run for manifest in self._shelf.manifests.values()]
        return sorted(runs, key=lambda run: (run.started_utc, run.id), reverse=True)

    def get(self, run_id: str) -> ScenarioResultDoc:
        """Raises NotFoundError."""
        return self._shelf.get(run_id).doc

    def add(self, doc: ScenarioResultDoc) -> None:
        """Keeps it, and lets the oldest go where there are too many. Raises StorageError."""
        manifest = ScenarioManifest(doc=doc)
        with new_directory(self._root / doc.run.id) as folder:
            write_manifest(folder, manifest)
        self._shelf.put(doc.run.id, manifest)
        for run in self.runs()[MOST_KEPT:]:
            self._shelf.remove(run.id)

    def delete(self, run_id: str) -> None:
        """Raises NotFoundError."""
        self._shelf.remove(run_id)
