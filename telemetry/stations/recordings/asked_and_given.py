"""What stations ask each other about recordings, and give: lists and pieces, as bounded MessagePack arrays.

``hedgehop/recordings/1/FROM/to/TO/ask`` and ``.../give``: a station puts below its own name and hears what is for it
alone, which the router holds it to. So no piece crosses a third station's line.
"""

from __future__ import annotations

import re
from typing import Annotated

import msgspec

from telemetry.errors import StationsError
from telemetry.stations.station_messages import Count, cleaned
from telemetry.stations.station_names import checked_name
from telemetry.topics.station_recordings import OfferedRecording, RecordingThere

ROOT = "hedgehop/recordings/1"
MESSAGE_BYTES, PIECE_BYTES = 4096, 1200
"""A piece fits one packet: a position waits behind it for 40 ms on a line of 256 kbit/s."""
MOST_OFFERED, OFFERS_AT_ONCE, PIECES_AT_ONCE = 50, 8, 16
MOST_RECORDING_BYTES = 4 * 1024**3
NAME_BYTES, WORDS_BYTES = 100, 48
_HASH_BYTES = 32
_MOST_UTC_MS = 10**14
_NAME = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9 _-]|\.(?!\.))*\.(?:mcap|tlog|bin|ulg)", re.ASCII)

Meta = msgspec.Meta
Hash = Annotated[bytes, Meta(min_length=_HASH_BYTES, max_length=_HASH_BYTES)]
Utc = Annotated[int, Meta(ge=0, le=_MOST_UTC_MS)] | None
Words = Annotated[str, Meta(max_length=200)]
At = Annotated[int, Meta(ge=0, le=MOST_RECORDING_BYTES)]
Few = Annotated[int, Meta(ge=0, le=10_000)]


class ListAsk(msgspec.Struct, tag=1, array_like=True, frozen=True, forbid_unknown_fields=True):
    first: Few
    """From which place of the list on."""


class PiecesAsk(msgspec.Struct, tag=2, array_like=True, frozen=True, forbid_unknown_fields=True):
    sha256: Hash
    offsets: Annotated[tuple[At, ...], Meta(min_length=1, max_length=PIECES_AT_ONCE)]
    """Multiples of ``PIECE_BYTES``."""


class Offer(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    sha256: Hash
    name: Words
    size: Annotated[int, Meta(ge=1, lt=2**53)]
    begin_utc_ms: Utc
    end_utc_ms: Utc
    vehicle: Words
    plan: Words


class ListGive(msgspec.Struct, tag=1, array_like=True, frozen=True, forbid_unknown_fields=True):
    is_on: bool
    edition: Count
    """Another one: the list has changed, and what came of it before is not to be put together with this."""
    total: Few
    unread: Few
    """So many more there are whose SHA-256 is still being computed."""
    first: Few
    offers: Annotated[tuple[Offer, ...], Meta(max_length=OFFERS_AT_ONCE)]


class PieceGive(msgspec.Struct, tag=2, array_like=True, frozen=True, forbid_unknown_fields=True):
    sha256: Hash
    offset: At
    data: Annotated[bytes, Meta(min_length=1, max_length=PIECE_BYTES)]


class NoPiece(msgspec.Struct, tag=3, array_like=True, frozen=True, forbid_unknown_fields=True):
    sha256: Hash
    why: Annotated[int, Meta(ge=0, le=3)]
    """Its place in ``WHY``."""


Asked = ListAsk | PiecesAsk
Given = ListGive | PieceGive | NoPiece
REMOVED, CHANGED, LOOKING, OFF = range(4)
WHY = "it was removed there", "it was changed there", "it is still being looked for there", "it is not offered any more"


def asks_key(own: str, other: str) -> str:
    return f"{ROOT}/{own}/to/{other}/ask"


def gives_key(own: str, other: str) -> str:
    return f"{ROOT}/{own}/to/{other}/give"


def sent_by(station: str) -> str:
    """All that this station may put."""
    return f"{ROOT}/{checked_name(station)}/to/**"


def meant_for(station: str) -> str:
    """All that this station may hear."""
    return f"{ROOT}/*/to/{checked_name(station)}/**"


def read_key(text: str, own: str) -> tuple[str, bool]:
    """Who sent it, and whether it asks. Raises StationsError."""
    match text.removeprefix(f"{ROOT}/").split("/") if text.startswith(f"{ROOT}/") else []:
        case [sender, "to", to, "ask" | "give" as what] if to == own != sender:
            return checked_name(sender), what == "ask"
    raise StationsError("A message about recordings came under a name that no station uses.")


def file_name(name: str) -> str:
    """The name unchanged. Raises StationsError for one that leads out of its folder, hides, or is no recording's."""
    if not _NAME.fullmatch(name) or len(name) > NAME_BYTES:
        raise StationsError(
            f"{cleaned(name, 60)!r} is no plain name of a recording: it is neither listed nor fetched.",
            advice="Rename it there: letters, digits, spaces, - and _, ending in .mcap, .tlog, .bin or .ulg.",
        )
    return name


def plain_file_name(name: str) -> str:
    """As others take it, of a file here whose suffix is a recording's."""
    stem, _, suffix = name.rpartition(".")
    plain = re.sub(r"\.\.+", ".", re.sub(r"[^A-Za-z0-9 ._-]", "_", stem)).strip(" ._-")[: NAME_BYTES - 5]
    return f"{plain or 'recording'}.{suffix.lower()}"


def offer(of: OfferedRecording, sha256: bytes, size_bytes: int) -> Offer:
    return Offer(
        sha256,
        plain_file_name(of.name),
        size_bytes,
        _ms(of.begin_utc_s),
        _ms(of.end_utc_s),
        cleaned(of.vehicle, WORDS_BYTES),
        cleaned(of.plan, WORDS_BYTES),
    )


def recording_there(offered: Offer) -> RecordingThere:
    """Raises StationsError: an evil name, or more bytes than are taken."""
    if offered.size > MOST_RECORDING_BYTES:
        raise StationsError(
            f"{cleaned(offered.name, 60)} has {offered.size / 1e9:.1f} GB, more than the "
            f"{MOST_RECORDING_BYTES / 1e9:.1f} GB that are fetched.",
            advice="Bring it on a disk.",
        )
    return RecordingThere(
        offered.sha256.hex(),
        file_name(offered.name),
        offered.size,
        _s(offered.begin_utc_ms),
        _s(offered.end_utc_ms),
        cleaned(offered.vehicle, WORDS_BYTES),
        cleaned(offered.plan, WORDS_BYTES),
    )


def _ms(utc_s: float | None) -> int | None:
    return round(1000 * utc_s) if utc_s is not None and 0.0 <= 1000 * utc_s <= _MOST_UTC_MS else None


def _s(utc_ms: int | None) -> float | None:
    return None if utc_ms is None else utc_ms / 1000
