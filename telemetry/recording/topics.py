"""Which topics a recording holds and how: everything that is published, unless said otherwise here."""

from __future__ import annotations

from telemetry.messages import MESSAGE_TYPES, Topic

NOT_RECORDED = frozenset({Topic.RECORDER, Topic.REPLAY})
"""What recorder and replay say of themselves."""

EVENTS = frozenset({Topic.TEXT, Topic.RAW, Topic.COMMAND, Topic.SERVER})
"""Topics of which each message counts; of all others the latest is the state of things."""

RECORDED = frozenset(MESSAGE_TYPES) - NOT_RECORDED
LATEST = RECORDED - EVENTS
"""Written again at the beginning of every recording, and shown at once where a replay is moved to."""

RAW_ENCODING = "mavlink"
"""Of the channels that hold bare frames; those of all other topics are JSON."""


def raw_channel_topic(sent: bool) -> str:
    """Raw frames have a channel per direction (and link)."""
    return f"{Topic.RAW.value}/{'sent' if sent else 'received'}"
