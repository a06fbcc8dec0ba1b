"""Keys, liveliness tokens and attachments as rmw_zenoh writes them (its docs/design.md). Knows nothing of Zenoh.

Data: ``domain/topic/type/hash``. A node's token: ``@ros2_lv/domain/session/node/node/NN/enclave/namespace/name``. A
publisher's (MP) or subscription's (MS): the same with its own number, and ``/topic/type/hash/QoS`` behind; "%" stands
for "/" in it. The attachment of a message: sequence number, source timestamp in ns, the publisher's GID.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Literal

import xxhash

from telemetry.errors import Ros2Error

EntityKind = Literal["NN", "MP", "MS", "SS", "SC"]
"""Node, publisher, subscription, service, client."""
KINDS: frozenset[str] = frozenset({"NN", "MP", "MS", "SS", "SC"})
NO_HASH = "TypeHashNotSupported"
"""What humble writes, which knows no hashes of types."""
GID_BYTES = 16
MOST_DOMAIN = 232
LONGEST_KEY = 2048
_ADMIN = "@ros2_lv"
_NODE_PARTS, _ENDPOINT_PARTS = 9, 13
_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+", re.ASCII)
_TYPE = re.compile(r"([a-z][a-z0-9_]*)::([a-z]+)::dds_::([A-Za-z][A-Za-z0-9_]*)_", re.ASCII)
_ATTACHMENT = struct.Struct("<qqB16s")
"""zenoh-cpp writes an array's length before it."""
_DEFAULT_DEPTH = 42
_DEFAULTS = {"reliability": "1", "durability": "2", "history": "1"}
"""Reliable, volatile, keep last: what an empty field means."""
_TRANSIENT_LOCAL = "1"


class GrammarError(Ros2Error):
    """A key, token or attachment that rmw_zenoh would not write."""

    code = "ros2_grammar"


@dataclass(frozen=True, slots=True)
class DataKey:
    """Where messages of one topic and type travel."""

    domain: int
    topic: str
    """With its leading slash."""
    type: str
    """As ROS 2 writes it: sensor_msgs/msg/PointCloud2."""
    hash: str

    def __str__(self) -> str:
        return f"{self.domain}/{self.topic.strip('/')}/{wire_type(self.type)}/{self.hash}"


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Who publishes, or subscribes to, one topic."""

    kind: EntityKind
    session: str
    node: str
    """With its namespace: /robot/lidar."""
    number: str
    key: DataKey
    keeps: bool
    """Transient local: its last messages are handed to who comes late."""
    depth: int = _DEFAULT_DEPTH


@dataclass(frozen=True, slots=True)
class Attachment:
    """What travels beside each message."""

    sequence: int
    source_ns: int
    """When it was published, by the publisher's clock, since 1970."""
    gid: bytes

    def packed(self) -> bytes:
        return _ATTACHMENT.pack(self.sequence, self.source_ns, GID_BYTES, self.gid)


def topic_name(name: str) -> str:
    """With its leading slash. Raises GrammarError for what ROS 2 would not take as a topic."""
    full = name if name.startswith("/") else f"/{name}"
    if len(full) > 255 or not _TOPIC.fullmatch(full):
        advice = "Write it as `ros2 topic list` does: /lidar/points."
        raise GrammarError(f"{name!r:.80} is no topic of ROS 2.", where="ros2", advice=advice)
    return full


def wire_type(name: str) -> str:
    """sensor_msgs/msg/PointCloud2 -> sensor_msgs::msg::dds_::PointCloud2_"""
    package, kind, message = name.split("/")
    return f"{package}::{kind}::dds_::{message}_"


def ros_type(name: str) -> str:
    """The way back. Raises GrammarError."""
    found = _TYPE.fullmatch(name)
    if found is None:
        raise GrammarError(f"{name!r:.80} is no type of ROS 2.", where="ros2")
    return "/".join(found.groups())


def any_type_key(domain: int, topic: str) -> str:
    """For a subscriber to whatever types and hashes a topic comes with: both are read from each message's key."""
    return f"{domain}/{topic_name(topic).strip('/')}/*/*"


