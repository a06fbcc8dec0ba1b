"""Review says how objects were followed, as it was set in that flight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from server.flying.review import recording_of, review
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.trigger import AFTER_DISARM_S
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import TrackerSettings, VelocitySettings, unusual, with_figures
from tests.server.cli_runs import hedgehop
from tests.telemetry.test_recording_recorder import Station

POLAR = PerceptionSettings(
    tracker=TrackerSettings(coordinates="polar", gate=9.0, birth_updates=4),
    velocities=VelocitySettings(nearest_only=True, choice="edge"),
)
POLAR_WORDS = (
    "tracker.coordinates=polar, tracker.gate=9, tracker.birth_updates=4, velocities.nearest_only=true, "
    "velocities.choice=edge"
)


def recorded(folder: Path, *, before: PerceptionSettings, in_flight: PerceptionSettings | None = None) -> Path:
    """Set long before the flight, and once more on its way."""
    station = Station(folder)
    station.recorder.on_message(Topic.PERCEPTION_SETTINGS, before)
    station.fly(30.0, armed=False)
    station.fly(5.0, armed=True)
    if in_flight is not None:
        station.recorder.on_message(Topic.PERCEPTION_SETTINGS, in_flight)
    station.fly(5.0, armed=True)
    station.fly(AFTER_DISARM_S + 1.0, armed=False)
    (path,) = folder.glob("*.mcap")
    return path


def notes_of(path: Path) -> list[str]:
    log = read_flight_log(path)
    return [note for note in review(log, recording_of(log, path)).notes if "followed with" in note]


def test_the_settings_of_a_flight_are_in_its_recording_and_in_review(tmp_path: Path) -> None:
    path = recorded(tmp_path, before=POLAR)
    assert [settings for _, settings in read_flight_log(path).settings] == [POLAR]
    assert notes_of(path) == [f"Objects were followed with {POLAR_WORDS}."]


def test_the_command_line_says_them(tmp_path: Path) -> None:
    path = recorded(tmp_path, before=POLAR)
    assert POLAR_WORDS in hedgehop("review", path).err
    assert any(POLAR_WORDS in note for note in hedgehop("review", path, "--json").json["notes"])


def test_what_was_changed_on_the_way_is_told_in_order(tmp_path: Path) -> None:
    path = recorded(tmp_path, before=PerceptionSettings(), in_flight=POLAR)
    assert notes_of(path) == [f"Objects were followed with the usual figures, then {POLAR_WORDS}."]


def test_of_the_usual_figures_nothing_is_said(tmp_path: Path) -> None:
    assert notes_of(recorded(tmp_path, before=PerceptionSettings(radar_depth_m=20.0))) == []


@pytest.mark.parametrize("part", [POLAR.tracker, POLAR.velocities])
def test_what_is_told_can_be_set_again(part: TrackerSettings | VelocitySettings) -> None:
    whole = replace(PerceptionSettings(), **{"tracker" if part is POLAR.tracker else "velocities": part})
    figures = dict(one.partition(".")[2].split("=") for one in unusual(whole.tracker, whole.velocities))
    assert with_figures(type(part)(), figures) == part
