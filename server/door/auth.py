"""Who is in: one-time links, passwords, and the sessions that both lead to.

Sessions are kept under SHA-256 digests of their random 256-bit ids, in a file that survives a restart: neither the file
nor the memory of the server holds anything that a cookie could be made of. A session lasts while its account does, with
the password that it had.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import hmac
import logging
import secrets
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec

from server.door.accounts import OWNER, Account, Accounts, Role
from server.door.passwords import OF_NOBODY, PasswordHash
from server.door.tries import Tries, place_of
from server.errors import SignInError, StorageError
from server.library.whole_files import write_atomically

log = logging.getLogger("hedgehop.auth")

SESSIONS_MAX = 1000
BY_LINK = "link"
"""The stamp of the owner's sessions that no password stands behind."""


@dataclass(frozen=True, slots=True)
class Session:
    name: str
    """Of its account; ``OWNER``."""
    stamp: str
    since_utc_s: float
    expires_utc_s: float
    seen_utc_s: float
    address: str


@dataclass(frozen=True, slots=True)
class Identity:
    """Who is behind a request."""

    session_key: str
    name: str
    """Of the account; of the owner's sessions, four characters tell them apart, and stay the same after a restart."""
    role: Role
    is_owner: bool
    remaining_s: float

    @property
    def may_change(self) -> bool:
        return self.role == "operator"


@dataclass(frozen=True, slots=True)
class _Kept:
    owner_password: str = ""
    owner_stamp: str = ""
    sessions: dict[str, Session] = field(default_factory=dict)


