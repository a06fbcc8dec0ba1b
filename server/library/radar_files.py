"""Files of raw radar samples: ``radar/<id>/{manifest.json, samples, configuration, capture, tracks}``.

No two files ever have the same name, so that whoever keeps one open by its path never has another.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from server.errors import BadRequestError, ConflictError, NotFoundError
from server.library.shelf import MANIFEST, OnDamage, Shelf, utc_now, write_manifest
from server.library.whole_files import new_directory, new_id, storage_errors, write_atomically, write_durably
from server.schemas import RadarFileDoc, RadarTracksDoc

FOLDER = "radar"
ENDINGS = (".npy", ".bin", ".csv")


class RadarFileManifest(BaseModel):
    model_config = ConfigDict(frozen=True)

    format: int = 1
    doc: RadarFileDoc
    samples: str
    cfg: str = ""
    capture: str = ""
    tracks: str = ""
    """File names within the folder; empty: there is none."""


@dataclass(frozen=True, slots=True)
class RadarPaths:
    samples: Path
    cfg: Path | None
    capture: Path | None


class RadarShelf:
    """Blocking calls, for threads."""

    def __init__(self, root: Path, on_damage: OnDamage) -> None:
        self._root = root / FOLDER
        self._shelf = Shelf(root, kind="radar file", folder=FOLDER, model=RadarFileManifest, on_damage=on_damage)

    def docs(self) -> list[RadarFileDoc]:
        """Newest first; from memory."""
        docs = [manifest.doc for manifest in self._shelf.manifests.values()]
        return sorted(docs, key=lambda doc: (doc.added_utc, doc.id), reverse=True)

    def get(self, file_id: str) -> RadarFileManifest:
        """Raises NotFoundError."""
        return self._shelf.get(file_id)

    def paths(self, file_id: str) -> RadarPaths:
        """Raises NotFoundError."""
        folder, manifest = self._shelf.directory(file_id), self.get(file_id)
        cfg = folder / manifest.cfg if manifest.cfg else None
        return RadarPaths(folder / manifest.samples, cfg, folder / manifest.capture if manifest.capture else None)

    def add(self, upload: Path, name: str) -> RadarFileDoc:
        """Takes an uploaded file in. Raises BadRequestError for another ending, StorageError."""
        suffix = ending_of(name)
        doc = RadarFileDoc(id=new_id(), name=name, bytes=upload.stat().st_size, added_utc=utc_now())
        manifest = RadarFileManifest(doc=doc, samples=f"{doc.id}{suffix}")
        with new_directory(self._root / doc.id) as folder:
            os.rename(upload, folder / manifest.samples)
            write_manifest(folder, manifest)
        self._shelf.put(doc.id, manifest)
        return doc

    def set_cfg(self, file_id: str, data: bytes | None, name: str) -> RadarFileDoc:
        """Gives a file its configuration, or takes it away. Raises NotFoundError, StorageError."""
        folder, before = self._shelf.directory(file_id), self.get(file_id)
        cfg = f"{new_id()}.cfg" if data is not None else ""
        doc = before.doc.model_copy(update={"cfg_name": name if data is not None else ""})
        manifest = before.model_copy(update={"doc": doc, "cfg": cfg})
        with storage_errors(folder):
            if data is not None:
                write_durably(folder / cfg, lambda file: file.write(data))
        self._write(folder, manifest, gone=(before.cfg,))
        return doc

    def set_capture(self, file_id: str, upload: Path | None, name: str) -> RadarFileDoc:
        """Takes in what motion capture saw, or takes it away; tracks that were held against another go with it.

        Raises NotFoundError, StorageError.
        """
        folder, before = self._shelf.directory(file_id), self.get(file_id)
        capture = f"{new_id()}.csv" if upload is not None else ""
        update = {"capture_name": name if upload is not None else "", "has_tracks": False}
        manifest = before.model_copy(
            update={"doc": before.doc.model_copy(update=update), "capture": capture, "tracks": ""}
        )
        with storage_errors(folder):
            if upload is not None:
                os.rename(upload, folder / capture)
        self._write(folder, manifest, gone=(before.capture, before.tracks))
        return manifest.doc

    def set_tracks(self, file_id: str, tracks: RadarTracksDoc, capture: Path) -> RadarFileDoc:
        """Keeps what came out against ``capture``. Raises NotFoundError, ConflictError for another by now."""
        folder, before = self._shelf.directory(file_id), self.get(file_id)
        if before.capture != capture.name:
            what = f"{before.doc.name} was given another capture meanwhile."
            raise ConflictError(what, where=before.doc.name, advice="Follow the poles again.")
        name = f"{new_id()}.json"
        with storage_errors(folder):
            write_durably(folder / name, lambda file: file.write(tracks.model_dump_json().encode()))
        doc = before.doc.model_copy(update={"has_tracks": True})
        self._write(folder, before.model_copy(update={"doc": doc, "tracks": name}), gone=(before.tracks,))
        return doc

    def tracks(self, file_id: str) -> RadarTracksDoc:
        """Raises NotFoundError, StorageError."""
        folder, manifest = self._shelf.directory(file_id), self.get(file_id)
        if not manifest.tracks:
            what = f"{manifest.doc.name} has not been held against a capture yet."
            raise NotFoundError(what, where=manifest.doc.name, advice="Give its optitrack.csv and the poles.")
        with storage_errors(folder):
            return RadarTracksDoc.model_validate_json((folder / manifest.tracks).read_bytes())

    def _write(self, folder: Path, manifest: RadarFileManifest, *, gone: tuple[str, ...]) -> None:
        with storage_errors(folder):
            write_atomically(folder / MANIFEST, manifest.model_dump_json().encode())
            for name in filter(None, gone):
                (folder / name).unlink(missing_ok=True)
        self._shelf.put(manifest.doc.id, manifest)

    def delete(self, file_id: str) -> None:
        """Raises NotFoundError."""
        self._shelf.remove(file_id)


def ending_of(name: str) -> str:
    """Raises BadRequestError for what no reader knows."""
    suffix = Path(name).suffix.lower()
    if suffix not in ENDINGS:
        raise BadRequestError(
            f"{name!r} holds no raw samples: its name ends neither in .npy nor in .bin or .csv.",
            where=name,
            advice="Choose a complex NumPy array (.npy), a DCA1000 capture (.bin) or the ODA data set's radar.csv.",
        )
    return suffix
