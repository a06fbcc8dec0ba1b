"""The router's whole configuration as one file, for ``zenohd -c`` or for Zenoh's own router in a test.

Mutual TLS, and access control by the name in each client's certificate: a station hears all and puts below its own name
only; of recordings it hears what is meant for it alone; queries, deletions, liveliness and the router's administration
are refused to everybody.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

from telemetry.stations.recordings import asked_and_given as recordings
from telemetry.stations.station_names import EVERYTHING, MOST_STATIONS, below

_SESSIONS = 2 * MOST_STATIONS
_LARGEST_BYTES = 65_536
LEASE_MS = 6000
"""One that says nothing for so long is gone."""


def router_file(
    stations: Sequence[str], *, authority_pem: bytes, certificate_pem: bytes, key_pem: bytes, listen: Sequence[str]
) -> str:
    """JSON5 that holds the router's key, too: for its user's eyes only. ``listen``: ``tls/[::]:7447``.

    Raises StationsError for a name that is none.
    """
    config: dict[str, Any] = {
        "mode": "router",
        "listen": {"endpoints": list(listen)},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "adminspace": {"enabled": False},
        "timestamping": {"enabled": False},
        "transport": {
            "unicast": {"max_sessions": _SESSIONS},
            "shared_memory": {"enabled": False},
            "link": {
                "protocols": ["tls"],
                "tx": {"lease": LEASE_MS, "keep_alive": 4},
                "rx": {"max_message_size": _LARGEST_BYTES},
                "tls": {
                    "enable_mtls": True,
                    "close_link_on_expiration": True,
                    "root_ca_certificate_base64": _encoded(authority_pem),
                    "listen_certificate_base64": _encoded(certificate_pem),
                    "listen_private_key_base64": _encoded(key_pem),
                },
            },
        },
        "access_control": access_control(stations),
    }
    return "// Written by hedgehop stations: it writes this file anew for each new station.\n" + json.dumps(
        config, indent=2
    )


def access_control(stations: Sequence[str]) -> dict[str, Any]:
    """What is not allowed here is denied. Of several certificates each has its own name."""
    hear, deliver, wanted = "stations-hear", "stations-deliver", "recordings-wanted"
    rules = [
        _rule(hear, "ingress", ["declare_subscriber"], EVERYTHING),
        _rule(deliver, "egress", ["put", "declare_subscriber"], EVERYTHING),
        _rule(wanted, "egress", ["declare_subscriber"], f"{recordings.ROOT}/**"),
        *(rule for name in stations for rule in _own_rules(name)),
    ]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, "cert_common_names": [name]} for name in stations],
        "policies": [
            {"rules": [hear, deliver, wanted, *(rule["id"] for rule in _own_rules(name))], "subjects": [name]}
            for name in stations
        ],
    }


def _own_rules(station: str) -> list[dict[str, Any]]:
    """What is this one's alone."""
    return [
        _rule(f"give-{station}", "ingress", ["put"], recordings.sent_by(station)),
        _rule(f"want-{station}", "ingress", ["declare_subscriber"], recordings.meant_for(station)),
        _rule(f"get-{station}", "egress", ["put"], recordings.meant_for(station)),
        _rule(f"tell-{station}", "ingress", ["put"], below(station)),
    ]


def _rule(name: str, flow: str, messages: list[str], keys: str) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": [keys]}


def _encoded(pem: bytes) -> str:
    return base64.b64encode(pem).decode()
