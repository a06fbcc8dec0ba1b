"""What a target holds: blobs named by their SHA-256, and items, the manifests that name the blobs of one thing.

A file is cut into chunks of ``CHUNK_BYTES``; each is a blob, so that what breaks off goes on at the chunk, memory is
bounded, and neither a store's limit for one object nor FAT's for one file matters. An item's own name is the SHA-256
of its bytes: nothing in a target is ever rewritten with other content, and what is torn is known by its name.

What comes from a target is foreign. Names are taken from an allow-list for each kind, so that none leads out of the
folder that it belongs in, and none of another file of the data directory can be told to anyone.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from server.library.shelf import MANIFEST

CHUNK_BYTES = 8 * 1024**2
MOST_ITEM_BYTES = 8 * 1024**2
"""Of a manifest: enough for a file of 1 TB."""
MOST_TITLE = 200
Kind = Literal["terrain", "orthophoto", "radar", "recording", "plan"]
KINDS: tuple[Kind, ...] = ("terrain", "orthophoto", "radar", "recording", "plan")
"""In the order in which they are pulled: a plan comes after its surface model."""
WORDS: dict[Kind, str] = {
    "terrain": "surface model",
    "orthophoto": "orthophoto",
    "radar": "radar file",
    "recording": "recording",
    "plan": "plan",
}
ALLOWED: dict[Kind, re.Pattern[str]] = {
    "terrain": re.compile(
        r"manifest\.json|(elevation|lowest|seam|cells|bend|points|point_colors)\.npy|seen-[0-9a-z]{1,32}\.npz"
    ),
    "orthophoto": re.compile(r"manifest\.json|pixels\.npy"),
    "radar": re.compile(r"manifest\.json|[0-9a-f]{16}\.(npy|bin|csv|cfg|json)"),
    "recording": re.compile(r"recording\.(mcap|tlog|bin|ulg)"),
    "plan": re.compile(r"manifest\.json"),
}
"""The only files that are ever sent or taken, by their names inside an item."""
_ID = re.compile(r"[0-9a-z]{1,32}")
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,99}\.(mcap|tlog|bin|ulg)", re.IGNORECASE)
_WINDOWS = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)

Digest = Annotated[str, StringConstraints(min_length=64, max_length=64, pattern=r"^[0-9a-f]+$")]


class FileEntry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: Annotated[str, StringConstraints(min_length=1, max_length=100)]
    bytes: Annotated[int, Field(ge=0)]
    chunks: tuple[Digest, ...]
    """SHA-256 of each stretch of ``CHUNK_BYTES``, the last one shorter."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if len(self.chunks) != -(-self.bytes // CHUNK_BYTES):
            raise ValueError(f"{self.bytes} bytes are not {len(self.chunks)} chunks")
        return self

    def chunk_sizes(self) -> list[tuple[str, int]]:
        """Digest and bytes of each chunk, in order."""
        starts = [*range(0, self.bytes, CHUNK_BYTES), self.bytes]
        return [(digest, end - start) for digest, (start, end) in zip(self.chunks, pairwise(starts), strict=True)]


class Item(BaseModel):
    """One thing of a library, as the manifest that stands in a target."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    format: Literal[1] = 1
    kind: Kind
    name: Annotated[str, StringConstraints(min_length=1, max_length=110)]
    """Its id, or a recording's file name."""
    title: Annotated[str, StringConstraints(max_length=MOST_TITLE)]
    """What people call it."""
    files: Annotated[tuple[FileEntry, ...], Field(min_length=1, max_length=1000)]
    after: Annotated[tuple[Digest, ...], Field(max_length=10_000)] = ()
    """Contents of earlier versions that this one was made of."""

    @model_validator(mode="after")
    def _allowed(self) -> Self:
        if not is_name(self.kind, self.name):
            raise ValueError(f"{self.name!r} is no name of a {WORDS[self.kind]}")
        names = [entry.name for entry in self.files]
        if wrong := [name for name in names if not ALLOWED[self.kind].fullmatch(name)]:
            raise ValueError(f"{wrong[0]!r} is no file of a {WORDS[self.kind]}")
        if len(set(names)) != len(names):
            raise ValueError("two files have one name")
        if self.kind == "recording":
            if len(names) != 1 or suffix_of(self.name) != suffix_of(names[0]):
                raise ValueError("a recording is one file, with its own ending")
        elif MANIFEST not in names:
            raise ValueError(f"{MANIFEST} is missing")
        return self

    @property
    def key(self) -> str:
        return f"{self.kind}/{self.name}"

    @property
    def bytes(self) -> int:
        return sum(entry.bytes for entry in self.files)

    def file_names(self) -> set[str]:
        return {entry.name for entry in self.files}

    @cached_property
    def content(self) -> str:
        """SHA-256 of what it holds, whatever it is called."""
        files = sorted([entry.name, entry.bytes, *entry.chunks] for entry in self.files)
        return hashlib.sha256(json.dumps([self.kind, files], separators=(",", ":")).encode()).hexdigest()

    def to_bytes(self) -> bytes:
        """The same bytes on every machine."""
        return json.dumps(self.model_dump(mode="json"), separators=(",", ":"), sort_keys=True).encode()


def differ(files: Iterable[FileEntry], others: Mapping[str, FileEntry]) -> bool:
    """Whether one that both have is not the same."""
    return any(others.get(entry.name, entry) != entry for entry in files)


def is_name(kind: Kind, name: str) -> bool:
    """Whether an item may be called so: nothing that leads anywhere else, on any system."""
    pattern = _FILE_NAME if kind == "recording" else _ID
    return pattern.fullmatch(name) is not None and not _WINDOWS.fullmatch(name)


def suffix_of(name: str) -> str:
    return name[name.rfind(".") :].lower()


def digest_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
