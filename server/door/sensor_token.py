"""The secret by which a companion computer's agent proves itself: made once, kept in the data directory."""

from __future__ import annotations

import hmac
import os
import secrets
from pathlib import Path

from server.errors import StorageError

FILE = "sensor-token.txt"
_BYTES = 32


def sensor_token(root: Path) -> str:
    """Read from the file, which only this user can read; made when there is none. Raises StorageError."""
    path = root / FILE
    try:
        try:
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            token = path.read_text(encoding="ascii").strip()
            if len(token) >= _BYTES:
                return token
            path.unlink()
            return sensor_token(root)
        with os.fdopen(handle, "w", encoding="ascii") as file:
            token = secrets.token_urlsafe(_BYTES)
            file.write(f"{token}\n")
        return token
    except (OSError, UnicodeDecodeError) as error:
        raise StorageError(
            f"The agents' token cannot be read or written: {error}.", where=str(path), advice="Delete the file."
        ) from error


def is_token(given: str, token: str) -> bool:
    """Takes as long for a wrong one as for the right one."""
    return hmac.compare_digest(given.encode(), token.encode())
