"""Which routers and peers of Zenoh may be reached: those that are named, and by default none beyond one's own nets."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from typing import Literal

from telemetry.errors import Ros2AddressError

DEFAULT_PORT = 7447
HERE = f"tcp/127.0.0.1:{DEFAULT_PORT}"
"""Where ``rmw_zenohd`` listens."""
_PROTOCOL = "tcp"
_NAMED = {"localhost": "127.0.0.1"}


@dataclass(frozen=True, slots=True)
class ZenohAddress:
    """One endpoint, and how it is met: as a router's client, or as its peer."""

    endpoint: str
    """``tcp/127.0.0.1:7447``"""
    mode: Literal["client", "peer"] = "client"


def zenoh_address(text: str, *, is_peer: bool = False) -> ZenohAddress:
    """Of ``HOST``, ``HOST:PORT`` or ``tcp/HOST:PORT``; HOST is a number, or localhost.

    tcp is neither encrypted nor signed: loopback, private and link-local addresses are reached, none on the internet.
    Raises Ros2AddressError.
    """
    protocol, _, rest = text.strip().rpartition("/")
    host, port = _parted(rest)
    if protocol not in ("", _PROTOCOL):
        raise _refused(text, f"it speaks {protocol!r:.20}, not {_PROTOCOL}")
    try:
        address = ipaddress.ip_address(_NAMED.get(host, host))
    except ValueError:
        raise _refused(text, f"{host!r:.60} is no IP address") from None
    if address.is_multicast or address.is_unspecified or getattr(address, "scope_id", None):
        raise _refused(text, f"{host} is nobody's address")
    if address.is_global:
        raise _refused(text, f"{host} is on the internet, and tcp is not encrypted")
    shown = f"[{address}]" if address.version == 6 else str(address)
    return ZenohAddress(f"{_PROTOCOL}/{shown}:{port}", "peer" if is_peer else "client")


def _parted(rest: str) -> tuple[str, int]:
    """Host and port; IPv6 stands in brackets."""
    if rest.startswith("["):
        host, _, tail = rest[1:].partition("]")
        port = tail.removeprefix(":")
    elif rest.count(":") > 1:
        host, port = rest, ""
    else:
        host, _, port = rest.partition(":")
    if not port:
        return host, DEFAULT_PORT
    if not (port.isascii() and port.isdigit() and 0 < int(port[:6]) < 65536):
        raise _refused(rest, f"{port!r:.20} is no port")
    return host, int(port)


def _refused(text: str, why: str) -> Ros2AddressError:
    return Ros2AddressError(
        f"{text!r:.80} is no router that Hedgehop would reach: {why}.",
        where="ros2",
        advice="Write HOST, HOST:PORT or tcp/HOST:PORT, HOST an IP address of your own net; others through a VPN.",
    )
