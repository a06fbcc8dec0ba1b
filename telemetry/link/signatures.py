"""The keys of the vehicles that sign: which of their messages are accepted, and what outlives a crash.

Timestamps are saved ahead in blocks: a link that ends without a word begins behind the block, and neither uses one
twice nor takes a frame twice.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from telemetry.link.heartbeat import PERIOD_S
from telemetry.link.keys import write_key_file
from telemetry.mavlink.connections import Peer
from telemetry.mavlink.signing import KEY_BYTES, PER_S, UNSIGNED, Signing, Stream, Verdict, is_signed, timestamp_of
from telemetry.topics.messages import SigningMode, SigningStatus

AHEAD, STREAM_AHEAD = 60 * PER_S, 2 * PER_S
"""What is reserved with each save, of our own timestamps and of a stream's."""
SAVE_EVERY_S = 0.25
SAID_S = 10.0
MOST_STREAMS, MOST_LATE = 64, 32


class _Kept(msgspec.Struct, frozen=True):
    """One vehicle in the file. ``streams``: (system, component, link, timestamp)."""

    system_id: int
    key: str
    mode: SigningMode
    timestamp: int
    streams: tuple[tuple[int, int, int, int], ...]


@dataclass(slots=True)
class Keyed:
    """A vehicle's key, and what came with and without it."""

    signing: Signing
    mode: SigningMode
    refused: Counter[Verdict] = field(default_factory=Counter)
    good_s: float = float("-inf")
    refused_s: float = float("-inf")
    reserved: int = 0
    reserved_streams: dict[Stream, int] = field(default_factory=dict)

    @property
    def status(self) -> SigningStatus:
        count = self.refused
        return SigningStatus(self.mode, count["unsigned"], count["wrong"], count["replayed"], count["ahead"])


