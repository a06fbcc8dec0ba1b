"""The foliage scenario: sparse foliage is cleared and obstacles are not, the way through opens, all in real time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.uwb.clearing import Cleared
from mapping.uwb.uwb_params import UwbParams
from planning.errors import ParameterError
from planning.ground.traversable import cleared_ground, traversable_ground
from planning.terrain.geotiff import read_dsm
from server.cli.plots.chart_plots import write_charts
from telemetry.sensors.uwb_log import read_uwb_log
from telemetry.simulation.scenarios.foliage import foliage
from telemetry.simulation.scenarios.foliage.foliage_drive import (
    KEEP_M,
    SCAN_S,
    SPEED_M_S,
    drive,
    lawn_drive,
    things_on_lawn,
)
from telemetry.simulation.scenarios.foliage.foliage_figures import (
    PAPERS_RULE,
    Drive,
    cleared_by,
    driven,
    labels,
    rates,
    seconds_per_scan,
)
from telemetry.simulation.scenarios.foliage.foliage_roc import Roc, curve, echoes_m2, roc_chart
from telemetry.simulation.scenarios.foliage.foliage_rural import connected, route
from telemetry.simulation.scenarios.foliage.foliage_trials import TRIAL_1, TRIAL_2, trial_site
from telemetry.simulation.scenarios.stage.result import ScenarioRequest, ScenarioResult, measured
from telemetry.simulation.scenarios.stage.scenario_curves import MOST_POINTS
from telemetry.simulation.simulator.sensors.uwb import UwbModel

# On one worker: two would each drive for themselves.
pytestmark = pytest.mark.xdist_group("foliage")


@pytest.fixture(scope="module")
def sparse() -> Drive:
    return driven(trial_site(1, "c"), lawn_drive(), 3)


@pytest.fixture(scope="module")
def cleared(sparse: Drive) -> Cleared:
    return cleared_by(sparse)[0]


def test_sparse_foliage_is_cleared_and_obstacles_stay(sparse: Drive, cleared: Cleared) -> None:
    found = rates(sparse, cleared)
    assert found.foliage.cells > 100
    assert found.obstacles.cells > 500
    assert found.foliage.rate >= 0.90
    assert found.obstacles.rate <= 0.10
    assert found.placed["Small reflector"].rate <= 0.10


def test_our_rule_clears_what_the_papers_leaves_before_obstacles(sparse: Drive, cleared: Cleared) -> None:
    ours, theirs = rates(sparse, cleared), rates(sparse, cleared_by(sparse, PAPERS_RULE)[0])
    assert ours.foliage.cleared > theirs.foliage.cleared
    assert ours.on_clear_spots.cleared >= theirs.on_clear_spots.cleared
    assert ours.obstacles.rate < theirs.obstacles.rate + 0.02


def test_only_cells_seen_for_more_than_2_s_count(sparse: Drive, cleared: Cleared) -> None:
    assert (cleared.time_in_view_s[cleared.seen] > 2.0).all()
    found = rates(sparse, cleared)
    assert found.foliage.cells + found.obstacles.cells == cleared.seen.sum()


def test_obstacles_are_what_would_be_untraversable_without_foliage(sparse: Drive) -> None:
    obstacle, foliage = labels(sparse)
    assert ((obstacle | foliage) == sparse.map.untraversable).all()
    assert not (obstacle & foliage).any()
    bare = driven(trial_site(1, "b"), [], 3)
    assert (obstacle <= bare.map.untraversable).all()
    assert not labels(bare)[1].any()


def test_the_drive_leaves_branches_and_obstacles_alone() -> None:
    at_m = np.array([[pose.x_m, pose.y_m] for pose in lawn_drive()])
    for thing in things_on_lawn():
        assert np.hypot(*(at_m - thing).T).min() >= KEEP_M - 0.1


def test_caution_clears_less_of_both(sparse: Drive) -> None:
    bold = rates(sparse, cleared_by(sparse, UwbParams(most_occupied=0.7, free_before=0.1, free_behind=0.2))[0])
    careful = rates(sparse, cleared_by(sparse, UwbParams(most_occupied=0.9, free_before=0.3, free_behind=0.4))[0])
    assert bold.foliage.rate > careful.foliage.rate
    assert bold.obstacles.rate > careful.obstacles.rate


def test_a_scan_takes_a_small_part_of_its_tenth_of_a_second(sparse: Drive) -> None:
    assert 0.0 < seconds_per_scan(sparse) < 0.05


def test_a_way_that_the_lidar_map_blocks_opens() -> None:
    found = route(0)
    assert not found.before
    assert found.after
    assert found.piles_kept > 0.9


def test_connected_asks_for_the_vehicles_width() -> None:
    passable = np.ones((60, 60), np.bool_)
    passable[30, :] = False
    passable[30, 20:26] = True
    assert connected(passable, (5, 5), (55, 55), 0.3)
    assert not connected(passable, (5, 5), (55, 55), 0.9)
    assert not connected(passable, (30, 5), (55, 55), 0.1)


def test_a_drive_is_even_and_turns_on_the_spot() -> None:
    poses = drive(((0.0, 0.0), (0.0, 5.0), (5.0, 5.0)))
    steps = np.hypot(*np.diff([[pose.x_m, pose.y_m] for pose in poses], axis=0).T)
    assert steps.max() == pytest.approx(SPEED_M_S * SCAN_S, rel=0.05)
    assert np.diff([pose.t_s for pose in poses]) == pytest.approx(SCAN_S)
    assert poses[-1].heading_rad == pytest.approx(np.pi / 2)
    assert (steps == 0).sum() >= 30


def test_a_recorded_log_clears_the_same_through_files_and_degrees(
    sparse: Drive, cleared: Cleared, tmp_path: Path
) -> None:
    foliage.record(sparse, tmp_path / "drive.npz")
    ground = traversable_ground(read_dsm(tmp_path / "drive.tif"), 0.1)
    found = cleared_ground(ground, read_uwb_log(tmp_path / "drive.npz"))
    blocked = sparse.map.untraversable
    assert (ground.map.untraversable == blocked).mean() > 0.9999
    assert (found.cleared == cleared.cleared)[blocked].mean() > 0.97


def test_the_whole_scenario_prints_all_that_the_paper_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foliage, "lawn_drive", lambda: lawn_drive()[:260])
    monkeypatch.setattr(foliage, "SWEEP_P_O", (0.8,))
    monkeypatch.setattr(foliage, "TRIAL_1", {letter: TRIAL_1[letter] for letter in "ac"})
    monkeypatch.setattr(foliage, "TRIAL_2", {letter: TRIAL_2[letter] for letter in "f"})
    result = foliage.run(ScenarioRequest(1))
    text = "\n".join(result.lines())
    for words in ("Table II", "P(z|occ) of Stone: 0.461  (paper: 0.4606)", "5 layers:",
                  "trial 2 f, 4 layers", "paper: TNR 65.7 %",
                  "the paper's rule here: TNR", "our rule: TNR", "TNR of those alone", "Stone ",

                  "P_O 0.8, P_C2 0.3: TNR", "route from A to B after clearing", "at 10 Hz"):  # fmt: skip
        assert words in text
    assert json.loads(json.dumps(result.as_json()))["name"] == "foliage"


def test_a_world_of_ones_own_and_a_recording_of_another_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="brings its own sites"):
        foliage.run(ScenarioRequest(0, world=tmp_path / "own.json"))
    with pytest.raises(ParameterError, match=r"ends with \.npz"):
        foliage.run(ScenarioRequest(0, record=tmp_path / "drive.mcap"))


def test_the_roc_goes_through_the_rates_of_both_rules(sparse: Drive, cleared: Cleared) -> None:
    ours = curve(sparse, "our rule", UwbParams())
    assert ours.usual[0] == pytest.approx(rates(sparse, cleared).foliage.rate)
    for values in (ours.tnr, ours.fnr):
        assert (values[0], values[-1]) == (0.0, 1.0)
        assert np.all(np.diff(values) >= 0.0)
    assert ours.usual[1] - 0.03 <= ours.fnr[np.searchsorted(ours.tnr, ours.usual[0])] <= ours.usual[1]
    paper = curve(sparse, "the paper's rule", PAPERS_RULE)
    assert paper.usual[0] < ours.usual[0]


def test_thick_branches_echo_more_than_what_they_hide() -> None:
    sparse, three, four = (echoes_m2(layers, 1.2) for layers in (1, 3, 4))
    assert sparse["branches"] < 0.01 < sparse["Stone"] < sparse["3 bricks"]
    assert three["2 bricks"] < three["branches"]
    assert four["branches"] > 5 * four["3 bricks"] > 5 * four["2 bricks"] > 5 * four["Stone"]
    assert four["2 bricks"] < UwbModel().least_m2, "at 10 m it answers nothing at all"


def test_the_roc_is_drawn_beside_the_papers_point(sparse: Drive, tmp_path: Path) -> None:
    ours = curve(sparse, "our rule", UwbParams())
    charts = tuple(roc_chart(roc) for roc in (Roc("1 c", (0.9, 0.1), (ours, ours)), Roc("2 f", (0.6, 0.1), (ours,))))
    printed = [one for one in charts[1].series if one.printed]
    assert [(one.x, one.y) for one in printed] == [((10.0,), (60.0,))]
    line = next(one for one in charts[1].series if one.drawn == "line")
    assert (line.x[0], line.y[0], line.x[-1], line.y[-1]) == (0.0, 0.0, 100.0, 100.0)
    assert len(line.x) <= MOST_POINTS + 1
    result = ScenarioResult("foliage", 3, (measured("ROC", (), charts=charts),))
    (path,) = write_charts(tmp_path / "plots", result)
    assert path.name == "roc.png"
    with Image.open(path) as image:
        assert image.size[0] > 1000
        assert len(set(image.convert("L").get_flattened_data())) > 20
