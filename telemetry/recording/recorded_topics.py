"""Which topics a recording holds and how: everything that is published, unless said otherwise here."""

from __future__ import annotations

from telemetry.topics.messages import MESSAGE_TYPES, Topic

MAPS = frozenset({Topic.MAP_RADAR, Topic.MAP_VISION, Topic.MAP_VISION_FLIGHT, Topic.MAP_RANGES})
"""Told in steps that build on each other: a replay adds them up."""

FRAMES = frozenset({Topic.RADAR_FRAME, Topic.CLOUD_FRAME, Topic.SLAM_POSE, Topic.RANGE_FRAME, Topic.UWB_SCAN})
"""What sensors sent: from these maps are built again; a replay does not show them."""

BULKY = MAPS | {Topic.CLOUD_FRAME, Topic.CLOUD_LOOK}
"""Of what little may wait for the disk: the rest of a flight must not suffer from it."""

NOT_REPLAYED = FRAMES | {Topic.RAW, Topic.SERVER, Topic.TRUTH}
"""Frames are for other programs, a replay is no sign of life of a server, truth is for simulated sensors."""

NOT_RECORDED = frozenset(
    {
        Topic.RECORDER,
        Topic.REPLAY,
        Topic.STATIONS_OWN,
        Topic.STATIONS,
        Topic.STATIONS_OFFERED,
        Topic.STATIONS_RECORDINGS,
    }
)
"""What recorder and replay say of themselves; vehicles of other stations are recorded there."""

EVENTS = frozenset({Topic.TEXT, Topic.RAW, Topic.COMMAND, Topic.SERVER, Topic.ALERT}) | MAPS | FRAMES
"""Topics of which each message counts; of all others the latest is the state of things."""

RECORDED = frozenset(MESSAGE_TYPES) - NOT_RECORDED
LATEST = RECORDED - EVENTS
"""Written again at the beginning of every recording, and shown at once where a replay is moved to."""

RAW_ENCODING = "mavlink"
"""Of the channels that hold bare frames; those of all other topics are JSON."""


def raw_channel_topic(sent: bool, spare: bool = False) -> str:
    """Raw frames have a channel per direction (and link); those of ways that were not in use have their own."""
    return f"{Topic.RAW.value}/{'sent' if sent else 'received'}{'_spare' if spare else ''}"
