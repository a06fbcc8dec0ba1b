"""One file out of its blobs: each is held against its name before a byte of it is written."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from server.errors import DamagedError
from server.library.sharing.reading_ahead import ahead
from server.library.sharing.shared_items import FileEntry, digest_of
from server.library.sharing.sharing_targets import Target, blob_path

OnChunk = Callable[[int, bool], None]
"""Bytes, and whether they came over the line; what an earlier try had brought did not."""


def fetch_file(target: Target, entry: FileEntry, path: Path, on_chunk: OnChunk) -> None:
    """Goes on behind the chunks that an earlier try left whole in ``path``; on the disk when this returns.

    Raises DamagedError for a blob that is not what it is called, TargetError, OSError.
    """
    chunks = entry.chunk_sizes()

    def read(chunk: tuple[str, int]) -> bytes:
        return read_blob(target, *chunk)

    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    with open(handle, "r+b", buffering=0) as file:
        kept = _kept(file.read, chunks)
        start = sum(size for _, size in chunks[:kept])
        if kept:
            on_chunk(start, False)
        file.truncate(start)
        file.seek(start)
        for data in ahead(read, chunks[kept:], target.threads):
            _write_all(file.write, data)
            on_chunk(len(data), True)
        os.fsync(handle)


def read_blob(target: Target, digest: str, size: int) -> bytes:
    """Raises DamagedError, TargetError."""
    data = target.read(blob_path(digest), size)
    if len(data) != size or digest_of(data) != digest:
        what = f"Blob {digest} is torn or was tampered with: its content is not what it is called."
        raise DamagedError(what, where=digest, advice="Push with --check from a machine that has it.")
    return data


def _kept(read: Callable[[int], bytes], chunks: list[tuple[str, int]]) -> int:
    for number, (digest, size) in enumerate(chunks):
        data = read(size)
        if len(data) != size or digest_of(data) != digest:
            return number
    return len(chunks)


def _write_all(write: Callable[[memoryview], int], data: bytes) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[write(rest) :]
