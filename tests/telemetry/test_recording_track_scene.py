"""Tracks as viewers of recordings draw them."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from telemetry.recording.mcap_files.foxglove import HOME_FRAME, Standards, standard_schema
from telemetry.topics.tracks import Track, TracksStatus

TRACK = Track(
    id=7,
    enu_m=(3.0, 40.0, 12.0),
    velocity_enu_m_s=(0.0, -4.0),
    covariance_m2=(0.2, 0.0, 0.2),
    age_s=3.0,
    updates=28,
    moving=True,
    range_m=28.0,
    bearing_deg=4.0,
    closest_m=1.2,
    closest_in_s=4.0,
    dangerous=True,
    lat_deg=45.0,
    lon_deg=10.0,
)


def drawn(*tracks: Track) -> dict[str, Any]:
    (made,) = Standards().of(TracksStatus("running", "", 500.0, 12.25, 500.0, tracks=tracks))
    assert made.schema_name == "foxglove.SceneUpdate"
    return json.loads(made.data)


def test_an_arrow_points_along_the_velocity_and_a_label_says_which_it_is() -> None:
    (entity,) = drawn(TRACK)["entities"]
    assert (entity["id"], entity["frame_id"]) == ("track 7", HOME_FRAME)
    assert entity["timestamp"] == {"sec": 12, "nsec": 250_000_000}
    (arrow,), (label,) = entity["arrows"], entity["texts"]
    turn = arrow["pose"]["orientation"]
    assert 2 * math.atan2(turn["z"], turn["w"]) == pytest.approx(-math.pi / 2)
    assert arrow["pose"]["position"] == {"x": 3.0, "y": 40.0, "z": 12.0}
    assert arrow["shaft_length"] == pytest.approx(8.0)
    assert label["text"] == "7: 4.0 m/s"
    assert 1.0 < entity["lifetime"]["sec"] + entity["lifetime"]["nsec"] / 1e9 < 2.0


def test_without_tracks_nothing_is_drawn() -> None:
    assert drawn() == {"deletions": [], "entities": []}


def test_every_field_stands_in_the_schema() -> None:
    def check(value: Any, schema: dict[str, Any]) -> int:
        if isinstance(value, dict):
            assert value.keys() <= schema["properties"].keys()
            return sum(check(inner, schema["properties"][name]) for name, inner in value.items())
        if isinstance(value, list):
            return sum(check(inner, schema["items"]) for inner in value)
        kinds = {bool: "boolean", str: "string", int: "integer", float: "number"}
        assert schema["type"] in (kinds[type(value)], "number")
        return 1

    schema = json.loads(standard_schema("foxglove.SceneUpdate"))
    assert schema["title"] == "foxglove.SceneUpdate"
    assert check(drawn(TRACK), schema) > 30
