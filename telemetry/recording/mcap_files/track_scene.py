"""Tracks as MCAP viewers draw them: an arrow along the velocity and a label for each, in the frame of home."""

from __future__ import annotations

import json
import math
from typing import Any

from telemetry.topics.tracks import Track, TracksStatus

SCHEMA_NAME = "foxglove.SceneUpdate"
_SHOWN_S = 1.5
"""A viewer drops what is not told again."""
_AHEAD_S, _LEAST_M = 2.0, 0.5
"""An arrow is as long as the way of so many seconds."""
_MOVING, _STANDING = {"r": 0.86, "g": 0.2, "b": 0.55, "a": 1.0}, {"r": 0.5, "g": 0.5, "b": 0.55, "a": 0.8}

_NUMBER, _TEXT, _FLAG = {"type": "number"}, {"type": "string"}, {"type": "boolean"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _list(**properties: Any) -> dict[str, Any]:
    return {"type": "array", "items": _object(**properties)}


_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object(
    position=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER), orientation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
)
_ARROWS = _list(
    pose=_POSE, shaft_length=_NUMBER, shaft_diameter=_NUMBER, head_length=_NUMBER, head_diameter=_NUMBER, color=_COLOUR
)
_TEXTS = _list(pose=_POSE, billboard=_FLAG, font_size=_NUMBER, scale_invariant=_FLAG, color=_COLOUR, text=_TEXT)
_ENTITIES = _list(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_TIME,
    frame_locked=_FLAG,
    arrows=_ARROWS,
    texts=_TEXTS,
)


def schema() -> bytes:
    return json.dumps({"title": SCHEMA_NAME, **_object(deletions=_list(id=_TEXT), entities=_ENTITIES)}).encode()


def scene_update(status: TracksStatus, frame_id: str) -> dict[str, Any]:
    """The whole of what is shown: tracks that are gone vanish by themselves."""
    sec, nsec = divmod(round(status.t_utc_s * 1e9), 1_000_000_000)
    head = {
        "timestamp": {"sec": sec, "nsec": nsec},
        "frame_id": frame_id,
        "lifetime": {"sec": int(_SHOWN_S), "nsec": round(_SHOWN_S % 1 * 1e9)},
        "frame_locked": False,
    }
    return {"deletions": [], "entities": [head | _drawn(track) for track in status.tracks]}


def _drawn(track: Track) -> dict[str, Any]:
    colour = _MOVING if track.moving else _STANDING
    speed = math.hypot(*track.velocity_enu_m_s)
    x, y, z = track.enu_m
    half = math.atan2(track.velocity_enu_m_s[1], track.velocity_enu_m_s[0]) / 2
    place = {"x": x, "y": y, "z": z}
    arrow = {
        "pose": {"position": place, "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}},
        "shaft_length": max(_LEAST_M, _AHEAD_S * speed),
        "shaft_diameter": 0.3,
        "head_length": 0.8,
        "head_diameter": 0.9,
        "color": colour,
    }
    label = {
        "pose": {"position": place | {"z": z + 1.5}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}},
        "billboard": True,
        "font_size": 14.0,
        "scale_invariant": True,
        "color": colour,
        "text": f"{track.id}: {speed:.1f} m/s",
    }
    return {"id": f"track {track.id}", "arrows": [arrow], "texts": [label]}
