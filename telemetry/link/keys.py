"""Where the keys of a data directory stand, and how they are written."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


def audit_key_file(data: Path) -> Path:
    """Of the log of commands."""
    return data / "keys" / "audit.key"


def signing_key_file(data: Path) -> Path:
    """Of the vehicles that sign."""
    return data / "keys" / "signing.json"


def write_key_file(file: Path, content: bytes) -> None:
    """Whole or not at all, for nobody else's eyes, on the disk when this returns. Raises OSError."""
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = file.with_suffix(".new")
    with contextlib.suppress(FileNotFoundError):
        new.unlink()
    handle = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    with open(handle, "wb") as opened:
        opened.write(content)
        opened.flush()
        os.fsync(handle)
    os.replace(new, file)
