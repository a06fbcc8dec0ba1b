"""Who is in charge: one session at a time may command the vehicle, and every command carries a fencing token.

It is taken by a press, and never passes on by itself: a browser that comes back must not find another one in charge.
Who is in charge is asked for consent; nobody has to be asked who has been silent for five seconds, without a page that
is heard and without a command. That is so in flight, too.

The token only ever grows, across restarts too: it counts milliseconds since 1970, or one more than the last one if
the clock went back. Whoever held the lease before has a lower token, and the link node refuses it. Where the clock went
back by more than a day, both begin anew. A token that the link has seen and that was not issued here is a stranger's:
the one in charge gets a higher one.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path

from server.errors import ConflictError, NotInChargeError
from server.library.whole_files import write_atomically
from server.schemas import LeaseDoc
from telemetry.topics.requests import Operator, highest_possible_token

log = logging.getLogger("hedgehop.flying")

SERVER_NAME = "Hedgehop"
"""What the server calls itself when it opens the connections it was started with."""
SILENT_S = 5.0
"""A page says every second that it is there; one that lost its server is back within about five."""
ANSWER_S = 15.0
"""For so long the one in charge may think about it."""


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
        self._asker: Holder | None = None
        self._asked_mono_s = 0.0

    @property
    def holder(self) -> Holder | None:
        return self._holder

    @property
    def is_silent(self) -> bool:
        """Nothing is heard of who is in charge: it can be taken."""
        return self._holder is not None and self._now_mono_s() - self._seen_mono_s >= SILENT_S

    def doc_for(self, session_key: str) -> LeaseDoc:
        holder, asker = self._holder, self._asker
        mine = holder is not None and holder.session_key == session_key
        return LeaseDoc(
            holder=None if holder is None else holder.name,
            mine=mine,
            silent=self.is_silent,
            asks=asker.name if mine and asker is not None else None,
            waits=asker is not None and asker.session_key == session_key,
        )

    def press(self, session_key: str, name: str) -> Holder | None:
        """Takes charge where nobody has to be asked, else asks; the one who was in charge and has lost it.

        Raises ConflictError while somebody else is asking.
        """
        before = self._holder
        if before is not None and before.session_key == session_key:
            return None
        if before is None or self.is_silent:
            self._take(Holder(session_key, name))
            return before
        if self._asker is not None and self._asker.session_key != session_key:
            raise ConflictError(f"{self._asker.name} is asking for control already.", advice="Wait for the answer.")
        self._asker, self._asked_mono_s = Holder(session_key, name), self._now_mono_s()
        return None

    def hand_over(self, session_key: str) -> Holder:
        """To whom has asked. Raises NotInChargeError, ConflictError."""
        asker = self._asked_of(session_key)
        self._take(asker)
        return asker

    def keep(self, session_key: str) -> Holder:
        """Whom to tell so. Raises NotInChargeError, ConflictError."""
        asker = self._asked_of(session_key)
        self._asker = None
        return asker

    def look(self, heard: Collection[str]) -> Holder | None:
        """To be told every second whose pages were heard; who has asked and got no answer, once."""
        now_mono_s, asker = self._now_mono_s(), self._asker
        if self._holder is not None and self._holder.session_key in heard:
            self._seen_mono_s = now_mono_s
        if asker is None or now_mono_s - self._asked_mono_s < ANSWER_S:
            return None
        self._asker = None
        return asker

    def _asked_of(self, session_key: str) -> Holder:
        self.operator(session_key)
        if self._asker is None:
            raise ConflictError("Nobody asks for control any more.")
        return self._asker

    def _take(self, holder: Holder) -> None:
        self._holder, self._asker = holder, None
        self._seen_mono_s = self._now_mono_s()
        self._next_token()

    def release(self, session_key: str) -> bool:
        """Lets go, if this session was in charge, and asks no more, if it did."""
        if self._asker is not None and self._asker.session_key == session_key:
            self._asker = None
            return True
        if self._holder is None or self._holder.session_key != session_key:
            return False
        self._holder = self._asker = None
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
