"""A scenario's recording carries the ground that was known: its maps are built again exactly, its review is over it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from server.cli import app
from server.flying import review_task
from server.flying.review import recording_of
from telemetry.errors import RecordingError
from telemetry.perception.map_changes import ChangeTeller
from telemetry.perception.rebuilding.rebuild import OtherMap, rebuild
from telemetry.perception.sensor_kinds import KINDS
from telemetry.recording.carried_ground import carried_ground, packed
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.mcap_files.mend import mend
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.simulation.scenarios.stage import scenes
from telemetry.simulation.scenarios.stage.result import ScenarioRequest
from telemetry.simulation.scenarios.stage.running import flown_of, setup_of
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.topics.deltas import FoldedMap
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import MapDelta, PerceptionSettings, Sensor

SETTINGS = PerceptionSettings(radar_resolution_m=0.5)
"""Not the usual ones: they have to be told."""
SENSORS: tuple[Sensor, ...] = ("radar", "vision")


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Setup, SeenFlight, Path]:
    path = tmp_path_factory.mktemp("recorded") / "wood.mcap"
    wanted = ScenarioRequest(5, record=path)
    setup = setup_of(scenes.wood(5), wanted, "wood", settings=SETTINGS, most_armed_s=25.0)
    return setup, flown_of(setup, wanted), path


@pytest.mark.parametrize("sensor", SENSORS)
def test_the_map_is_built_again_to_the_last_voxel(flown: tuple[Setup, SeenFlight, Path], sensor: Sensor) -> None:
    _, flight, path = flown
    perceiver = flight.perceivers[sensor]
    teller = ChangeTeller(sensor, 0.0)
    own = FoldedMap().folded(teller.changes(perceiver.perception.map, perceiver.where.origin, 0.0)).voxels
    built = rebuild(path, KINDS[sensor])
    assert built.notes == ()
    assert built.resolution_m == perceiver.perception.map.resolution_m
    again = built.folded.voxels
    assert own.explained.any()
    assert not own.explained.all()
    for one, other in ((again.keys, own.keys), (again.probability, own.probability), (again.explained, own.explained)):
        np.testing.assert_array_equal(one, other)


def test_the_cameras_map_of_the_whole_flight_is_built_again_and_was_recorded(
    flown: tuple[Setup, SeenFlight, Path],
) -> None:
    _, flight, path = flown
    perceiver = flight.perceivers["vision"]
    whole = perceiver.perception.flight
    assert whole is not None
    assert whole.part == 1
    assert whole.map.occupied_count > 2 * perceiver.perception.map.occupied_count
    teller = ChangeTeller("vision_flight", 0.0)
    own = FoldedMap().folded(teller.changes(whole.map, perceiver.where.origin, 0.0)).voxels
    again = rebuild(path, KINDS["vision"], other=OtherMap(whole_flight=True)).folded.voxels
    for one, other in ((again.keys, own.keys), (again.probability, own.probability), (again.explained, own.explained)):
        np.testing.assert_array_equal(one, other)
    with open_recording(path) as recording:
        told = [entry.message for entry in recording.entries({Topic.MAP_VISION_FLIGHT})]
        shown = [entry.t_utc_s for entry in recording.entries({Topic.RADAR_LOOK, Topic.CLOUD_LOOK})]
    recorded = FoldedMap().folded(delta for delta in told if isinstance(delta, MapDelta)).voxels
    assert len(recorded.keys) > 0.9 * len(own.keys)
    assert 20 < len(shown) <= 4 * (shown[-1] - shown[0] + 1), "each sensor's newest frame, twice a second"


def test_the_ground_is_the_one_that_was_known(flown: tuple[Setup, SeenFlight, Path]) -> None:
    setup, _, path = flown
    log = read_flight_log(path)
    assert log.faults == ()
    assert log.ground is not None
    np.testing.assert_array_equal(log.ground.elevation_m, setup.ground.elevation_m)
    assert replace(log.ground, elevation_m=setup.ground.elevation_m) == setup.ground


def test_a_recording_that_was_cut_off_and_mended_still_carries_it(
    flown: tuple[Setup, SeenFlight, Path], tmp_path: Path
) -> None:
    setup, _, path = flown
    data, killed = path.read_bytes(), tmp_path / "killed.mcap"
    killed.write_bytes(data[: len(data) * 3 // 4])
    for finished in (False, True):
        with open_recording(killed) as recording:
            assert recording.finished is finished
            ground = carried_ground(recording)
        assert ground is not None
        np.testing.assert_array_equal(ground.elevation_m, setup.ground.elevation_m)
        assert mend(killed) is not finished


def test_a_ground_that_is_damaged_is_said_and_the_flight_still_read(
    flown: tuple[Setup, SeenFlight, Path], tmp_path: Path
) -> None:
    setup, _, path = flown
    data, damaged = path.read_bytes(), tmp_path / "damaged.mcap"
    carried = packed(setup.ground)
    assert data.count(carried) == 1
    damaged.write_bytes(data.replace(carried, carried[:2000] + bytes(len(carried) - 2000)))
    log = read_flight_log(damaged)
    assert log.ground is None
    assert len(log.track) > 10
    assert any("surface model in the recording cannot be read" in fault for fault in log.faults)
    with pytest.raises(RecordingError, match="surface model in the recording cannot be read"):
        rebuild(damaged, KINDS["radar"])


def test_review_is_over_its_own_ground_and_draws_it(flown: tuple[Setup, SeenFlight, Path]) -> None:
    setup, _, path = flown

    def nobody(step: str, share: float | None) -> None:
        """Nobody watches."""

    assert review_task.flown_over(path, report=nobody).places == ()
    doc = recording_of(read_flight_log(path), path)
    reviewed = review_task.review(path, doc, None, None, report=nobody)
    assert reviewed.terrain_id is None
    assert reviewed.scene is not None
    assert reviewed.reference is not None
    ground, drawn = reviewed.scene.ground, reviewed.scene.drawn
    assert ground is not None
    assert drawn is not None
    assert ground.sha256 == setup.ground.sha256
    assert drawn.legend_max_m == pytest.approx(float(np.nanmax(setup.ground.elevation_m)))
    assert reviewed.doc.terrain_name == "the recording's own surface model"
    heights = [height for height in reviewed.doc.series.distance_to_dsm_m if height is not None]
    assert 1.0 < max(heights) < 30.0
    assert not any("another surface model" in note or "no surface model" in note for note in reviewed.doc.notes)


def test_the_command_line_judges_it_over_its_own_ground(flown: tuple[Setup, SeenFlight, Path]) -> None:
    _, _, path = flown
    result = CliRunner().invoke(app, ["review", str(path), "--json"])
    assert not any("no surface model" in note for note in json.loads(result.stdout)["notes"])
