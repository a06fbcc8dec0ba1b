"""The tracks node among those that take a sensor's frames: the radar's frames, into a tracker."""

from __future__ import annotations

from dataclasses import replace

from mapping.tracker import Tracker
from telemetry.messages import Topic
from telemetry.perception.kinds import RADAR, SensorKind
from telemetry.tracking.movers import Movers

NAME = "tracks"


def tracks_kind(followed: Tracker) -> SensorKind:
    """With a tracker of its own."""

    def make(settings, *, alert_prefix: str = "") -> Movers:
        return Movers(settings, followed, alert_prefix=alert_prefix)

    return replace(RADAR, status=Topic.TRACKS, make=make)