class Auth:
    """What writes waits for the disk: called in a thread, ``sign_in`` does so itself."""

    def __init__(
        self,
        file: Path,
        accounts: Accounts,
        *,
        password: str | None = None,
        lifetime_s: float = 30 * 86400.0,
        clock_utc_s: Callable[[], float] = time.time,
        tries: Tries | None = None,
    ) -> None:
        self._file, self.accounts, self.lifetime_s, self._clock_utc_s = file, accounts, lifetime_s, clock_utc_s
        self._tries = tries or Tries()
        kept = self._read()
        self._sessions = kept.sessions
        self._seen: dict[str, tuple[float, str]] = {}
        """Of each session, when it was last seen and where, since the file was written."""
        self._changing = threading.RLock()
        self.owes_writing = False
        """The disk was full when a session ended."""
        self._link: bytes | None = None
        self._owner = self._owner_of(kept, password)

    @property
    def has_password(self) -> bool:
        return self._owner is not None or any(account.password for account in self.accounts.all)

    # Signing in

    def new_link_token(self) -> str:
        """A token that signs the owner in once; it stays good until it is used or another one is made."""
        token = secrets.token_urlsafe(32)
        self.keep_link_token(token)
        return token

    def keep_link_token(self, token: str) -> None:
        """One that a server before this one has printed, and that nobody has used."""
        self._link = _digest(token)

    @property
    def link_is_open(self) -> bool:
        """Nobody has used it yet."""
        return self._link is not None

    def redeem(self, token: str, address: str = "") -> str:
        """Exchanges a link's token for a new session id."""
        with self._changing:
            if self._link is not None and hmac.compare_digest(self._link, _digest(token)):
                self._link = None
                return self._new_session(OWNER, BY_LINK, address)
        name = self.accounts.redeem(token)
        account = None if not name else self.accounts.find(name)
        if name != OWNER and account is None:
            raise SignInError(
                "This sign-in link has been used already, has expired or is not the newest one.",
                advice="Ask for a new one: hedgehop account link prints it, and so does each start of Hedgehop.",
            )
        return self._new_session(OWNER, BY_LINK, address) if account is None else self._enter(account, address)

    async def sign_in(self, name: str, password: str, address: str) -> str:
        """Exchanges a password for a new session id. Raises SignInError, TooManyTriesError."""
        account = self._owner if name == OWNER else self.accounts.find(name)
        kept = PasswordHash.read(account.password) if account is not None and account.password else OF_NOBODY
        known = account is not None and any(
            session.name == account.name and place_of(session.address) == place_of(address)
            for session in self._sessions.values()
        )
        right = await self._tries.check(address, name, known=known, matches=lambda: kept.matches(password))
        if not right or account is None:
            raise SignInError("Name or password is wrong.", advice="Try again, or use a sign-in link.")
        if kept.is_outdated:
            made = await self.hashed(password)
            await asyncio.to_thread(self._keep_anew, account, made)
        return await asyncio.to_thread(self._enter, account, address)

    async def hashed(self, password: str) -> PasswordHash:
        """Never beside another one that is hashed or looked at."""
        return await self._tries.alone(lambda: PasswordHash.of(password))

    # Sessions

    def identity(self, session_id: str) -> Identity | None:
        """None: nobody's."""
        key = session_key(session_id)
        session = self._sessions.get(key)
        role = None if session is None else self._role(session)
        if session is None or role is None:
            return None
        owns = session.name == OWNER
        name = f"Owner {key[:4]}" if owns else session.name
        return Identity(key, name, role, owns, session.expires_utc_s - self._clock_utc_s())

    def note_seen(self, key: str, address: str) -> None:
        """Never waits: nothing is written for it alone."""
        if key in self._sessions:
            self._seen[key] = (self._clock_utc_s(), address)

    @property
    def sessions(self) -> dict[str, tuple[Session, Role]]:
        """Those that still last, by key."""
        lasting: dict[str, tuple[Session, Role]] = {}
        for key, session in self._sessions.items():
            if (role := self._role(session)) is not None:
                lasting[key] = self._as_seen(key, session), role
        return lasting

    def ended(self, keys: Iterable[str]) -> set[str]:
        """Those of ``keys`` behind which there is no session any more."""
        return set(keys) - self.sessions.keys()

    def sign_out(self, keys: Iterable[str]) -> None:
        """Those of ``keys`` that there are."""
        with self._changing:
            gone = self._sessions.keys() & set(keys)
            if not gone:
                return
            try:
                self._write({key: session for key, session in self._sessions.items() if key not in gone})
            except StorageError as error:
                # Whoever signs out is out; written once the disk takes it, or a restart would let them in again.
                self.owes_writing = True
                log.warning("The sign-out is kept in memory only until there is room: %s", error)

    def settle(self) -> None:
        """Writes what a full disk has not taken."""
        with self._changing, contextlib.suppress(StorageError):
            if self.owes_writing:
                self._write(self._sessions)

    def change_password(self, name: str, password: PasswordHash, *, stays: str) -> None:
        """Of an account; its sessions end but for the one that asked, if it is one of them."""
        with self._changing:
            changed, sessions = self.accounts.set_password(name, password), dict(self._sessions)
            if (session := sessions.get(stays)) is not None and session.name == changed.name:
                sessions[stays] = replace(session, stamp=changed.stamp)
            self._write(sessions)

    def _keep_anew(self, account: Account, password: PasswordHash) -> None:
        """The same password, hashed as passwords are by now."""
        try:
            self.accounts.keep_anew(account, password)
        except StorageError as error:
            log.warning("The password of %r stays hashed as it was until its next sign-in: %s", account.name, error)

    def _enter(self, account: Account, address: str) -> str:
        return self._new_session(account.name, account.stamp, address)

    def _new_session(self, name: str, stamp: str, address: str) -> str:
        session_id, now = secrets.token_urlsafe(32), self._clock_utc_s()
        made = Session(name, stamp, now, now + self.lifetime_s, now, address)
        with self._changing:
            live = {key: session for key, (session, _) in self.sessions.items()}
            newest = dict(sorted(live.items(), key=lambda item: item[1].expires_utc_s)[-(SESSIONS_MAX - 1) :])
            try:
                self._write({**newest, session_key(session_id): made})
            except StorageError as error:
                # Whoever may come in comes in: with a full disk, too, somebody must be able to bring a vehicle home.
                log.warning("The sign-in is kept in memory only, and ends with this server: %s", error)
        return session_id

    def _as_seen(self, key: str, session: Session) -> Session:
        if (seen := self._seen.get(key)) is None:
            return session
        return replace(session, seen_utc_s=seen[0], address=seen[1] or session.address)

    def _role(self, session: Session) -> Role | None:
        """What it may do; None when it has ended."""
        if session.expires_utc_s <= self._clock_utc_s():
            return None
        if session.name == OWNER:
            stamps = {BY_LINK} if self._owner is None else {BY_LINK, self._owner.stamp}
            return "operator" if session.stamp in stamps else None
        account = self.accounts.find(session.name)
        return account.role if account is not None and account.stamp == session.stamp else None

    def _owner_of(self, kept: _Kept, password: str | None) -> Account | None:
        """With the stamp that sessions have, unless the settings hold another password than then."""
        if password is None:
            return None
        try:
            known = PasswordHash.read(kept.owner_password)
        except ValueError:
            known = None
        if known is not None and known.matches(password):
            text = PasswordHash.of(password).text if known.is_outdated else known.text
            return Account(OWNER, "operator", kept.owner_stamp, text)
        return Account(OWNER, "operator", secrets.token_hex(8), PasswordHash.of(password).text)

    def _read(self) -> _Kept:
        try:
            return msgspec.json.decode(self._file.read_bytes(), type=_Kept)
        except (FileNotFoundError, ValueError, msgspec.MsgspecError):
            # A damaged file costs a sign-in, never a refused start.
            return _Kept()

    def _write(self, sessions: dict[str, Session]) -> None:
        """They hold from here on, also where the disk is full: then a restart forgets the change."""
        self._sessions = sessions = {key: self._as_seen(key, session) for key, session in sessions.items()}
        self._seen = {key: seen for key, seen in self._seen.items() if key in sessions}
        owner = self._owner
        kept = _Kept("", "", sessions) if owner is None else _Kept(owner.password, owner.stamp, sessions)
        write_atomically(self._file, msgspec.json.encode(kept))
        self.owes_writing = False


def session_key(session_id: str) -> str:
    """Under which name a session is known inside the server: no cookie can be made of it."""
    return _digest(session_id).hex()


def _digest(secret: str) -> bytes:
    return hashlib.sha256(secret.encode(errors="surrogatepass")).digest()
