"""Which messages of a browser reach viser: cameras, clicks and drags, each exactly as viser declares it."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter

import msgspec
from viser import _messages

ALLOWED = (
    _messages.ViewerCameraMessage,
    _messages.ScenePointerMessage,
    _messages.SceneNodeClickMessage,
    _messages.SceneNodeDragMessage,
    _messages.TransformControlsUpdateMessage,
    _messages.TransformControlsDragStartMessage,
    _messages.TransformControlsDragEndMessage,
)
OF_OBSERVERS = frozenset({_messages.ViewerCameraMessage.__name__})
"""Clicks and drags become edits."""
MESSAGE_LIMIT_BYTES = 16 * 1024

_DECODERS = {message.__name__: msgspec.msgpack.Decoder(message) for message in ALLOWED}


class _Tagged(msgspec.Struct):
    type: str


_TYPE = msgspec.msgpack.Decoder(_Tagged)


class MessageFilter:
    """One per connection; counts what it drops, by type."""

    def __init__(self, *, may_change: bool = True) -> None:
        self._may_change = may_change
        self.dropped: Counter[str] = Counter()

    def lets_through(self, raw: bytes | None) -> bool:
        """Whether the message is on the list, complete, well typed and finite."""
        if raw is None or len(raw) > MESSAGE_LIMIT_BYTES:
            return self._drop("not viser's")
        try:
            kind = _TYPE.decode(raw).type
            if not self._may_change and kind in _DECODERS and kind not in OF_OBSERVERS:
                return False  # a hand that slips, and nothing to warn of
            decoder = _DECODERS.get(kind)
            if decoder is None:
                return self._drop(kind[:40])
            return _is_finite(dataclasses.asdict(decoder.decode(raw))) or self._drop(f"{kind} not finite")
        except (msgspec.MsgspecError, RecursionError, ValueError):
            return self._drop("malformed")

    def _drop(self, kind: str) -> bool:
        # Invented names must not make the counter grow for ever.
        self.dropped[kind if kind in self.dropped or len(self.dropped) < 50 else "others"] += 1
        return False


def _is_finite(value: object) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, dict):
        return all(_is_finite(part) for part in value.values())
    if isinstance(value, (list, tuple)):
        return all(_is_finite(part) for part in value)
    return True
