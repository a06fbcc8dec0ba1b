"""Files of raw radar samples: ``radar/<id>/{manifest.json, samples, configuration}``.

No two files ever have the same name, so that whoever keeps one open by its path never has another.
"""

from __future__ import annotations

import os
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from server.errors import BadRequestError
from server.library.shelf import MANIFEST, OnDamage, Shelf, utc_now, write_manifest
from server.library.whole_files import new_directory, new_id, storage_errors, write_atomically, write_durably
from server.schemas import RadarFileDoc

FOLDER = "radar"
ENDINGS = (".npy", ".bin", ".csv")


class RadarFileManifest(BaseModel):
    model_config = ConfigDict(frozen=True)

    format: int = 1
    doc: RadarFileDoc
    samples: str
    cfg: str = ""
    """File names within the folder; no configuration: empty."""


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

    def paths(self, file_id: str) -> tuple[Path, Path | None]:
        """Samples, and the configuration if there is one. Raises NotFoundError."""
        folder, manifest = self._shelf.directory(file_id), self.get(file_id)
        return folder / manifest.samples, folder / manifest.cfg if manifest.cfg else None

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
            write_atomically(folder / MANIFEST, manifest.model_dump_json().encode())
            if before.cfg:
                (folder / before.cfg).unlink(missing_ok=True)
        self._shelf.put(file_id, manifest)
        return doc

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
