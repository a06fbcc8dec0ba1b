"""Review of a real autopilot's logs: the figures that others have worked out, by way of the log reader."""

from __future__ import annotations

from pathlib import Path

import pytest

from planning.formats.detect import read_mission
from planning.terrain.geotiff import read_dsm
from server.flying.review import recording_of, review
from server.schemas.review_docs import ReviewDoc
from telemetry.recording.flight_log import read_flight_log

FIGURES = {
    ("auto", False): (0.08, 0.02, 0.05, 0.07, 0.01, 0.03, -0.07, 0.07, 4.93, 4.92, 5.63),
    ("auto", True): (0.12, 0.03, 0.07, 0.16, 0.07, 0.13, -0.05, 0.16, 4.99, 4.99, 5.71),
    ("guided", False): (0.16, 0.02, 0.03, 0.23, 0.09, 0.19, -0.09, 0.23, 4.97, 4.97, 4.99),
    ("guided", True): (0.17, 0.03, 0.05, 0.27, 0.12, 0.24, -0.06, 0.27, 5.03, 5.03, 5.05),
}


def reviewed(shared_data: Path, name: str, *, truth: bool = False) -> ReviewDoc:
    folder = shared_data / "logs" / "arducopter"
    path, plan = folder / f"{name}.tlog", folder / "mission.waypoints"
    mission = read_mission(plan.name, plan.read_bytes()) if name == "guided" else None
    log = read_flight_log(path)
    dsm = read_dsm(shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif")
    return review(log, recording_of(log, path), dsm=dsm, mission=mission, truth=truth)


@pytest.mark.parametrize(("name", "truth"), FIGURES)
def test_the_known_figures(shared_data: Path, name: str, truth: bool) -> None:
    found = reviewed(shared_data, name, truth=truth).figures
    assert found is not None
    assert (
        found.cross_track_max_m,
        found.cross_track_mean_m,
        found.cross_track_p95_m,
        found.height_error_max_m,
        found.height_error_mean_m,
        found.height_error_p95_m,
        found.height_error_lowest_m,
        found.height_error_highest_m,
        found.min_vertical_m,
        found.min_distance_m,
        found.min_distance_way_home_m,
    ) == pytest.approx(FIGURES[name, truth], abs=0.05)


def test_the_whole_flight(shared_data: Path) -> None:
    doc = reviewed(shared_data, "auto")
    assert doc.figures is not None
    assert doc.figures.completed
    assert doc.figures.duration_s == pytest.approx(221.6, abs=0.1)
    assert doc.figures.predicted_s == pytest.approx(222, rel=0.1)
    assert doc.figures.positions == 2216
    assert doc.duration_s == pytest.approx(394, abs=1)


def test_a_flight_that_a_failsafe_broke_off(shared_data: Path) -> None:
    doc = reviewed(shared_data, "gcs_failsafe")
    assert doc.figures is not None
    assert not doc.figures.completed
    assert doc.figures.cross_track_max_m == pytest.approx(0.06, abs=0.05)


def test_a_log_on_the_ground_has_no_figures(shared_data: Path) -> None:
    doc = reviewed(shared_data, "rejects")
    assert doc.figures is None
    assert "The flight never came to the mission's line: there are no figures." in doc.notes
