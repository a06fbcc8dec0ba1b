"""Passwords as they are kept: scrypt, whose cost in memory makes guessing dear, written with its own figures."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from dataclasses import dataclass

from server.errors import BadRequestError

SHORTEST, LONGEST = 8, 1024
_N, _R, _P = 2**15, 8, 3
"""32 MiB for about a quarter of a second."""
_MEMORY_BYTES = 64 * 1024**2


@dataclass(frozen=True, slots=True)
class PasswordHash:
    salt: bytes
    digest: bytes
    n: int = _N
    r: int = _R
    p: int = _P

    @classmethod
    def of(cls, password: str) -> PasswordHash:
        salt = secrets.token_bytes(16)
        return cls(salt, _scrypt(password, salt, _N, _R, _P))

    @classmethod
    def read(cls, text: str) -> PasswordHash:
        """What ``text`` has written. Raises ValueError."""
        kind, n, r, p, salt, digest = text.split("$")
        if kind != "scrypt" or not (2 <= int(n) <= 2**17 and 1 <= int(r) <= 8 and 1 <= int(p) <= 16):
            raise ValueError(f"{kind} with these figures is not how passwords are kept here")
        return cls(bytes.fromhex(salt), bytes.fromhex(digest), int(n), int(r), int(p))

    @property
    def text(self) -> str:
        return f"scrypt${self.n}${self.r}${self.p}${self.salt.hex()}${self.digest.hex()}"

    def matches(self, password: str) -> bool:
        """Takes as long for a wrong one as for the right one: call it in a thread."""
        return hmac.compare_digest(self.digest, _scrypt(password, self.salt, self.n, self.r, self.p))


def check_password(password: str) -> str:
    """Raises BadRequestError."""
    if not SHORTEST <= len(password) <= LONGEST:
        raise BadRequestError(f"A password needs at least {SHORTEST} characters, and at most {LONGEST}.")
    return password


def _scrypt(password: str, salt: bytes, n: int, r: int, p: int) -> bytes:
    raw = password.encode(errors="surrogatepass")
    return hashlib.scrypt(raw, salt=salt, n=n, r=r, p=p, maxmem=max(_MEMORY_BYTES, 256 * n * r))
