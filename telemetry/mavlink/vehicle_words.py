"""What the vehicle says in its own words (STATUSTEXT) while something is asked of it."""

from __future__ import annotations

from telemetry.mavlink.actions import Message
from telemetry.mavlink.texts import clean

WARNING = 4
"""MAV_SEVERITY; what is less urgent is no reason for a refusal."""
MOST = 5


class VehicleWords:
    """The warnings heard since ``clear``; texts in several parts are put together."""

    def __init__(self) -> None:
        self._parts: dict[int, dict[int, str]] = {}
        self._texts: list[str] = []

    def clear(self) -> None:
        self._parts.clear()
        self._texts.clear()

    def on_message(self, message: Message) -> None:
        if message.get_type() != "STATUSTEXT" or message.severity > WARNING:
            return
        if message.id == 0:
            self._add(message.text)
        else:
            self._parts.setdefault(message.id, {})[message.chunk_seq] = message.text

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
