"""The library: everything that Hedgehop keeps, under one data directory and one lock.

All methods are plain blocking calls, safe to run in threads (``asyncio.to_thread``). Surface models and
orthophotos are written by worker processes (``store_terrain``, ``store_orthophoto``); ``refresh`` takes them in.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

from pydantic import ValidationError

from planning.errors import PlanningError
from planning.missions.vehicle_profile import load_profile, shipped_profiles
from planning.terrain.dsm import Dsm
from planning.terrain.orthophoto import Orthophoto
from server.errors import DataDirError, StorageError, StorageFullError, error_doc
from server.library import orthophotos, plans, terrains
from server.library.directory_lock import DirectoryLock
from server.library.documents import doc_from_profile
from server.library.history import History
from server.library.orthophotos import MeshManifest, OrthophotoManifest
from server.library.plans import PlanSummary
from server.library.reserve import Reserve
from server.library.shelf import Shelf
from server.library.terrains import TerrainManifest
from server.library.whole_files import clean, new_id, storage_errors, write_atomically
from server.schemas import (
    ErrorDoc,
    LibraryMessage,
    LibraryState,
    MeshDoc,
    OrthophotoDoc,
    PlanEntry,
    ProfileEntry,
    TerrainDoc,
)
from server.schemas.station_docs import FIRST_VEHICLE

VEHICLES = "vehicles"
"""What is kept of each vehicle but the first one, whose things lie in the data directory itself."""
SEEN = "seen-"
_KEPT_IN = (f"{plans.FOLDER}/**/*.json", "set-aside/**/*.json", "*.json", "run/*.json", f"{VEHICLES}/**/*.json")
"""Plans with all their undo steps, damaged ones that were set aside, and what is on board of a vehicle."""
_LAST_PLAN = "last-plan"
_PROFILES = "profiles"


class Library:
    """Opens and locks the directory, clears what is half-written or in no plan any more, sets damaged things aside."""

    def __init__(self, data_dir: Path) -> None:
        self.root = data_dir.expanduser().absolute()
        self.notices: list[ErrorDoc] = []
        """What was set aside, to be shown to the operator."""
        self._change = threading.RLock()
        self.reserve = Reserve(self.root)
        self._lock = _open_directory(self.root, self.reserve)
        try:
            self._uploads = self._empty_folder("uploads")
            told = self.notices.append
            self._terrains = Shelf(
                self.root, kind="surface model", folder=terrains.FOLDER, model=TerrainManifest, on_damage=told
            )
            self._orthophotos = Shelf(
                self.root, kind="orthophoto", folder=orthophotos.FOLDER, model=OrthophotoManifest, on_damage=told
            )
            self._meshes = Shelf(
                self.root, kind="textured mesh", folder=orthophotos.MESHES, model=MeshManifest, on_damage=told
            )
            self._plans = Shelf(self.root, kind="plan", folder=plans.FOLDER, model=PlanSummary, on_damage=told)
            self._profiles, unreadable = read_profiles(self.root / _PROFILES)
            self.notices += unreadable + _remove_unneeded(self.root)
        except BaseException:
            self._lock.release()
            raise

    def close(self) -> None:
        self._lock.release()

    def refresh(self) -> None:
        """Takes in what worker processes have stored."""
        self._terrains.refresh()
        self._orthophotos.refresh()
        self._meshes.refresh()

    def clear_unfinished(self) -> None:
        """Removes what a killed worker left half-stored; only while no worker stores anything."""
        self._terrains.clear_unfinished()
        self._orthophotos.clear_unfinished()
        self._meshes.clear_unfinished()

    def state(self) -> LibraryState:
        """From memory: quick enough for the event loop."""
        return LibraryState(
            terrains=self.terrains(),
            orthophotos=self.orthophotos(),
            meshes=self.meshes(),
            plans=self.plans(),
            profiles=self.profiles(),
        )

    def message(self) -> LibraryMessage:
        return LibraryMessage(library=self.state())

    def new_upload(self, suffix: str = "") -> Path:
        """Where to stream an upload; whoever used it deletes it, and the next start clears what was left."""
        return self._uploads / f"{new_id()}{suffix}"

    def vehicle_dir(self, number: int) -> Path:
        """What is kept of a vehicle: its nodes' sockets, its recordings, its plan on board, its log of commands."""
        return self.root if number == FIRST_VEHICLE else self.root / VEHICLES / str(number)

    def vehicle_dirs(self) -> dict[int, Path]:
        """Of each but the first that there ever was, by its number."""
        found = (self.root / VEHICLES).glob("[1-9]*")
        return {int(path.name): path for path in sorted(found) if path.name.isdecimal() and path.is_dir()}

    # Surface models and orthophotos

    def terrains(self) -> list[TerrainDoc]:
        return sorted((m.doc for m in self._terrains.manifests.values()), key=lambda doc: doc.added_utc)

    def terrain_dir(self, terrain_id: str) -> Path:
        """The folder of a surface model; raises ``NotFoundError``."""
        return self._terrains.directory(terrain_id)

    def load_terrain(self, terrain_id: str) -> Dsm:
        """The model with its heights memory-mapped, read-only."""
        return terrains.load_terrain(self.terrain_dir(terrain_id))

    def delete_terrain(self, terrain_id: str) -> None:
        """With its orthophotos and meshes. Whether a plan still needs it is the caller's question (``plans_using``)."""
        with self._change:
            self.terrain_dir(terrain_id)
            for photo in self.orthophotos():
                if photo.terrain_id == terrain_id:
                    self._orthophotos.remove(photo.id)
            for mesh in self.meshes():
                if mesh.terrain_id == terrain_id:
                    self._meshes.remove(mesh.id)
            self._terrains.remove(terrain_id)

    def orthophotos(self) -> list[OrthophotoDoc]:
        return sorted((m.doc for m in self._orthophotos.manifests.values()), key=lambda doc: doc.added_utc)

    def orthophoto_dir(self, photo_id: str) -> Path:
        """The folder of an orthophoto; raises ``NotFoundError``."""
        return self._orthophotos.directory(photo_id)

    def load_orthophoto(self, photo_id: str) -> Orthophoto:
        return orthophotos.load_orthophoto(self.orthophoto_dir(photo_id))

    def delete_orthophoto(self, photo_id: str) -> None:
        with self._change:
            self._orthophotos.remove(photo_id)

    def meshes(self) -> list[MeshDoc]:
        """Oldest first."""
        return sorted((m.doc for m in self._meshes.manifests.values()), key=lambda doc: doc.added_utc)

    def mesh_of(self, terrain_id: str | None) -> MeshDoc | None:
        """The newest one of a surface model."""
        return next((doc for doc in reversed(self.meshes()) if doc.terrain_id == terrain_id), None)

    def mesh_dir(self, mesh_id: str) -> Path:
        """The folder of a textured mesh; raises ``NotFoundError``."""
        return self._meshes.directory(mesh_id)

    def delete_mesh(self, mesh_id: str) -> None:
        with self._change:
            self._meshes.remove(mesh_id)

    # Plans

    def plans(self) -> list[PlanEntry]:
        """Newest first."""
        entries = [
            PlanEntry(id=plan_id, name=m.name, terrain_id=m.terrain_id, saved_utc=m.saved_utc)
            for plan_id, m in self._plans.manifests.items()
        ]
        return sorted(entries, key=lambda entry: entry.saved_utc, reverse=True)

    def plans_using(self, terrain_id: str) -> list[str]:
        """Names of the plans on this surface model, as they were saved last."""
        return [entry.name for entry in self.plans() if entry.terrain_id == terrain_id]

    def create_plan(self, history: History) -> tuple[str, History]:
        plan_id = new_id()
        self.save_plan(plan_id, history)
        return plan_id, history

    def save_plan(self, plan_id: str, history: History) -> str:
        """When it was saved. Durable once this returns; raises ``StorageFullError`` with the old version kept."""
        with self._change:
            summary = plans.save_plan(self._plans.new_directory(plan_id), history)
            self._plans.put(plan_id, summary)
        return summary.saved_utc

    def load_plan(self, plan_id: str) -> History:
        """Raises ``NotFoundError``; a damaged plan is set aside and raises ``StorageError``."""
        directory = self._plans.directory(plan_id)
        try:
            return plans.load_plan(directory)
        except (ValueError, StorageError) as error:
            with self._change:
                self._plans.set_aside(directory, "its history is damaged")
            raise StorageError(
                "The plan's file is damaged.", where=plan_id, advice="It was set aside untouched; open another plan."
            ) from error

    def saved_utc(self, plan_id: str) -> str:
        return self._plans.get(plan_id).saved_utc

    def delete_plan(self, plan_id: str) -> None:
        with self._change:
            self._plans.remove(plan_id)

    def remember_plan(self, plan_id: str) -> None:
        """Notes which plan is open, for the next start."""
        self.write_note(_LAST_PLAN, plan_id)

    def last_plan(self) -> str | None:
        """The plan that was open last, if it can still be read."""
        plan_id = self.read_note(_LAST_PLAN)
        if plan_id not in self._plans.manifests or plan_id is None:
            return None
        try:
            self.load_plan(plan_id)
        except StorageError:
            return None
        return plan_id

    # Notes and vehicle profiles

    def read_note(self, name: str) -> str | None:
        """A line that was noted under this name."""
        path = self.root / f"{name}.txt"
        with storage_errors(path):
            return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else None

    def write_note(self, name: str, text: str) -> None:
        with self._change:
            write_atomically(self.root / f"{name}.txt", text.encode())

    def profiles(self) -> list[ProfileEntry]:
        """Those shipped with Hedgehop and the user's own, from TOML files in ``profiles/``, as of the start."""
        return self._profiles

    def _empty_folder(self, name: str) -> Path:
        folder = self.root / name
        with storage_errors(folder):
            folder.mkdir(mode=0o700, exist_ok=True)
            for path in folder.iterdir():
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path)
                else:
                    path.unlink(missing_ok=True)
        return folder


