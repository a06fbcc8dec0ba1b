"""Link strings: what Hedgehop connects to, in pymavlink's spelling and in MAVSDK's.

Only what is listed here is ever opened, and of the file system only serial devices: a library that opens whatever a
string names would read /etc/passwd as if it were a recording.
"""

from __future__ import annotations

import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from telemetry.errors import AddressError

Kind = Literal["udpin", "udpout", "tcpout", "tcpin", "serial"]

_SCHEMES: dict[str, Kind] = {
    "udp": "udpin",
    "udpin": "udpin",
    "udpout": "udpout",
    "tcp": "tcpout",
    "tcpout": "tcpout",
    "tcpin": "tcpin",
    "serial": "serial",
}
_DEFAULT_PORTS: dict[Kind, int] = {"udpin": 14550, "udpout": 14550, "tcpout": 5760, "tcpin": 5760}
DEFAULT_BAUD = 57600
_BAUDS = range(300, 20_000_001)
_DEVICE = re.compile(r"/dev/(tty[A-Za-z]+\w*|cu\.[\w.-]+|serial/by-(id|path)/[\w.,:+@=-]+|rfcomm\d+|pts/\d+)")
_NETWORK = re.compile(r"(?P<scheme>[A-Za-z0-9]+):(?://)?(?P<rest>[^/]*)/?")
_HOST_PORT = re.compile(r"(?:\[(?P<v6>[0-9A-Fa-f:.%\w]+)\]|(?P<host>[^:\[\]]*))(?::(?P<port>[^:]*))?")
_HOST_NAME = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_.-]{0,252})")
EXAMPLES = "Write udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:0.0.0.0:PORT or /dev/ttyACM0:57600."


@dataclass(frozen=True, slots=True)
class Address:
    """Where vehicles are to be found. ``host`` and ``port`` of a network, ``device`` and ``baud`` of a serial line."""

    kind: Kind
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = 0

    @property
    def text(self) -> str:
        """The one spelling that every message uses."""
        if self.kind == "serial":
            return f"{self.device}:{self.baud}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'tcp' if self.kind == 'tcpout' else self.kind}:{host}:{self.port}"

    @property
    def names_far_end(self) -> bool:
        """The operator has named who is to be talked to; otherwise we listen to whoever comes."""
        return self.kind in ("udpout", "tcpout", "serial")


def parse_address(text: str) -> Address:
    """Raises AddressError for everything that is not on the list."""
    wanted = text.strip()
    if wanted.startswith("/"):
        return _serial(wanted, wanted)
    scheme, colon, rest = wanted.partition(":")
    kind = _SCHEMES.get(scheme.lower()) if colon else None
    if kind is None:
        raise AddressError(f"{_shown(text)} names no connection that Hedgehop makes.", advice=EXAMPLES)
    if kind == "serial":
        return _serial(wanted, rest.removeprefix("//"))
    return _network(wanted, kind)


def parse_addresses(text: str) -> tuple[Address, ...]:
    """Of several ways to one vehicle, with commas between. Raises AddressError, also for one that is named twice."""
    found = tuple(parse_address(part) for part in text.split(",") if part.strip())
    if not found:
        raise AddressError("No connection is named.", advice=EXAMPLES)
    if len({each.text for each in found}) < len(found):
        raise AddressError(f"{_shown(text)} names a connection twice.", advice="Name each way to the vehicle once.")
    return found


def _network(text: str, kind: Kind) -> Address:
    parts = _NETWORK.fullmatch(text)
    place = _HOST_PORT.fullmatch(parts["rest"]) if parts else None
    if place is None:
        raise AddressError(f"{_shown(text)} has no host and port that can be read.", advice=EXAMPLES)
    host = place["v6"] or place["host"] or _default_host(text, kind)
    if not place["v6"] and not _HOST_NAME.fullmatch(host):
        raise AddressError(f"{_shown(text)}: {_shown(host)} is no host name.", advice=EXAMPLES)
    return Address(kind, host=host, port=_port(text, kind, place["port"]))


def _default_host(text: str, kind: Kind) -> str:
    if kind in ("udpin", "tcpin"):
        return "0.0.0.0"
    raise AddressError(f"{_shown(text)} does not say which host to connect to.", advice=EXAMPLES)


def _port(text: str, kind: Kind, digits: str | None) -> int:
    if digits is None:
        return _DEFAULT_PORTS[kind]
    port = int(digits) if re.fullmatch(r"[0-9]{1,9}", digits) else None
    if port is None or not 1 <= port <= 65535:
        advice = "A port is a number from 1 to 65535."
        raise AddressError(f"{_shown(text)}: {_shown(digits)} is no port.", advice=advice)
    return port


def _serial(text: str, rest: str) -> Address:
    head, separator, tail = _split_baud(rest)
    if not _DEVICE.fullmatch(head) or ".." in head:
        raise AddressError(
            f"{_shown(text)} is no serial device.",
            advice="Serial devices look like /dev/ttyACM0, /dev/ttyUSB0 or /dev/serial/by-id/...; "
            "a recording is opened in Review, a mission in Plan.",
        )
    baud = int(tail) if separator else DEFAULT_BAUD
    if baud not in _BAUDS:
        advice = "Usual ones are 57600, 115200 and 921600."
        raise AddressError(f"{_shown(text)}: {baud} is no baud rate.", advice=advice)
    refuse_file(Path(head), text)
    return Address("serial", device=head, baud=baud)


def refuse_file(device: Path, text: str) -> None:
    """Raises AddressError when ``device`` exists and is something else than a character device."""
    try:
        mode = device.stat().st_mode
    except OSError:
        return  # Not plugged in yet: opening it says so, again and again.
    if not stat.S_ISCHR(mode):
        raise AddressError(f"{_shown(text)} is no serial device but a file or folder.", advice=EXAMPLES)


def _split_baud(rest: str) -> tuple[str, str, str]:
    """Names under /dev/serial/by-path hold colons themselves: only digits at the very end are a baud rate."""
    found = re.fullmatch(r"(.+?)([:,])([0-9]{1,9})", rest)
    return (found[1], found[2], found[3]) if found else (rest, "", "")


def _shown(text: str) -> str:
    return repr(text if len(text) <= 100 else f"{text[:100]}...")
