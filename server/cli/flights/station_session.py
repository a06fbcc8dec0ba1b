"""A command's session with the ground station that runs from a data directory: signed in as the owner of this machine,
in charge of one vehicle while it lasts, signed out at its end.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import ssl
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

from pydantic import BaseModel, ValidationError

from server.app import origin_file
from server.cli.shared.output import end_progress, progress, say_notes
from server.door.accounts import OWNER, Accounts
from server.door.certificates import CertificateFiles
from server.door.lease import ANSWER_S
from server.errors import BadRequestError, DataDirError, StationError
from server.library.directory_lock import DirectoryLock
from server.schemas import LeaseDoc
from server.settings import Settings, load_settings

Doc = TypeVar("Doc", bound=BaseModel)
ASK_S, LOOK_EVERY_S = 20.0, 1.0
"""``ASK_S``: for a request that only looks or signs in or out."""
LINK_LASTS_S = 60.0
_VEHICLE = re.compile(r"(?:[A-Za-z0-9][A-Za-z0-9_-]{0,23}/)?[1-9][0-9]{0,2}", re.ASCII)
NOT_IN_CHARGE = "Nothing was asked of the vehicle."


class StationSession:
    """Requests are made one at a time, and block."""

    def __init__(self, origin: str, tls: ssl.SSLContext | None, vehicle: str | None = None) -> None:
        """``vehicle``: number of the one that requests are about; None: the station has only one."""
        self._origin, self._tls, self._vehicle = origin, tls, vehicle
        self._cookie = ""

    def sign_in(self, token: str) -> None:
        """By a one-time link's token. Raises StationError."""
        answer, _ = self._request("GET", f"/login?token={token}", None, ASK_S, "The sign-in")
        self._cookie = (answer.getheader("Set-Cookie") or "").partition(";")[0]
        if answer.status != http.client.SEE_OTHER or not self._cookie:
            raise StationError(f"The station did not let this command in ({answer.status}).", where=self._origin)

    def ask(
        self, method: str, path: str, body: dict[str, Any] | None = None, *, within_s: float = ASK_S, doing: str
    ) -> bytes:
        """The answer's body. ``doing``: what was asked for, as a sentence's beginning. Raises StationError: what the
        station said, or that it did not answer."""
        answer, content = self._request(method, path, body, within_s, doing)
        if 200 <= answer.status < 300:
            return content
        raise _refusal(answer.status, content, self._origin)

    def told(self, kind: type[Doc], content: bytes) -> Doc:
        """Raises StationError where the station is of another version."""
        try:
            return kind.model_validate_json(content)
        except ValidationError as error:
            what = f"The station's answer is not understood: {error.errors()[0]['msg']}."
            raise StationError(what, where=self._origin, advice="Is it of another version than this command?") from None

    def take_control(
        self, clock_s: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep
    ) -> None:
        """Asks who is in charge, and waits for the answer. Raises StationError where control is not handed over."""
        lease = self.told(LeaseDoc, self.ask("POST", "/api/lease/take", doing="Taking control"))
        until_s = clock_s() + ANSWER_S + 2 * LOOK_EVERY_S
        was = lease.holder
        while not lease.mine and lease.waits and clock_s() < until_s:
            progress(f"{lease.holder} is asked for control", None)
            wait(LOOK_EVERY_S)
            lease = self.told(LeaseDoc, self.ask("GET", "/api/lease", doing="Taking control"))
        end_progress()
        if not lease.mine:
            what = f"{lease.holder or was} is in charge of the vehicle and has not handed control over."
            raise StationError(what, where=self._origin, advice=f"{NOT_IN_CHARGE} Agree with them, then try again.")

    def put_away(self, path: str) -> None:
        """What was judged there, or somebody else sets or flies what nobody wants any more. That it fails is said, and
        hides no other error."""
        try:
            self.ask("DELETE", path, doing="Putting away what was judged")
        except StationError as error:
            say_notes(f"what was judged may still stand in the console: {error.what}")

    def end(self) -> None:
        """Signs out, which lets go of the vehicle; that it fails is said, and raises nothing."""
        if not self._cookie:
            return
        try:
            self.ask("DELETE", "/api/session", doing="Signing out")
        except StationError as error:
            say_notes(f"this command may still be in charge of the vehicle for a few seconds: {error.what}")

    def _request(
        self, method: str, path: str, body: dict[str, Any] | None, within_s: float, doing: str
    ) -> tuple[http.client.HTTPResponse, bytes]:
        parts = urlsplit(self._origin)
        headers = {"Origin": self._origin, "Connection": "close"}
        if self._cookie:
            headers["Cookie"] = self._cookie
        if self._vehicle is not None:
            headers["Hedgehop-Vehicle"] = self._vehicle
        sent = None if body is None else json.dumps(body).encode()
        if sent is not None:
            headers["Content-Type"] = "application/json"
        with contextlib.closing(_connection(parts.hostname or "", parts.port, self._tls, within_s)) as connection:
            try:
                connection.request(method, path, sent, headers)
                answer = connection.getresponse()
                return answer, answer.read()
            except TimeoutError:
                what = f"{doing} was not answered within {within_s:.0f} s: what came of it is not known."
                raise StationError(what, where=self._origin, advice="Look at the console.") from None
            except (ConnectionRefusedError, ssl.SSLError) as error:
                what = f"{doing} failed: the station cannot be reached ({_why(error)})."
                raise StationError(what, where=self._origin, advice="Is it still running? Then try again.") from None
            except (OSError, http.client.HTTPException) as error:
                what = f"{doing} broke off ({_why(error)}): what came of it is not known."
                raise StationError(what, where=self._origin, advice="Look at the console.") from None


