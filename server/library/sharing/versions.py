"""Which versions of each thing this machine has had, so that what is changed here says what it was made of; and which
recordings were pulled.

Without this file, of a new or restored data directory, nothing is lost: an old version is then brought beside the new.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from server.library.sharing.shared_items import Digest
from server.library.whole_files import storage_errors, write_atomically

FILE = "shared-versions.json"
MOST_VERSIONS = 1000
"""Of one thing; the oldest are forgotten first."""


class _Kept(BaseModel):
    model_config = ConfigDict(extra="ignore")

    format: int = 1
    versions: dict[str, list[Digest]] = {}
    pulled: list[str] = []


class Versions:
    """By key (``server.library.sharing.shared_items.Item.key``), contents in the order in which they were had."""

    def __init__(self, root: Path) -> None:
        self._file = root / FILE
        self._had: dict[str, dict[str, None]] = defaultdict(dict)
        self._changed = False
        kept = _read(self._file)
        self._pulled = dict.fromkeys(kept.pulled)
        for key, contents in kept.versions.items():
            self._had[key] = dict.fromkeys(contents)

    def had(self, key: str) -> tuple[str, ...]:
        return tuple(self._had[key]) if key in self._had else ()

    def add(self, key: str, contents: Iterable[str]) -> None:
        new = [content for content in contents if content not in self._had[key]]
        self._changed |= bool(new)
        self._had[key] |= dict.fromkeys(new)

    def begin(self, key: str, contents: Iterable[str]) -> None:
        """Where nothing stands any more: what stood there was not what the next one is made of."""
        new = dict.fromkeys(contents)
        self._changed |= list(new) != list(self._had[key])
        self._had[key] = new

    def add_pulled(self, name: str) -> None:
        """A recording that comes from another machine, or comes back."""
        self._changed |= name not in self._pulled
        self._pulled[name] = None

    def save(self) -> None:
        """Raises StorageError."""
        if self._changed:
            kept = {key: list(contents)[-MOST_VERSIONS:] for key, contents in self._had.items() if contents}
            write_atomically(self._file, _Kept(versions=kept, pulled=list(self._pulled)).model_dump_json().encode())
            self._changed = False


def pulled_recordings(root: Path) -> frozenset[str]:
    """File names of recordings that were pulled. Raises StorageError."""
    return frozenset(_read(root / FILE).pulled)


def _read(file: Path) -> _Kept:
    try:
        with storage_errors(file):
            return _Kept.model_validate_json(file.read_bytes()) if file.is_file() else _Kept()
    except ValidationError:
        return _Kept()
