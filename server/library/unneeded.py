"""What was seen and is in no kept plan any more: removed at the start, when no job can be about to need it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from server.library import plans, terrains
from server.library.files import clean, storage_errors

_SEEN = "seen-"
_KEPT_IN = (f"{plans.FOLDER}/**/*.json", "set-aside/**/*.json", "*.json", "run/*.json")
"""Plans with all their undo steps, damaged ones that were set aside, and what is on board of a vehicle."""


def remove_unneeded(root: Path) -> list[Path]:
    """Those that were removed. Raises ``StorageError``; then, and in doubt, everything stays.

    A file is needed where its id stands, in whatever field and format: ids are random, nothing else reads the same.
    """
    with storage_errors(root):
        folders = [folder for folder in (root / terrains.FOLDER).iterdir() if folder.is_dir()]
        files = [path for folder in folders for path in folder.glob(f"{_SEEN}*.npz")]
        left = _not_named(files, (path.read_bytes() for pattern in _KEPT_IN for path in root.glob(pattern)))
        for path in left:
            path.unlink()
        for folder in folders:
            clean(folder)
    return left


def _not_named(files: list[Path], texts: Iterator[bytes]) -> list[Path]:
    left = {path.stem.removeprefix(_SEEN).encode(): path for path in files}
    while left and (text := next(texts, None)) is not None:
        left = {seen_id: path for seen_id, path in left.items() if seen_id not in text}
    return list(left.values())