@contextmanager
def station_session(data_dir: Path | None, vehicle: str | None) -> Iterator[StationSession]:
    """With the station that runs from ``data_dir`` (None: the settings'). Raises BadRequestError where there is none or
    ``vehicle`` names none, StationError, StorageError."""
    _check_names(vehicle)
    settings = load_settings(data_dir=data_dir)
    _check_runs(settings.data_dir)
    file = origin_file(settings)
    origin = file.read_text(encoding="ascii") if file.is_file() else f"http://127.0.0.1:{settings.port}"
    session = StationSession(origin, _trusting(settings) if origin.startswith("https:") else None, vehicle)
    session.sign_in(Accounts(settings.data_dir).invite(OWNER, LINK_LASTS_S))
    try:
        yield session
    finally:
        session.end()


def station_runs(data_dir: Path | None) -> bool:
    """From ``data_dir`` (None: the settings')."""
    return _is_held(load_settings(data_dir=data_dir).data_dir)


def _check_names(vehicle: str | None) -> None:
    """Before anything is sent: what names no vehicle would be about the station's only one, or no header at all."""
    if vehicle is None or _VEHICLE.fullmatch(vehicle):
        return
    what = f"{vehicle[:40]!a} names no vehicle: nothing was sent."
    advice = "Say its number, as in --vehicle 2, or station and number, as in --vehicle Alpha/2."
    raise BadRequestError(what, where="--vehicle", advice=advice)


def _is_held(data_dir: Path) -> bool:
    """Whoever serves from a data directory holds its lock."""
    if not data_dir.is_dir():
        return False
    try:
        DirectoryLock(data_dir).release()
    except DataDirError:
        return True
    return False


def _check_runs(data_dir: Path) -> None:
    if _is_held(data_dir):
        return
    advice = "Start hedgehop serve, or name the data directory that it was started with: --data-dir."
    raise BadRequestError("No Hedgehop runs from this data directory.", where=str(data_dir), advice=advice)


def _trusting(settings: Settings) -> ssl.SSLContext:
    """This machine's own authority, else those of the system."""
    own = CertificateFiles(settings.data_dir)
    is_own = settings.tls_certificate is None and own.authority.is_file()
    return ssl.create_default_context(cafile=str(own.authority) if is_own else None)


def _connection(host: str, port: int | None, tls: ssl.SSLContext | None, within_s: float) -> http.client.HTTPConnection:
    if tls is None:
        return http.client.HTTPConnection(host, port, timeout=within_s)
    return http.client.HTTPSConnection(host, port, timeout=within_s, context=tls)


def _refusal(status: int, content: bytes, origin: str) -> StationError:
    """What the station said, with its code."""
    try:
        said = json.loads(content)
        error = StationError(str(said["what"]), where=str(said["where"]), advice=str(said["advice"]))
        error.code = str(said["code"])
    except (ValueError, KeyError, TypeError):
        return StationError(f"The station refused it ({status}) and did not say why.", where=origin)
    return error


def _why(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
