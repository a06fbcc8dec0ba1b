"""Raw bytes from the browser: to the disk in pieces, or, when small, to memory."""

from __future__ import annotations

import asyncio
from pathlib import Path, PurePosixPath

from fastapi import Request

from server.errors import BadRequestError
from server.library.whole_files import storage_errors

_PIECE_BYTES = 4 * 1024**2
NAME_MAX_CHARS = 80


def display_name(filename: str) -> str:
    """What a file is called in the console: one line, no folders; it never becomes a path."""
    last = PurePosixPath(filename.replace("\\", "/")).name
    clean = "".join(char for char in last if char.isprintable()).strip()
    return clean[:NAME_MAX_CHARS] or "unnamed"


def display_folder(folder: str) -> str:
    """Where a file lay, as its page says: one line, its last part where it is long; it never becomes a path."""
    clean = "".join(char for char in folder.replace("\\", "/") if char.isprintable()).strip("/ ")
    return clean[-NAME_MAX_CHARS:]


def suffix_of(name: str) -> str:
    """The ending for readers that go by it: letters and digits only."""
    ending = PurePosixPath(name).suffix.lower()
    return ending if ending[1:].isalnum() and ending.isascii() and len(ending) <= 8 else ""


async def stream_to_disk(request: Request, path: Path) -> Path:
    """The request's body as a file of its own; nothing is left of it when it breaks off."""
    try:
        with storage_errors(path), path.open("xb") as file:
            piece = bytearray()
            async for chunk in request.stream():
                piece += chunk
                if len(piece) >= _PIECE_BYTES:
                    await asyncio.to_thread(file.write, bytes(piece))
                    piece.clear()
            await asyncio.to_thread(file.write, bytes(piece))
        if path.stat().st_size == 0:
            raise BadRequestError("The upload is empty.", advice="Choose a file with content.")
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    return path
