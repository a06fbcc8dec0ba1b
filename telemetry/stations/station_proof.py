"""What proves to a router who a station is, and the router to it: read, when it ends, and why one refuses the other.

Zenoh says only that it has not connected. Why is found with a handshake of our own: the same names, the same files.
"""

from __future__ import annotations

import contextlib
import socket
import ssl
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from telemetry.errors import StationsError

WARNED_BEFORE = timedelta(days=30)
_ANSWERS_S = 2.0
_REFUSES_S = 1.0
"""Since TLS 1.3 a router refuses a client's certificate after the client's side of the handshake is done."""
_BEGIN = "-----BEGIN "
_EXPIRED, _NOT_YET, _WRONG_NAME, _WRONG_ADDRESS = 10, 9, 62, 64
"""Of OpenSSL, X509_V_ERR_..."""


@dataclass(frozen=True, slots=True)
class Route:
    """Where the router is, and what proves who this station is."""

    routers: tuple[str, ...]
    """``tls/HOST:PORT``; the first that answers is used"""
    file: Path
    """The station's key, its certificate and the authority's, as PEM (``hedgehop stations``)."""


@dataclass(frozen=True, slots=True)
class Proof:
    key_pem: bytes
    certificate_pem: bytes
    authority_pem: bytes
    since_utc: datetime
    until_utc: datetime


def read_proof(file: Path) -> Proof:
    """Raises StationsError."""
    # Loading it takes a tenth of a second, and only stations that meet others need it.
    from cryptography import x509

    try:
        parts = [(_BEGIN + part).encode() for part in file.read_text(encoding="ascii").split(_BEGIN)[1:]]
        key, certificate, authority = parts
        read = x509.load_pem_x509_certificate(certificate)
    except (OSError, ValueError) as error:
        raise StationsError(
            f"The station's file cannot be read: {error}.", where=str(file), advice="Make it with hedgehop stations."
        ) from error
    return Proof(key, certificate, authority, read.not_valid_before_utc, read.not_valid_after_utc)


def why_refused(route: Route, now_utc: datetime) -> str:
    """Why no router lets this station in, and what to do, in words. Blocks for some seconds."""
    try:
        if why := _why_invalid(read_proof(route.file), now_utc):
            return why
    except StationsError as error:
        return f"{error.what} {error.advice}"
    with ThreadPoolExecutor(len(route.routers)) as pool:
        found = pool.map(lambda router: _why_not(router, route.file), route.routers)
        return " ".join(found)


def ends_soon(route: Route, now_utc: datetime) -> str:
    """Which certificates end within ``WARNED_BEFORE``, in words; empty: none that is seen. Blocks for some seconds."""
    words = list[str]()
    try:
        until_utc = read_proof(route.file).until_utc
        if until_utc - now_utc < WARNED_BEFORE:
            words.append(
                f"This station's certificate ends on {until_utc:%Y-%m-%d}: make its file anew with hedgehop stations."
            )
    except StationsError as error:
        words.append(f"{error.what} {error.advice}")
    with ThreadPoolExecutor(len(route.routers)) as pool:
        for router, router_until_utc in zip(
            route.routers, pool.map(lambda router: _seen_until_utc(router, route.file), route.routers), strict=True
        ):
            if router_until_utc is not None and router_until_utc - now_utc < WARNED_BEFORE:
                words.append(
                    f"The certificate of the router {_named(router)} ends on {router_until_utc:%Y-%m-%d}: make "
                    "router.json5 anew with hedgehop stations, and restart the router."
                )
    return " ".join(words)


def _seen_until_utc(router: str, file: Path) -> datetime | None:
    """None: it does not answer, or refuses this station."""
    try:
        return _router_until_utc(router, file)
    except (OSError, EOFError, StationsError):
        return None


def _why_invalid(proof: Proof, now_utc: datetime) -> str:
    if now_utc >= proof.until_utc:
        return (
            f"This station's certificate has ended on {proof.until_utc:%Y-%m-%d}: no router lets it in. Make its file "
            "anew with hedgehop stations; or set this machine's clock, if it is wrong."
        )
    if now_utc < proof.since_utc:
        return (
            f"This station's certificate is valid from {proof.since_utc:%Y-%m-%d} on, and this machine's clock says "
            f"{now_utc:%Y-%m-%d}: set the clock."
        )
    return ""


def _why_not(router: str, file: Path) -> str:
    at = _named(router)
    try:
        _router_until_utc(router, file)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code in (_EXPIRED, _NOT_YET):
            return (
                f"The certificate of the router at {at} has ended, or a clock is wrong: make router.json5 anew with "
                "hedgehop stations, restart the router, and compare the clocks."
            )
        if error.verify_code in (_WRONG_NAME, _WRONG_ADDRESS):
            return f"The router's certificate is not for {at}: make router.json5 anew with hedgehop stations for it."
        return (
            f"The router at {at} is of another authority than this station's file: make both on the same machine with "
            "hedgehop stations, and restart the router."
        )
    except ssl.SSLError as error:
        reason = (error.reason or type(error).__name__).lower().replace("_", " ")
        return (
            f"The router at {at} refuses this station's certificate ({reason}): make its file and router.json5 on the "
            "same machine with hedgehop stations, and restart the router."
        )
    except EOFError:
        return (
            f"The router at {at} ends the connection without a word: it refuses this station's certificate, or is no "
            "router of Zenoh. Make both files on the same machine with hedgehop stations, and restart the router."
        )
    except socket.gaierror:
        return f"No router answers at {at}: its name is not known here. See that the network leads to it."
    except (OSError, StationsError) as error:
        why = error.what if isinstance(error, StationsError) else error.strerror or str(error)
        return f"No router answers at {at} ({why}). Start it, and see that the network leads to it."
    return (
        f"The router at {at} answers, but not as Zenoh's does, or not in time. See that it is one, that it and this "
        "station have the newest files of the same authority, and that its machine is not too busy."
    )


def _router_until_utc(router: str, file: Path) -> datetime:
    """When the router's certificate ends. Raises OSError, of which those of TLS are some; StationsError; EOFError: it
    ends the connection without a word."""
    host, _, port = router.removeprefix("tls/").rpartition(":")
    host = host.strip("[]")
    context = ssl.create_default_context(cadata=read_proof(file).authority_pem.decode())
    context.load_cert_chain(file)
    with (
        socket.create_connection((host, int(port)), timeout=_ANSWERS_S) as bare,
        context.wrap_socket(bare, server_hostname=host) as wrapped,
    ):
        shown = wrapped.getpeercert() or {}
        wrapped.settimeout(_REFUSES_S)
        with contextlib.suppress(TimeoutError):  # it waits for us to speak: it has let us in, or it is slow
            if not wrapped.recv(1):
                raise EOFError
        return datetime.fromtimestamp(ssl.cert_time_to_seconds(str(shown["notAfter"])), UTC)


def _named(router: str) -> str:
    return router.removeprefix("tls/")
