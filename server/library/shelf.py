"""A shelf: one folder per thing, named by its id, described by a manifest; damaged ones are set aside."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import BaseModel, ValidationError

from server.errors import NotFoundError, StorageError
from server.library.whole_files import (
    TEMPORARY,
    check_id,
    clean,
    remove_directory,
    storage_errors,
    sync_directory,
    write_durably,
)
from server.schemas import ErrorDoc

MANIFEST = "manifest.json"
M = TypeVar("M", bound=BaseModel)
OnDamage = Callable[[ErrorDoc], None]


class Shelf(Generic[M]):
    """The manifests of one kind, kept in memory; a copy of the dictionary is never half-changed."""

    def __init__(self, root: Path, *, kind: str, folder: str, model: type[M], on_damage: OnDamage) -> None:
        self._kind = kind
        self._path = root / folder
        self._aside = root / "set-aside"
        self._model = model
        self._on_damage = on_damage
        self._reading = threading.Lock()
        self._manifests: dict[str, M] = {}
        with storage_errors(self._path):
            self._path.mkdir(mode=0o700, exist_ok=True)
            clean(self._path)
        self.refresh()

    @property
    def manifests(self) -> dict[str, M]:
        return self._manifests.copy()

    def get(self, item_id: str) -> M:
        """Raises ``NotFoundError``."""
        self.directory(item_id)
        return self._manifests[item_id]

    def directory(self, item_id: str) -> Path:
        """The folder of a thing that exists; raises ``NotFoundError``."""
        if check_id(item_id, kind=self._kind) not in self._manifests:
            raise NotFoundError(
                f"There is no {self._kind} {item_id!r}.", advice="Reload the page for the present list."
            )
        return self._path / item_id

    def new_directory(self, item_id: str) -> Path:
        """Where a thing of this id will stand."""
        return self._path / check_id(item_id, kind=self._kind)

    def put(self, item_id: str, manifest: M) -> None:
        self._manifests[item_id] = manifest

    def remove(self, item_id: str) -> None:
        with self._reading:
            remove_directory(self.directory(item_id))
            del self._manifests[item_id]

    def refresh(self) -> None:
        """Takes in what worker processes have added."""
        with self._reading, storage_errors(self._path):
            for folder in sorted(self._path.iterdir()):
                if folder.is_dir() and folder.name not in self._manifests and not folder.name.startswith(TEMPORARY):
                    self._read(folder)

    def clear_unfinished(self) -> None:
        """Removes folders that never got their names; a folder being removed goes the sooner."""
        clean(self._path)

    def set_aside(self, folder: Path, reason: str) -> None:
        """Moves what cannot be read out of the way and tells so; nothing is ever deleted for being damaged."""
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")
        place = self._aside / f"{folder.parent.name}-{folder.name}-{stamp}"
        with storage_errors(folder):
            self._aside.mkdir(mode=0o700, exist_ok=True)
            os.rename(folder, place)
            sync_directory(self._aside)
        self._manifests.pop(folder.name, None)
        self._on_damage(
            ErrorDoc(
                code=StorageError.code,
                what=f"A {self._kind} could not be read: {reason}.",
                where=str(place),
                advice="It was moved there untouched; everything else is in place.",
            )
        )

    def _read(self, folder: Path) -> None:
        try:
            check_id(folder.name, kind=self._kind)
            self._manifests[folder.name] = read_manifest(folder, self._model)
        except NotFoundError:
            self.set_aside(folder, "its folder has a foreign name")
        except StorageError as error:
            self.set_aside(folder, error.what.rstrip("."))


def read_manifest(folder: Path, model: type[M]) -> M:
    """Raises ``StorageError`` when it is missing or damaged."""
    try:
        with storage_errors(folder):
            data = _read_if_there(folder / MANIFEST)
        if data is None:
            raise _damaged(folder, f"{MANIFEST} is missing")
        return model.model_validate_json(data)
    except ValidationError as error:
        fault = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(str(part) for part in fault["loc"])
        raise _damaged(folder, f"{MANIFEST} is damaged ({place or 'the whole'}: {fault['msg']})") from error


def _read_if_there(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def write_manifest(folder: Path, manifest: BaseModel) -> None:
    """Into a folder that has no name yet."""
    write_durably(folder / MANIFEST, lambda file: file.write(manifest.model_dump_json().encode()))


def utc_now() -> str:
    return iso_utc(time.time())


def iso_utc(t_utc_s: float) -> str:
    """ISO 8601 with milliseconds and Z."""
    return datetime.fromtimestamp(t_utc_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _damaged(folder: Path, what: str) -> StorageError:
    return StorageError(f"{what}.", where=str(folder), advice="Delete the entry and add it again.")