class KeyRing:
    """By system id. ``file`` None: keys are forgotten with this process.

    ``mode`` of a key: "asked", until the vehicle has signed with it; "on"; "let": switched off here, and nobody knows
    whether the vehicle has heard of it, so everything is accepted and what is sent is still signed.
    """

    def __init__(self, file: Path | None = None, *, clock: Callable[[], float] = time.time) -> None:
        self._file, self._clock = file, clock
        self._keyed: dict[int, Keyed] = {}
        self._strange_s: dict[int, float] = {}
        """When vehicles whose key is not here last signed."""
        self._saving = asyncio.Lock()
        self.trouble = ""
        """Why keys could not be read or kept."""
        self._load()

    @property
    def _now(self) -> int:
        return timestamp_of(self._clock())

    def of(self, system_id: int) -> Keyed | None:
        return self._keyed.get(system_id)

    def status(self, system_id: int) -> SigningStatus:
        keyed = self.of(system_id)
        return SigningStatus() if keyed is None else keyed.status

    def new_key(self, system_id: int) -> Keyed:
        """Not used until it has been saved."""
        keyed = Keyed(Signing(secrets.token_bytes(KEY_BYTES), self._now), "asked")
        self._keyed[system_id] = keyed
        return keyed

    def seal(self, system_id: int | None, frame: bytes, link: int) -> bytes:
        keyed = None if system_id is None else self.of(system_id)
        return frame if keyed is None else keyed.signing.sign(frame, link=link, now=self._now)

    def judge(
        self, system_id: int, message_id: int, frame: bytes, now_s: float, *, way: str = "", beside: str = ""
    ) -> Verdict:
        """ "good": it may be used; that is every message of a vehicle without a key. ``way``, ``beside``: as in
        ``Signing.verify``."""
        keyed = self.of(system_id)
        if keyed is None:
            if is_signed(frame):
                self._strange_s[system_id] = now_s
            return "good"
        if keyed.mode == "let":
            return "good"  # whatever key it may have got since
        verdict = keyed.signing.verify(frame, now=self._now, way=way, beside=beside)
        if verdict == "good":
            keyed.good_s = now_s
            if keyed.mode == "asked":
                keyed.mode = "on"
            return verdict
        if keyed.mode == "asked" or (verdict == "unsigned" and message_id in UNSIGNED):
            return "good"
        keyed.refused[verdict] += 1
        keyed.refused_s = now_s
        return verdict

    def warnings(self, system_id: int | None, now_s: float) -> tuple[str, ...]:
        keyed = None if system_id is None else self.of(system_id)
        said = [self.trouble] if self.trouble else []
        if keyed is None and system_id is not None and now_s - self._strange_s.get(system_id, -SAID_S) < SAID_S:
            said.append(
                "This vehicle signs its messages with a key that is not here: it will not obey. Use the data "
                "directory that has its key, or connect by USB and set up signing again."
            )
        if keyed is not None and now_s - keyed.refused_s < SAID_S:
            total = keyed.refused.total()
            said.append(
                f"{total} messages in this vehicle's name were refused: they were not signed by it, or had come "
                "before. If the vehicle is silent, it may have lost its key: see Signing."
            )
        return tuple(said)

    # What outlives this process.

    async def run(self) -> None:
        """Saves ahead, beside everything else: a slow disk holds up nothing."""
        while True:
            await asyncio.sleep(SAVE_EVERY_S)
            if any(self._is_due(keyed) for keyed in self._keyed.values()):
                await self.save()

    async def save(self) -> None:
        if self._file is None:
            return
        async with self._saving:
            await self._save(self._file)

    async def _save(self, file: Path) -> None:
        try:
            await asyncio.to_thread(write_key_file, file, self._reserved())
            self.trouble = ""
        except OSError as error:
            for keyed in self._keyed.values():
                keyed.reserved = 0  # tried again
            self.trouble = f"The signing keys cannot be saved: {error.strerror}. Free space in the data folder."

    def _is_due(self, keyed: Keyed) -> bool:
        signing = keyed.signing
        behind = any(at > keyed.reserved_streams.get(s, 0) - STREAM_AHEAD // 2 for s, at in signing.streams.items())
        return behind or signing.newest > keyed.reserved - AHEAD // 2

    def _reserved(self) -> bytes:
        kept: list[_Kept] = []
        for system_id, keyed in self._keyed.items():
            signing = keyed.signing
            newest = sorted(signing.streams.items(), key=lambda one: one[1])[-MOST_STREAMS:]
            signing.streams = dict(newest)
            keyed.reserved = signing.newest + AHEAD
            keyed.reserved_streams = {stream: at + STREAM_AHEAD for stream, at in newest}
            rows = tuple((*stream, at) for stream, at in keyed.reserved_streams.items())
            kept.append(_Kept(system_id, signing.key.hex(), keyed.mode, keyed.reserved, rows))
        return msgspec.json.encode(kept)

    def _load(self) -> None:
        if self._file is None:
            return
        try:
            found = msgspec.json.decode(self._file.read_bytes(), type=list[_Kept])
            self._keyed = {one.system_id: _keyed(one) for one in found}
        except FileNotFoundError:
            return
        except (OSError, ValueError) as error:
            self.trouble = (
                f"The signing keys cannot be read ({error}): a vehicle that signs obeys nothing. See Signing."
            )


class Late:
    """Who signed with a key, too late, and when it was last told the time."""

    def __init__(self) -> None:
        self._told: dict[tuple[str, Peer], tuple[int, float]] = {}

    def is_to_be_told(self, address: str, peer: Peer, system_id: int, now_s: float) -> bool:
        """Once a second."""
        key = (address, peer)
        if now_s - self._told.get(key, (0, -PERIOD_S))[1] < PERIOD_S:
            return False
        self._told.pop(key, None)
        self._told[key] = (system_id, now_s)
        if len(self._told) > MOST_LATE:
            del self._told[next(iter(self._told))]
        return True

    def system_id(self, address: str, peer: Peer) -> int | None:
        return self._told.get((address, peer), (None, 0.0))[0]


def _keyed(one: _Kept) -> Keyed:
    streams = {(system, component, link): at for system, component, link, at in one.streams}
    newest = max([one.timestamp, *streams.values()])
    return Keyed(Signing(bytes.fromhex(one.key), newest, streams), one.mode)
