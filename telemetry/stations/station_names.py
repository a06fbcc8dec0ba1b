"""Names of what stations tell each other, and what a station's own name may be.

``hedgehop/stations/1/NAME/vehicle/NUMBER``, ``.../NAME/line/NUMBER`` and ``.../NAME/beacon``: a station puts below
its own name only, which the router holds it to (``telemetry/stations/router_file.py``).
"""

from __future__ import annotations

import re
from typing import NamedTuple

from telemetry.errors import StationsError

ROOT = "hedgehop/stations/1"
"""1 is the version of the messages: stations of another one are not heard at all."""
EVERYTHING = f"{ROOT}/**"
ROUTER_PORT = 7447
MOST_STATIONS, MOST_VEHICLES = 32, 32
"""Others that are kept; and of each: vehicles are numbered from 1 on."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,23}", re.ASCII)
_HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,252})|\[[0-9A-Fa-f:.]{2,45}\]", re.ASCII)


class Key(NamedTuple):
    station: str
    vehicle: int | None
    """None: the station's beacon."""
    is_line: bool = False
    """The line that the vehicle flies, not how it is."""


def checked_name(name: str) -> str:
    """The name unchanged. Raises StationsError."""
    if not _NAME.fullmatch(name):
        raise StationsError(
            f"{name!r:.60} cannot be a station's name.",
            advice="Use up to 24 letters, digits, hyphens and underscores, a letter or digit first.",
        )
    return name


def below(station: str) -> str:
    """All that this station may put."""
    return f"{ROOT}/{checked_name(station)}/**"


def vehicle_key(station: str, number: int) -> str:
    return f"{ROOT}/{station}/vehicle/{number}"


def line_key(station: str, number: int) -> str:
    return f"{ROOT}/{station}/line/{number}"


def beacon_key(station: str) -> str:
    return f"{ROOT}/{station}/beacon"


def read_key(text: str) -> Key | None:
    """None: nothing that a station puts."""
    parts = text.removeprefix(f"{ROOT}/").split("/") if text.startswith(f"{ROOT}/") else []
    if not parts or not _NAME.fullmatch(parts[0]):
        return None
    match parts[1:]:
        case ["beacon"]:
            return Key(parts[0], None)
        case ["vehicle" | "line" as what, number] if number.isascii() and number.isdecimal() and len(number) <= 2:
            at = int(number)
            return Key(parts[0], at, what == "line") if 1 <= at <= MOST_VEHICLES and str(at) == number else None
    return None


def router_endpoint(text: str) -> str:
    """``tls/HOST:PORT`` of HOST, HOST:PORT or that; an IPv6 address stands in brackets. Raises StationsError."""
    rest = text.strip().removeprefix("tls/")
    host, colon, port = rest.rpartition(":") if not rest.endswith("]") else (rest, "", "")
    if not colon:
        host, port = rest, str(ROUTER_PORT)
    if not _HOST.fullmatch(host) or not (port.isascii() and port.isdecimal() and 0 < int(port[:6]) < 65_536):
        raise StationsError(
            f"{text!r:.80} is no router.",
            advice="Write HOST, HOST:PORT or tls/HOST:PORT; an IPv6 address stands in brackets.",
        )
    return f"tls/{host}:{int(port)}"
