"""What is wrong with topics at present, in words: said when it begins and when it is over, never again and again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

EVERY_S = 1.1
"""Between two words for the pilot: the ground station takes one a second."""
MOST_WAITING = 20


@dataclass(frozen=True, slots=True)
class Word:
    warning: bool
    text: str


class Words:
    """By subject; one thread."""

    def __init__(self, *, tell: Callable[[str], None], now: Callable[[], float] = time.monotonic) -> None:
        """``tell`` hears each at once; ``due`` hands them on for the pilot, at the pace that he can be told."""
        self._tell, self._now = tell, now
        self._held: dict[str, str] = {}
        self._waiting: deque[Word] = deque(maxlen=MOST_WAITING)
        self._said_s = -EVERY_S

    @property
    def held(self) -> list[str]:
        """What is wrong now."""
        return list(self._held.values())

    def begins(self, subject: str, what: str, advice: str = "") -> None:
        """Nothing new where the subject is wrong already, whatever the words."""
        if subject not in self._held:
            self._held[subject] = what
            self._say(True, what, advice)

    def ends(self, subject: str, what: str) -> None:
        """Nothing where it was not wrong."""
        if self._held.pop(subject, None) is not None:
            self._say(False, what)

    def note(self, what: str) -> None:
        self._say(False, what)

    def due(self) -> Iterator[Word]:
        if self._waiting and self._now() - self._said_s >= EVERY_S:
            self._said_s = self._now()
            yield self._waiting.popleft()

    def _say(self, warning: bool, what: str, advice: str = "") -> None:
        self._tell(f"{what} {advice}".rstrip())
        self._waiting.append(Word(warning, what))
