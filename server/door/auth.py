"""Who may come in: one-time links, a password, and the sessions that both lead to.

Sessions are kept as SHA-256 digests of their random 256-bit ids, in a file that survives a restart:
neither the file nor the memory of the server holds anything that a cookie could be made of.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import logging
import secrets
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from server.errors import SignInError, StorageError, TooManyTriesError
from server.library.whole_files import write_atomically
from server.settings import PasswordHash

log = logging.getLogger("hedgehop.auth")

SESSIONS_MAX = 1000
TRIES_MAX = 5
TRIES_WINDOW_S = 60.0


class Auth:
    """Synchronous and quick, except ``sign_in`` (scrypt): call that in a thread."""

    def __init__(
        self,
        file: Path,
        *,
        password: PasswordHash | None = None,
        lifetime_s: float = 30 * 86400.0,
        clock_utc_s: Callable[[], float] = time.time,
    ) -> None:
        self._file = file
        self._password = password
        self._lifetime_s = lifetime_s
        self._clock_utc_s = clock_utc_s
        self._expiry_utc_s = self._read()
        self._link: bytes | None = None
        self._tries: deque[float] = deque(maxlen=TRIES_MAX)

    @property
    def lifetime_s(self) -> float:
        return self._lifetime_s

    @property
    def has_password(self) -> bool:
        return self._password is not None

    def new_link_token(self) -> str:
        """A token that signs in once; it stays good until it is used or another one is made."""
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

    def redeem(self, token: str) -> str:
        """Exchanges a link's token for a new session id."""
        if self._link is None or not hmac.compare_digest(self._link, _digest(token)):
            raise SignInError(
                "This sign-in link has been used already or is not the newest one.",
                advice="Restart Hedgehop for a new link, or sign in with the password if one is set.",
            )
        self._link = None
        return self._new_session()

    def sign_in(self, password: str) -> str:
        """Exchanges the password for a new session id; at most five tries a minute."""
        if self._password is None:
            raise SignInError(
                "No password is set.", advice="Use the link that Hedgehop prints when it starts, or set one."
            )
        now = self._clock_utc_s()
        if len(self._tries) == TRIES_MAX and 0 <= now - self._tries[0] < TRIES_WINDOW_S:
            raise TooManyTriesError("Too many wrong passwords.", advice="Wait a minute and try again.")
        # Counted before the slow comparison, so that parallel tries do not slip through.
        self._tries.append(now)
        if not self._password.matches(password):
            raise SignInError("The password is wrong.", advice="Try again, or use the sign-in link.")
        self._tries.clear()
        return self._new_session()

    def remaining_s(self, session_id: str) -> float:
        """How long a session still lasts; 0 when there is none."""
        expiry = self._expiry_utc_s.get(session_key(session_id), 0.0)
        return max(0.0, expiry - self._clock_utc_s())

    def sign_out(self, session_id: str) -> None:
        if self._expiry_utc_s.pop(session_key(session_id), None) is not None:
            self._write()

    def _new_session(self) -> str:
        session_id = secrets.token_urlsafe(32)
        now = self._clock_utc_s()
        live = {key: expiry for key, expiry in self._expiry_utc_s.items() if expiry > now}
        newest = dict(sorted(live.items(), key=lambda item: item[1])[-(SESSIONS_MAX - 1) :])
        self._expiry_utc_s = {**newest, session_key(session_id): now + self._lifetime_s}
        try:
            self._write()
        except StorageError as error:
            # Whoever may come in comes in: with a full disk, too, somebody must be able to bring a vehicle home.
            log.warning("The sign-in is kept in memory only, and ends with this server: %s", error)
        return session_id

    def _read(self) -> dict[str, float]:
        try:
            stored = json.loads(self._file.read_text(encoding="utf-8"))
            return {str(key): float(expiry) for key, expiry in stored.items()}
        except (FileNotFoundError, ValueError, TypeError, AttributeError):
            # A damaged file costs a sign-in, never a refused start.
            return {}

    def _write(self) -> None:
        write_atomically(self._file, json.dumps(self._expiry_utc_s).encode())


def session_key(session_id: str) -> str:
    """Under which name a session is known inside the server: no cookie can be made of it."""
    return _digest(session_id).hex()


def _digest(secret: str) -> bytes:
    return hashlib.sha256(secret.encode(errors="surrogatepass")).digest()
