"""STATUSTEXT messages: put together in the order in which they were sent, and heard while something is asked."""

from __future__ import annotations

from telemetry.mavlink.actions import Message
from telemetry.mavlink.texts.event_reader import VehicleEvent
from telemetry.mavlink.texts.event_words import words_of

PART_BYTES = 50
PATIENCE_S = 1.0
"""After this a text is given out with what came of it."""
WARNING = 4
"""MAV_SEVERITY; what is less urgent is no reason for a refusal."""
MOST = 5
PREFLIGHT = "Preflight Fail: "
"""How PX4's texts begin what its events say without."""


class Texts:
    def __init__(self) -> None:
        self._parts: dict[int, dict[int, str]] = {}
        self._severity: dict[int, int] = {}
        self._since_s: dict[int, float] = {}

    def on_message(self, message: Message, now_s: float) -> list[tuple[int, str]]:
        """(severity, text) of what is complete now."""
        if message.get_type() != "STATUSTEXT":
            return []
        if message.id == 0:
            return [(message.severity, clean(message.text))]
        parts = self._parts.setdefault(message.id, {})
        parts[message.chunk_seq] = message.text
        self._severity[message.id] = message.severity
        self._since_s.setdefault(message.id, now_s)
        last = max((seq for seq, text in parts.items() if len(text) < PART_BYTES), default=None)
        return [self._whole(message.id)] if last is not None and len(parts) == last + 1 else []

    def on_tick(self, now_s: float) -> list[tuple[int, str]]:
        late = [number for number, since_s in self._since_s.items() if now_s - since_s > PATIENCE_S]
        return [self._whole(number) for number in late]

    def _whole(self, number: int) -> tuple[int, str]:
        del self._since_s[number]
        parts = self._parts.pop(number)
        return self._severity.pop(number), clean("".join(text for _, text in sorted(parts.items())))


def clean(text: str) -> str:
    """Without what vehicles add to it: PX4 ends with a tab what it says by an event, too."""
    return text.strip("\0").strip()


def said_key(text: str) -> str:
    """The same for what PX4 says twice, by an event and by a text."""
    return clean(text).removeprefix(PREFLIGHT).rstrip(".").casefold()


class VehicleWords:
    """The warnings heard since ``clear``, of texts and events; texts in several parts are put together."""

    def __init__(self) -> None:
        self._parts: dict[int, dict[int, str]] = {}
        self._texts: list[str] = []

    def clear(self) -> None:
        self._parts.clear()
        self._texts.clear()

    def on_message(self, message: Message) -> None:
        if message.get_type() == "EVENT":
            self._on_event(VehicleEvent.of(message))
            return
        if message.get_type() != "STATUSTEXT" or message.severity > WARNING:
            return
        if message.id == 0:
            self._add(message.text)
        else:
            self._parts.setdefault(message.id, {})[message.chunk_seq] = message.text

    def _on_event(self, event: VehicleEvent) -> None:
        words = words_of(event) if event.severity <= WARNING else None
        if words is not None and said_key(words) not in map(said_key, self.texts):
            self._add(words)

    def _add(self, text: str) -> None:
        text = clean(text)
        if text and text not in self._texts:
            self._texts = [*self._texts, text][-MOST:]

    @property
    def texts(self) -> tuple[str, ...]:
        joined = (clean("".join(text for _, text in sorted(parts.items()))) for parts in self._parts.values())
        return (*self._texts, *(text for text in joined if text))

    def sentence(self) -> str:
        """``It says: "...".`` or nothing."""
        quoted = " ".join(f'"{text}"' for text in self.texts)
        return f" It says: {quoted}." if quoted else ""
