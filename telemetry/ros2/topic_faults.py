"""What is wrong with topics at present, in words: said when it begins and when it is over, never again and again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

EVERY_S = 1.1
"""Between two words for the pilot: the ground station takes one a second."""
MOST_WAITING = 20
OVER_S = 10.0
"""What is told by each message that has it is over once none has had it for so long."""
MOST_REASONS = 5
"""Of one subject, at a time; further ones are one."""


@dataclass(frozen=True, slots=True)
class Word:
    warning: bool
    text: str


@dataclass(slots=True)
class _Held:
    what: str
    seen_s: float


class Words:
    """By subject, and where it has several by reason; one thread."""

    def __init__(self, *, tell: Callable[[str], None], now: Callable[[], float] = time.monotonic) -> None:
        """``tell`` hears each at once; ``due`` hands them on for the pilot, at the pace that he can be told."""
        self._tell, self._now = tell, now
        self._held: dict[tuple[str, str], _Held] = {}
        self._waiting: deque[Word] = deque(maxlen=MOST_WAITING)
        self._said_s = -EVERY_S

    @property
    def held(self) -> list[str]:
        """What is wrong now."""
        return [held.what for held in self._held.values()]

    def begins(self, subject: str, what: str, advice: str = "") -> None:
        """Until it ``ends``. Nothing new where the subject is wrong already, whatever the words."""
        if (subject, "") not in self._held:
            self._held[subject, ""] = _Held(what, self._now())
            self._say(True, what, advice)

    def recurs(self, subject: str, what: str, advice: str = "") -> None:
        """Each of its reasons is said, and over when it ``ends`` or has not come again for ``OVER_S``."""
        held = self._held.get((subject, what))
        reasons = sum(each == subject and reason != "" for each, reason in self._held)
        if held is None and reasons >= MOST_REASONS:
            what, advice = f"{subject}: for further reasons, too.", ""
            held = self._held.get((subject, what))
        if held is not None:
            held.seen_s = self._now()
            return
        self._held[subject, what] = _Held(what, self._now())
        self._say(True, what, advice)

    def ends(self, subject: str, what: str) -> None:
        """With all its reasons. Nothing where it was not wrong."""
        keys = [key for key in self._held if key[0] == subject]
        for key in keys:
            del self._held[key]
        if keys:
            self._say(False, what)

    def note(self, what: str) -> None:
        self._say(False, what)

    def due(self) -> Iterator[Word]:
        for key, held in list(self._held.items()):
            if key[1] and self._now() - held.seen_s >= OVER_S:
                del self._held[key]
                self._say(False, f"No more: {held.what}")
        if self._waiting and self._now() - self._said_s >= EVERY_S:
            self._said_s = self._now()
            yield self._waiting.popleft()

    def _say(self, warning: bool, what: str, advice: str = "") -> None:
        self._tell(f"{what} {advice}".rstrip())
        self._waiting.append(Word(warning, what))