def _remove_unneeded(root: Path) -> list[ErrorDoc]:
    """A file too many is no reason not to start."""
    try:
        remove_unneeded(root)
    except StorageError as error:
        return [error_doc(error)]
    return []


def _open_directory(data_dir: Path, reserve: Reserve) -> DirectoryLock:
    """Raises ``DataDirError`` unless the directory can be made, written and locked. One that is full will do."""
    lock: DirectoryLock | None = None
    try:
        data_dir.mkdir(mode=0o700, parents=True, exist_ok=True)
        lock = DirectoryLock(data_dir)
        reserve.look()
        clean(data_dir)
        _write_format(data_dir / "format.txt")
    except (OSError, StorageError) as error:
        if lock is not None:
            lock.release()
        if isinstance(error, DataDirError):
            raise
        reason = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
        raise DataDirError(
            f"The data directory cannot be written: {reason}.",
            where=str(data_dir),
            advice="Change its permissions, or start with another --data-dir.",
        ) from error
    return lock


def _write_format(file: Path) -> None:
    try:
        write_atomically(file, b"1\n")
    except StorageFullError:
        # What is there can be read, and vehicles can be led: pages are told that the disk is full.
        if not file.is_file():
            raise


def read_profiles(folder: Path) -> tuple[list[ProfileEntry], list[ErrorDoc]]:
    """All profiles by name, and why some of the user's files could not be read."""
    with storage_errors(folder):
        folder.mkdir(mode=0o700, exist_ok=True)
        own = sorted(path for path in folder.glob("*.toml") if path.is_file())
    found = {name: ProfileEntry(id=name, profile=doc_from_profile(load_profile(name))) for name in shipped_profiles()}
    faults: list[ErrorDoc] = []
    for path in own:
        try:
            found[path.stem] = ProfileEntry(id=path.stem, profile=doc_from_profile(load_profile(path)))
        except (PlanningError, ValidationError) as error:
            faults.append(error_doc(error))
    return [found[name] for name in sorted(found)], faults


def remove_unneeded(root: Path) -> list[Path]:
    """Those that were removed. Raises ``StorageError``; then, and in doubt, everything stays.

    A file is needed where its id stands, in whatever field and format: ids are random, nothing else reads the same.
    """
    with storage_errors(root):
        folders = [folder for folder in (root / terrains.FOLDER).iterdir() if folder.is_dir()]
        files = [path for folder in folders for path in folder.glob(f"{SEEN}*.npz")]
        left = _not_named(files, kept_texts(root))
        for path in left:
            path.unlink()
        for folder in folders:
            clean(folder)
    return left


def kept_texts(root: Path) -> Iterator[bytes]:
    """In which the id of what was seen stands as long as it is needed. Raises OSError."""
    return (path.read_bytes() for pattern in _KEPT_IN for path in root.glob(pattern))


def _not_named(files: list[Path], texts: Iterator[bytes]) -> list[Path]:
    left = {path.stem.removeprefix(SEEN).encode(): path for path in files}
    while left and (text := next(texts, None)) is not None:
        left = {seen_id: path for seen_id, path in left.items() if seen_id not in text}
    return list(left.values())