def all_tokens(domain: int) -> str:
    return f"{_ADMIN}/{domain}/**"


def read_key(text: str) -> DataKey:
    """Raises GrammarError."""
    parts = text.split("/")
    if len(text) > LONGEST_KEY or len(parts) < 4 or not all(parts):
        raise GrammarError(f"{text!r:.80} is no key of a topic.", where="ros2")
    domain, *topic, kind, digest = parts
    return DataKey(_domain(domain), topic_name("/".join(topic)), ros_type(kind), digest)


def read_token(text: str) -> Endpoint | None:
    """None for a node, a service or a client. Raises GrammarError."""
    parts = text.split("/")
    if len(text) > LONGEST_KEY or len(parts) < _NODE_PARTS or parts[0] != _ADMIN or not all(parts):
        raise GrammarError(f"{text!r:.80} is no liveliness token.", where="ros2")
    _, domain, session, _, number, kind, _, namespace, name, *rest = parts
    if kind not in KINDS:
        raise GrammarError(f"{kind!r:.20} is no kind of token.", where="ros2")
    if kind not in ("MP", "MS"):
        return None
    if len(parts) < _ENDPOINT_PARTS:
        raise GrammarError(f"{text!r:.80} lacks its topic.", where="ros2")
    topic, wire, digest, qos = rest[:4]
    key = DataKey(_domain(domain), topic_name(plain(topic)), ros_type(plain(wire)), plain(digest))
    keeps, depth = _qos(qos)
    return Endpoint(kind, session, f"{plain(namespace).rstrip('/')}/{name}", number, key, keeps, depth)


def node_token(domain: int, session: str, name: str) -> str:
    return f"{_ADMIN}/{domain}/{session}/0/0/NN/%/%/{name}"


def endpoint_token(endpoint: Endpoint) -> str:
    """Of one of our own node, which has the number 0 and no namespace."""
    key = endpoint.key
    qos = f":{_TRANSIENT_LOCAL if endpoint.keeps else ''}:,{endpoint.depth}:,:,:,,"
    head = f"{_ADMIN}/{key.domain}/{endpoint.session}/0/{endpoint.number}/{endpoint.kind}/%/%{endpoint.node}"
    return f"{head}/{mangled(key.topic)}/{wire_type(key.type)}/{key.hash}/{qos}"


def gid_of(token: str) -> bytes:
    """XXH3 of its token, 128 bits, the lower half first."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(GID_BYTES, "little")


def read_attachment(data: bytes) -> Attachment:
    """Raises GrammarError."""
    if len(data) != _ATTACHMENT.size:
        raise GrammarError(f"An attachment has {_ATTACHMENT.size} bytes, not {len(data)}.", where="ros2")
    sequence, source_ns, length, gid = _ATTACHMENT.unpack(data)
    if length != GID_BYTES or source_ns < 0:
        raise GrammarError("An attachment contradicts itself.", where="ros2")
    return Attachment(sequence, source_ns, gid)


def mangled(name: str) -> str:
    return name.replace("/", "%")


def plain(name: str) -> str:
    return name.replace("%", "/")


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit()


def _domain(text: str) -> int:
    if not (_is_number(text) and len(text) <= 3 and int(text) <= MOST_DOMAIN):
        raise GrammarError(f"{text!r:.20} is no domain.", where="ros2", advice=f"Domains are 0 to {MOST_DOMAIN}.")
    return int(text)


def _qos(text: str) -> tuple[bool, int]:
    """``reliability:durability:history,depth:...``: whether it keeps its last messages, and how many."""
    parts = text.split(":")
    history = parts[2].split(",") if len(parts) >= 6 else []
    if len(history) < 2 or not all(_is_number(each) or not each for each in (parts[0], parts[1], *history[:2])):
        raise GrammarError(f"{text!r:.60} tells no quality of service.", where="ros2")
    depth = int(history[1][:9]) if history[1] else _DEFAULT_DEPTH
    return (parts[1] or _DEFAULTS["durability"]) == _TRANSIENT_LOCAL, depth
