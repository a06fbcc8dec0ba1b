"""Who may sign in, and as what: a plain file in the data directory that only this user can read.

The server and ``hedgehop account`` both write it, one at a time; what the other has written is read before the next
answer. The owner of the machine has no name: in by the printed link, or by the password of the settings.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import logging
import os
import secrets
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec

from planning.formats.safe_text import clean_name
from server.door.passwords import PasswordHash
from server.errors import BadRequestError, ConflictError, NotFoundError, StorageError
from server.library.whole_files import storage_errors, write_atomically

log = logging.getLogger("hedgehop.door")

FILE = "accounts.json"
OWNER = ""
"""In the place of a name."""
ACCOUNTS_MAX, NAME_LONGEST, INVITATIONS_MAX = 200, 40, 200
INVITED_S = 24 * 3600.0
_NOT_NAMES = frozenset({"hedgehop", "link", "owner", "command line"})
Role = Literal["operator", "observer"]


@dataclass(frozen=True, slots=True)
class Account:
    name: str
    role: Role
    stamp: str
    """Sessions carry it: another password ends them."""
    password: str = ""
    """As ``PasswordHash`` writes it; none before its owner has chosen one: then invitations lead in."""


@dataclass(frozen=True, slots=True)
class _Invitation:
    digest: str
    name: str
    expires_utc_s: float


@dataclass(frozen=True, slots=True)
class _Kept:
    accounts: tuple[Account, ...] = ()
    invitations: tuple[_Invitation, ...] = ()


class Accounts:
    """Quick, but for the disk: what changes something is called in a thread."""

    def __init__(self, folder: Path, *, clock_utc_s: Callable[[], float] = time.time) -> None:
        self._file, self._lock_file = folder / FILE, folder / "accounts.lock"
        self._clock_utc_s = clock_utc_s
        self._seen: tuple[int, ...] | None = None
        self._read_last = _Kept()
        self._is_damaged = False

    @property
    def all(self) -> tuple[Account, ...]:
        return self._kept().accounts

    def find(self, name: str) -> Account | None:
        folded = name.casefold()
        return next((account for account in self.all if account.name.casefold() == folded), None)

    def invited_until_utc_s(self, name: str) -> float | None:
        """The end of the newest invitation that is still open."""
        now = self._clock_utc_s()
        ends = [i.expires_utc_s for i in self._kept().invitations if i.name == name and i.expires_utc_s > now]
        return max(ends, default=None)

    def add(self, name: str, role: Role) -> Account:
        """Without a password. Raises BadRequestError, ConflictError."""
        account = Account(_check_name(name), role, secrets.token_hex(8))
        with self._changing() as kept:
            if any(account.name.casefold() == other.name.casefold() for other in kept.accounts):
                raise ConflictError(f"There is an account {account.name!r} already.", advice="Choose another name.")
            if len(kept.accounts) >= ACCOUNTS_MAX:
                raise ConflictError(f"There are {ACCOUNTS_MAX} accounts already.", advice="Remove some of them.")
            self._write(replace(kept, accounts=(*kept.accounts, account)))
        return account

    def remove(self, name: str) -> None:
        """With its invitations; its sessions end. Raises NotFoundError."""
        with self._changing() as kept:
            account = _one(kept, name)
            self._write(
                _Kept(
                    tuple(other for other in kept.accounts if other != account),
                    tuple(invitation for invitation in kept.invitations if invitation.name != account.name),
                )
            )

    def set_password(self, name: str, password: PasswordHash) -> Account:
        """Its sessions and invitations end. Raises NotFoundError."""
        with self._changing() as kept:
            account = _one(kept, name)
            changed = replace(account, password=password.text, stamp=secrets.token_hex(8))
            self._write(
                _Kept(
                    tuple(changed if other == account else other for other in kept.accounts),
                    tuple(invitation for invitation in kept.invitations if invitation.name != account.name),
                )
            )
        return changed

    def keep_anew(self, account: Account, password: PasswordHash) -> None:
        """The password that it has, hashed anew: nothing ends. Without effect where it has changed meanwhile."""
        with self._changing() as kept:
            anew = replace(account, password=password.text)
            accounts = tuple(anew if other == account else other for other in kept.accounts)
            if accounts != kept.accounts:
                self._write(replace(kept, accounts=accounts))

    def invite(self, name: str, lasts_s: float = INVITED_S) -> str:
        """A token that signs in once, until it expires; ``OWNER`` as the printed link does. Raises NotFoundError."""
        token, now = secrets.token_urlsafe(32), self._clock_utc_s()
        with self._changing() as kept:
            known = name if name == OWNER else _one(kept, name).name
            open_ = [invitation for invitation in kept.invitations if invitation.expires_utc_s > now]
            made = _Invitation(_digest(token), known, now + lasts_s)
            self._write(replace(kept, invitations=(*open_[-(INVITATIONS_MAX - 1) :], made)))
        return token

    def redeem(self, token: str) -> str | None:
        """Whom this invitation lets in, once; None: nobody."""
        digest, now = _digest(token), self._clock_utc_s()
        if not any(digest == invitation.digest for invitation in self._kept().invitations):
            return None
        with self._changing() as kept:
            for invitation in kept.invitations:
                if invitation.digest == digest and invitation.expires_utc_s > now:
                    self._write(replace(kept, invitations=tuple(i for i in kept.invitations if i != invitation)))
                    return invitation.name
        return None

    @contextlib.contextmanager
    def _changing(self) -> Iterator[_Kept]:
        """The file as it is now, which nobody else changes meanwhile."""
        with storage_errors(self._lock_file):
            handle = os.open(self._lock_file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            kept = self._kept()
            if self._is_damaged:
                raise StorageError(
                    "The accounts cannot be read.", where=str(self._file), advice="Mend the file, or delete it."
                )
            yield kept
        finally:
            os.close(handle)

    def _kept(self) -> _Kept:
        try:
            found = self._file.stat()
        except OSError:
            self._seen, self._read_last, self._is_damaged = None, _Kept(), False
            return self._read_last
        seen = (found.st_ino, found.st_mtime_ns, found.st_size)
        if seen != self._seen:
            self._seen, self._read_last = seen, self._read()
        return self._read_last

    def _read(self) -> _Kept:
        """Nobody but the owner gets in by a file that cannot be read."""
        try:
            kept = msgspec.json.decode(self._file.read_bytes(), type=_Kept)
            for account in kept.accounts:
                _check_hash(account)
        except (OSError, ValueError, msgspec.MsgspecError) as error:
            self._is_damaged = True
            log.warning("The accounts cannot be read: %s. Mend or delete %s.", error, self._file)
            return _Kept()
        self._is_damaged = False
        return kept

    def _write(self, kept: _Kept) -> None:
        write_atomically(self._file, msgspec.json.format(msgspec.json.encode(kept), indent=1))


def _check_name(name: str) -> str:
    cleaned = " ".join(clean_name(name).split())
    if not 1 <= len(cleaned) <= NAME_LONGEST or not cleaned.isprintable():
        raise BadRequestError(f"A name has 1 to {NAME_LONGEST} characters that can be printed.")
    if cleaned.casefold() in _NOT_NAMES:
        raise BadRequestError(f"{cleaned!r} would be taken for somebody else.", advice="Choose another name.")
    return cleaned


def _check_hash(account: Account) -> None:
    """Raises ValueError."""
    try:
        if account.password:
            PasswordHash.read(account.password)
    except ValueError as error:
        raise ValueError(f"the password of {account.name!r} cannot be used: {error}") from error


def _one(kept: _Kept, name: str) -> Account:
    folded = name.casefold()
    for account in kept.accounts:
        if account.name.casefold() == folded:
            return account
    raise NotFoundError(f"There is no account {name[:NAME_LONGEST]!r}.", advice="See the list of accounts.")


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode(errors="surrogatepass")).hexdigest()
