"""``hedgehop map`` where nothing says where the sensor was, or nothing was seen: it says which topic is missing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mapping.sensor_frames import RadarFrame
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Published, Topic
from tests.server.cli_runs import hedgehop
from tests.telemetry import perception_flights as flights
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S


def frames(*, states: dict[str, Any] | None, clouds: bool = False) -> Iterator[tuple[float, Topic, Published]]:
    """Two seconds; ``states``: what the vehicle's states leave out, None: there are none."""
    for k in range(20):
        t_s = 1.0 + k / 10
        if states is not None:
            yield t_s, Topic.VEHICLE, replace(flights.state_at(t_s, T0_MONO_S, T0_UTC_S), **states)
        if clouds:
            yield t_s, Topic.CLOUD_FRAME, flights.cloud_frame(t_s, k, T0_MONO_S, T0_UTC_S, count=10)
        else:
            yield t_s, Topic.RADAR_FRAME, flights.radar_frame(t_s, k, T0_MONO_S, T0_UTC_S)


def recorded(path: Path, messages: Iterator[tuple[float, Topic, Published]]) -> Path:
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S)
    for t_s, topic, message in messages:
        writer.write(topic, message, T0_UTC_S + t_s)
    writer.close()
    return path


@pytest.mark.parametrize(
    ("sensor", "messages", "words"),
    [
        ("radar", frames(states=None), ("where the vehicle was", "(sensor/radar)", "no vehicle/state")),
        ("vision", frames(states={}, clouds=True), ("where the camera was", "(sensor/cloud)", "no sensor/slam")),
        ("radar", frames(states={"lat_deg": None}), ("vehicle/state never tells the position.",)),
        (
            "radar",
            frames(states={"home_lat_deg": None, "attitude_t_mono_s": None}),
            ("vehicle/state never tells the home and attitude.",),
        ),
    ],
)
def test_it_says_which_topic_is_missing(
    tmp_path: Path, sensor: str, messages: Iterator[tuple[float, Topic, Published]], words: tuple[str, ...]
) -> None:
    path, out = recorded(tmp_path / "targets.mcap", messages), tmp_path / "map.ply"
    run = hedgehop("map", path, "--sensor", sensor, "--out", out)
    assert run.code == 2
    assert not out.exists()
    for said in (*words, "Record the sensor together with the vehicle's link"):
        assert said in " ".join(run.err.split())
    assert "Fly first" not in run.err


def test_a_map_in_which_nothing_is_says_what_went_into_it(tmp_path: Path) -> None:
    def empty() -> Iterator[tuple[float, Topic, Published]]:
        for t_s, topic, message in frames(states={}):
            if isinstance(message, RadarFrame):
                message = replace(message, xyz_m=b"", radial_speed_m_s=b"", snr_db=b"")
            yield t_s, topic, message

    path = recorded(tmp_path / "empty.mcap", empty())
    run = hedgehop("map", path, "--sensor", "radar", "--out", tmp_path / "map.ply")
    assert run.code == 1
    assert "frames with 0 points went into it" in " ".join(run.err.split())
    assert "Fly first" not in run.err
