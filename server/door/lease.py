"""Who is in charge: one session at a time may command the vehicle, and every command carries a fencing token.

Whoever has no page any more, and commands nothing either, loses it to a page that is there, but never in flight: a
browser that comes back must not find another one in charge.

The token only ever grows, across restarts too: it counts milliseconds since 1970, or one more than the last one if
the clock went back. Whoever held the lease before has a lower token, and the link node refuses it. Where the clock went
back by more than a day, both begin anew. A token that the link has seen and that was not issued here is a stranger's:
the one in charge gets a higher one.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from server.errors import NotInChargeError
from server.library.whole_files import write_atomically
from server.schemas import LeaseDoc
from telemetry.topics.requests import Operator, highest_possible_token

log = logging.getLogger("hedgehop.flying")

SERVER_NAME = "Hedgehop"
"""What the server calls itself when it opens the connections it was started with."""


GONE_S = 8.0
"""Without a page for so long, nobody comes back to it: a page that lost its server tries again every 5 s."""


@dataclass(frozen=True, slots=True)
class Holder:
    session_key: str
    name: str


class Lease:
    """Every method belongs to the event loop's thread, but for ``save``, which may block."""

    def __init__(
        self,
        file: Path,
        *,
        clock_utc_s: Callable[[], float] = time.time,
        now_mono_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._file, self._clock_utc_s, self._now_mono_s = file, clock_utc_s, now_mono_s
        self._token, self._holder = self._read()
        self._since_token = self._token
        """The first one of who is in charge, or of nobody."""
        self._seen_mono_s = now_mono_s()

    @property
    def holder(self) -> Holder | None:
        return self._holder

    def doc_for(self, session_key: str) -> LeaseDoc:
        holder = self._holder
        return LeaseDoc(
            holder=None if holder is None else holder.name,
            mine=holder is not None and holder.session_key == session_key,
        )

    def take_if_free(self, session_key: str) -> bool:
        """The first one to open a page takes charge; False when somebody is in charge already."""
        if self._holder is not None:
            return False
        self.take(session_key)
        return True

    def take(self, session_key: str, name: str = "") -> Holder | None:
        """Takes charge; the one who was in charge before, unless it was this session."""
        before = self._holder
        self._holder = Holder(session_key, name or default_name(session_key))
        self._seen_mono_s = self._now_mono_s()
        self._next_token()
        return before if before is not None and before.session_key != session_key else None

    def pass_on(self, present: Sequence[str], *, in_flight: bool) -> bool:
        """To be told regularly whose pages are open: whether the first of ``present`` has taken charge just now."""
        holder, now_mono_s = self._holder, self._now_mono_s()
        if holder is None:
            return False  # let go on purpose
        if in_flight or holder.session_key in present:
            self._seen_mono_s = now_mono_s
        if not present or now_mono_s - self._seen_mono_s < GONE_S:
            return False
        self.take(present[0])
        return True

    def release(self, session_key: str) -> bool:
        """Lets go, if this session was in charge."""
        if self._holder is None or self._holder.session_key != session_key:
            return False
        self._holder = None
        self._next_token()
        return True

    def operator(self, session_key: str) -> Operator:
        """What a command of this session carries. Raises NotInChargeError when another one, or nobody, is in charge."""
        holder = self._holder
        if holder is None or holder.session_key != session_key:
            who = "Nobody is" if holder is None else f"{holder.name} is"
            raise NotInChargeError(f"{who} in charge of the vehicle.", advice="Press Take control first.")
        self._seen_mono_s = self._now_mono_s()
        return Operator(holder.name, self._issued())

    def server_operator(self) -> Operator:
        """For what the server itself asks of the link node: never against the one in charge."""
        return Operator(SERVER_NAME, self._issued())

    def issue_above(self, operator: Operator, highest: int) -> Operator | None:
        """For an operator whom the link refused for this higher token; None when control really has been passed on."""
        if not self._since_token <= operator.token <= self._token:
            return None
        if highest > self._token:
            log.warning("A program that is not this server has commanded the vehicle: token %d.", highest)
            self._issue(highest + 1)
        return replace(operator, token=self._issued())

    def save(self) -> None:
        """Raises StorageError; nothing is lost but that a restart forgets who was in charge."""
        holder = self._holder
        kept = {"token": self._token, "holder": None if holder is None else [holder.session_key, holder.name]}
        write_atomically(self._file, json.dumps(kept).encode())

    def _next_token(self) -> None:
        self._issue(self._token + 1)
        self._since_token = self._token

    def _issued(self) -> int:
        """Not higher than the link may take, if the clock has been set back since."""
        if self._token > highest_possible_token(self._clock_utc_s()):
            self._next_token()
        return self._token

    def _issue(self, at_least: int) -> None:
        now_utc_s = self._clock_utc_s()
        now = int(1000 * now_utc_s)
        self._token = max(at_least, now) if at_least <= highest_possible_token(now_utc_s) else now

    def _read(self) -> tuple[int, Holder | None]:
        now_utc_s = self._clock_utc_s()
        now = int(1000 * now_utc_s)
        try:
            kept = json.loads(self._file.read_text(encoding="utf-8"))
            holder = None if kept["holder"] is None else Holder(*(str(part) for part in kept["holder"]))
            token = int(kept["token"]) + 1
            return max(token, now) if token <= highest_possible_token(now_utc_s) else now, holder
        except (FileNotFoundError, ValueError, TypeError, KeyError):
            # A damaged file costs pressing a button, never a refused start.
            return now, None


def default_name(session_key: str) -> str:
    """Sessions have no names; four characters tell them apart, and stay the same after a restart."""
    return f"Operator {session_key[:4]}"
