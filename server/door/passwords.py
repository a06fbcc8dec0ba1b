"""Passwords as they are kept: Argon2id, whose cost in memory makes guessing dear, written with its own figures.

Older files hold scrypt: such a password still lets in, and is hashed anew when it does.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import re
from dataclasses import dataclass

from argon2 import PasswordHasher
from argon2.exceptions import VerifyMismatchError

from server.errors import BadRequestError

SHORTEST, LONGEST = 8, 1024
MEMORY_KIB, PASSES, LANES = 46 * 1024, 2, 1
"""More than OWASP asks for at least (46 MiB, one pass), about a tenth of a second of one core of a laptop."""
_HASHER = PasswordHasher(time_cost=PASSES, memory_cost=MEMORY_KIB, parallelism=LANES)
_MEMORY_KIB_MAX, _PASSES_MAX, _LANES_MAX = 256 * 1024, 16, 8
"""Figures in a file beyond these would hold up whoever signs in."""
_ARGON2 = re.compile(
    r"\$argon2id\$v=19\$m=(\d{1,12}),t=(\d{1,12}),p=(\d{1,12})\$([A-Za-z0-9+/]{22})\$([A-Za-z0-9+/]{43})"
)
_SCRYPT = re.compile(r"scrypt\$(\d{1,12})\$(\d{1,12})\$(\d{1,12})\$((?:[0-9a-f]{2})+)\$((?:[0-9a-f]{2})+)")


@dataclass(frozen=True, slots=True)
class PasswordHash:
    text: str
    """As it is kept: ``$argon2id$v=19$m=…,t=…,p=…$salt$digest``, or of before ``scrypt$n$r$p$salt$digest``."""

    @classmethod
    def of(cls, password: str) -> PasswordHash:
        """Takes its time and memory: call it in the thread of ``Tries``."""
        return cls(_HASHER.hash(_raw(password)))

    @classmethod
    def read(cls, text: str) -> PasswordHash:
        """What ``text`` has written. Raises ValueError, which says what is wrong with it."""
        if found := _ARGON2.fullmatch(text):
            memory_kib, passes, lanes = (int(figure) for figure in found.groups()[:3])
            if not _is_base64(found[4]) or not _is_base64(found[5]):
                raise ValueError("its Argon2id hash is damaged")
            usual = (
                1 <= lanes <= _LANES_MAX and 1 <= passes <= _PASSES_MAX and 8 * lanes <= memory_kib <= _MEMORY_KIB_MAX
            )
        elif found := _SCRYPT.fullmatch(text):
            n, r, p = (int(figure) for figure in found.groups()[:3])
            usual = 2 <= n <= 2**17 and n & (n - 1) == 0 and 1 <= r <= 8 and 1 <= p <= 16
        else:
            raise ValueError("its hash is damaged: it is neither Argon2id nor scrypt as Hedgehop writes them")
        if not usual:
            raise ValueError(f"its hash has figures that Hedgehop never wrote: {text[: found.start(4)]}")
        return cls(text)

    @property
    def is_outdated(self) -> bool:
        """It is not as ``of`` makes it."""
        return not self.text.startswith("$argon2id$") or _HASHER.check_needs_rehash(self.text)

    def matches(self, password: str) -> bool:
        """Takes as long for a wrong one as for the right one: call it in the thread of ``Tries``."""
        if found := _SCRYPT.fullmatch(self.text):
            n, r, p = (int(figure) for figure in found.groups()[:3])
            salt, digest = bytes.fromhex(found[4]), bytes.fromhex(found[5])
            return hmac.compare_digest(digest, _scrypt(password, salt, n, r, p))
        try:
            return _HASHER.verify(self.text, _raw(password))
        except VerifyMismatchError:
            return False


OF_NOBODY = PasswordHash(f"$argon2id$v=19$m={MEMORY_KIB},t={PASSES},p={LANES}${'A' * 22}${'A' * 43}")
"""What is compared where there is no such account: a guess takes as long."""


def check_password(password: str) -> str:
    """Raises BadRequestError."""
    if not SHORTEST <= len(password) <= LONGEST:
        raise BadRequestError(f"A password needs at least {SHORTEST} characters, and at most {LONGEST}.")
    return password


def _raw(password: str) -> bytes:
    return password.encode(errors="surrogatepass")


def _scrypt(password: str, salt: bytes, n: int, r: int, p: int) -> bytes:
    return hashlib.scrypt(_raw(password), salt=salt, n=n, r=r, p=p, maxmem=256 * n * r + 1024**2)


def _is_base64(text: str) -> bool:
    """As Argon2 writes it: no padding, nothing in the bits that are left over."""
    try:
        return base64.b64encode(base64.b64decode(text + "=" * (-len(text) % 4))).decode().rstrip("=") == text
    except binascii.Error:
        return False
