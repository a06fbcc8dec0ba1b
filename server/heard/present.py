"""The present values of flying: what every page is told, and what a page that opens later must see at once."""

from __future__ import annotations

import time
from collections import deque

from server.door.page import key_of
from server.schemas import (
    AlertMessage,
    Pages,
    PerceptionMessage,
    ReplayMessage,
    ServerMessage,
    TextMessage,
    TracksMessage,
    TrafficMessage,
    VehicleMessage,
)

TEXTS_KEPT = 50


class Present:
    """Publishes and keeps: the latest of each kind, and the vehicles' last words in their order."""

    def __init__(self, hub: Pages) -> None:
        self._hub = hub
        self._latest: dict[object, ServerMessage] = {}
        self._texts: deque[TextMessage] = deque(maxlen=TEXTS_KEPT)

    def publish(self, message: ServerMessage) -> None:
        if isinstance(message, TextMessage):
            self._texts.append(message)
        elif not isinstance(message, AlertMessage):
            # Alerts are latched in the obstacles message, which a page that opens later gets.
            self._latest[key_of(message)] = message
        self._hub.publish(message)

    def forget_replay(self) -> None:
        """Another recording, or none: what the last one said is over."""
        kept = [text for text in self._texts if text.source == "live"]
        self._texts.clear()
        self._texts.extend(kept)
        self._latest = {key: message for key, message in self._latest.items() if not _is_replayed(message)}

    def messages(self) -> list[ServerMessage]:
        """For a page that has just opened; ages count from now."""
        return [*(_at_present(message) for message in self._latest.values()), *self._texts]


def _at_present(message: ServerMessage) -> ServerMessage:
    aged = (VehicleMessage, PerceptionMessage, TracksMessage, TrafficMessage)
    live = isinstance(message, aged) and message.source == "live"
    if live or isinstance(message, ReplayMessage):
        return message.model_copy(update={"now_mono_s": time.monotonic()})
    return message


def _is_replayed(message: ServerMessage) -> bool:
    return getattr(message, "source", "live") == "replay"
