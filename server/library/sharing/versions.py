"""Which versions of each thing this machine has had: what is changed here says what it was made of.

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


class Versions:
    """By key (``server.library.sharing.shared_items.Item.key``), contents in the order in which they were had."""

    def __init__(self, root: Path) -> None:
        self._file = root / FILE
        self._had: dict[str, dict[str, None]] = defaultdict(dict)
        self._changed = False
        for key, contents in _read(self._file).items():
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

    def save(self) -> None:
        """Raises StorageError."""
        if self._changed:
            kept = {key: list(contents)[-MOST_VERSIONS:] for key, contents in self._had.items() if contents}
            write_atomically(self._file, _Kept(versions=kept).model_dump_json().encode())
            self._changed = False


def _read(file: Path) -> dict[str, list[str]]:
    try:
        with storage_errors(file):
            return _Kept.model_validate_json(file.read_bytes()).versions if file.is_file() else {}
    except ValidationError:
        return {}
