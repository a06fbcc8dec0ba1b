"""Files with which stations meet at a router: ``NAME.pem`` for each station, ``router.json5`` for the router.

All are signed by this machine's own authority (``server/door/certificates.py``); its key never leaves this machine. A
station's certificate is good for showing who it is and for nothing else: no browser takes it for a site's.
"""

from __future__ import annotations

import stat
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from planning.errors import DescribedError
from server.door.certificates import CertificateFiles, Names, read_certificate, read_common_name
from server.errors import CertificateError, StartError
from server.library.whole_files import storage_errors, write_atomically
from telemetry.errors import StationsError
from telemetry.stations.router_file import router_file
from telemetry.stations.station_names import ROUTER_PORT, checked_name

ROUTER_FILE, _SUFFIX = "router.json5", ".pem"
_BEGIN = "-----BEGIN "


@dataclass(frozen=True, slots=True)
class Written:
    made: list[Path]
    kept: list[Path]


def write_station_files(
    out: Path,
    authority: CertificateFiles,
    names: Sequence[str],
    hosts: Sequence[str],
    now_utc: datetime,
    *,
    listen: Sequence[str] = (f"tls/[::]:{ROUTER_PORT}",),
) -> Written:
    """For these stations and those whose files are there already; the router's file is written anew for all of them.

    ``hosts``: under which names or addresses the router is met. Raises StationsError, CertificateError, StorageError.
    """
    reached = Names(frozenset(), frozenset()).with_given(list(hosts))
    with storage_errors(out):
        out.mkdir(mode=0o700, parents=True, exist_ok=True)
        there = sorted(path.stem for path in out.glob(f"*{_SUFFIX}"))
    router_key, router_chain = authority.issue("Hedgehop router", now_utc, reached)
    router_leaf, above = _parts(router_chain.decode())
    made, kept = list[Path](), list[Path]()
    every = sorted({checked_name(name) for name in [*names, *there]})
    folded = {name.casefold() for name in every}
    if len(folded) < len(every):
        raise StationsError(
            "Two of the stations' names differ in capitals only.", where=", ".join(every), advice="Rename one of them."
        )
    for name in there:
        if read_common_name(out / f"{name}{_SUFFIX}") != name:
            raise StationsError(
                f"{name}{_SUFFIX} is no file of a station of that name.",
                where=str(out),
                advice="Choose a folder for these files alone.",
            )
    for name in every:
        path = out / f"{name}{_SUFFIX}"
        if name in there and _is_of(path, above) and not read_certificate(path).ends_soon(now_utc):
            kept.append(path)
            continue
        key, chain = authority.issue(name, now_utc)
        write_atomically(path, key + chain)
        made.append(path)
    text = router_file(
        every,
        authority_pem=above.encode(),
        certificate_pem=router_leaf.encode(),
        key_pem=router_key,
        listen=listen,
    )
    write_atomically(out / ROUTER_FILE, text.encode())
    return Written([*made, out / ROUTER_FILE], kept)


def station_of(path: Path) -> str:
    """The name in a station's file. Raises StartError."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise StationsError("It is not a regular file.")
        if len(_parts(path.read_text(encoding="ascii"))) != 3:
            raise StationsError("It must hold a key, the station's certificate and the authority's.")
        return checked_name(_name_in(path))
    except (OSError, ValueError, DescribedError) as error:
        why = _why(error)
        raise StartError(
            f"The station's file cannot be used: {why.rstrip('.')}.",
            where=f"{path} (setting stations_file)",
            advice="Make it with hedgehop stations, and name it as a path that this user may read.",
        ) from error


def _name_in(path: Path) -> str:
    try:
        return read_common_name(path)
    except CertificateError as error:
        if isinstance(error.__cause__, OSError):
            raise error.__cause__ from None
        raise StationsError("Its certificate is damaged") from error


def _why(error: Exception) -> str:
    if isinstance(error, DescribedError):
        return error.what
    if isinstance(error, UnicodeDecodeError):
        return "It holds something else than keys and certificates"
    return getattr(error, "strerror", None) or "Its name is no path"


def _is_of(path: Path, authority_pem: str) -> bool:
    """Whether a station's file was made by this authority, and not by one before it."""
    return _parts(path.read_text(encoding="ascii"))[-1].strip() == authority_pem.strip()


def _parts(pem: str) -> list[str]:
    return [_BEGIN + part for part in pem.split(_BEGIN)[1:]]
