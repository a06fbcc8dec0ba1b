"""The UWB sensor model against its equations, and what clearing does to simple maps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.errors import ParameterError
from mapping.traversability import Traversability, traversability_map
from mapping.uwb.clearing import UwbClearing, UwbPose, clear
from mapping.uwb.sensor_model import DETECTED, FREE_BEFORE, FREE_BEHIND, UNTOLD, bin_evidence, occupied
from mapping.uwb.thresholds import Learning, Thresholds
from mapping.uwb.uwb_params import UwbGeometry, UwbParams, in_words, of_rule
from tests.reference import uwb as slow

GEOMETRY = UwbGeometry(bins=40)
THETA = GEOMETRY.beamwidth_rad
CELL_M = 0.2
BUSH = (60, 50)
"""6 m north of the radar at (10.1, 2), in a grid of 100 x 100 cells."""
AT = UwbPose(0.0, 10.1, 2.0, 0.0)
PAPERS_RULE = UwbParams(explained_apart_m=math.inf)
LAST_BIN = 33
"""At R_max. What stands behind it explains nothing for certain: only so much of it is looked at as the beam's frame
has room for."""


def lawn(blocked: tuple[int, int] | None = BUSH) -> Traversability:
    elevation_m = np.zeros((100, 100), np.float32)
    if blocked is not None:
        elevation_m[blocked] = 1.0
    return traversability_map(elevation_m, CELL_M)


def ground(random: np.random.Generator, scans: int = 60) -> np.ndarray:
    return 30.0 + random.normal(0, 2, (scans, GEOMETRY.bins))


def clearing(found: Traversability, seed: int = 0, params: UwbParams | None = None) -> UwbClearing:
    made = UwbClearing(found, geometry=GEOMETRY, params=params, north_m=20.0)
    for scan in ground(np.random.default_rng(seed)):
        made.learning.take(scan)
    return made


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_one_scan_against_the_equations_cell_by_cell(seed: int, explaining: bool) -> None:
    random = np.random.default_rng(seed)
    elevation_m = (random.random((60, 60)) < 0.02).astype(np.float32)
    found = traversability_map(elevation_m, CELL_M)
    taught = ground(random, 25)
    made = UwbClearing(found, geometry=GEOMETRY, north_m=12.0, params=None if explaining else PAPERS_RULE)
    for scan in taught:
        made.learning.take(scan)
    limits = [slow.t_max(taught.tolist(), b) for b in range(GEOMETRY.bins)]
    scan = 30.0 + random.normal(0, 2, GEOMETRY.bins) + np.where(random.random(GEOMETRY.bins) < 0.1, 12.0, 0.0)
    x_m, y_m, heading_rad = random.uniform((2, 2, -4), (10, 10, 4)).tolist()
    pose = UwbPose(0.0, x_m, y_m, heading_rad)
    made.step(scan, pose, learn=False)
    before = made.result().probability
    assert made.step(scan, replace(pose, t_s=0.1), learn=False)
    after = made.result()
    blocked = np.argwhere(found.untraversable)
    cells = [(*from_radar(pose, row, col), float(before[row, col])) for row, col in blocked]
    for (row, col), (away, alpha, p) in list(zip(blocked, cells, strict=True))[:: max(1, len(blocked) // 40)]:
        inside = 3.5 <= away <= 10.0 and abs(alpha) <= THETA / 2
        assert after.time_in_view_s[row, col] == pytest.approx(0.1 if inside else 0.0)
        bin_number = math.floor(away / GEOMETRY.bin_m + 0.5)
        share = 0.0
        if explaining and inside:
            peak = slow.nearest_peak(scan.tolist(), limits, bin_number)
            if peak > LAST_BIN:
                continue
            share = slow.explained(cells, (away, alpha), peak, THETA, GEOMETRY.bin_m)
        step = slow.log_odds_step(scan.tolist(), limits, bin_number, away, alpha, THETA, GEOMETRY.bin_m, share)
        chance = 1 / (1 + math.exp(-(math.log(p / (1 - p)) + (step if inside else 0.0))))
        assert after.probability[row, col] == pytest.approx(chance, abs=1e-4)


def from_radar(pose: UwbPose, row: int, col: int) -> tuple[float, float]:
    """Metres to a cell's middle and the angle off the axis, in a grid whose north edge lies at 12 m."""
    east, north = (col + 0.5) * CELL_M - pose.x_m, 12.0 - (row + 0.5) * CELL_M - pose.y_m
    off = math.atan2(east, north) - pose.heading_rad
    return math.hypot(east, north), (off + math.pi) % (2 * math.pi) - math.pi


def test_thresholds_are_mean_and_extremes_with_headroom() -> None:
    learning = Learning(3)
    with pytest.raises(ParameterError, match="No scan"):
        learning.thresholds(3.0)
    for scan in ([1.0, 5.0, 9.0], [3.0, 5.0, 21.0]):
        learning.take(scan)
    found = learning.thresholds(3.0)
    np.testing.assert_allclose(found.detection, [2, 5, 15])
    np.testing.assert_allclose(found.lowest, [1, 5, 9])
    np.testing.assert_allclose(found.highest, [5, 8, 21])


def test_regions_along_range() -> None:
    level = np.full(GEOMETRY.bins, 10.0)
    thresholds = Thresholds(level, level - 4, level + 4)
    scan = level - 1
    scan[[15, 20, 28]] = [12.0, 16.0, 11.0]
    found = bin_evidence(scan, thresholds, GEOMETRY, UwbParams())
    assert (found.region[:12] == UNTOLD).all()
    assert (found.region[[12, 14, 16, 19]] == FREE_BEFORE).all()
    assert (found.region[[15, 20, 28]] == DETECTED).all()
    assert (found.region[[21, 27]] == FREE_BEHIND).all()
    assert (found.region[29:] == UNTOLD).all()
    assert found.weight[19] > found.weight[21] > 0.5
    assert occupied(found, 20) == pytest.approx(0.8 / (1 + math.exp(-4.5)))
    assert math.isnan(occupied(found, 19))


def test_the_scalers_printed_values() -> None:
    level = np.full(GEOMETRY.bins, 10.0)
    thresholds = Thresholds(level, level - 4, level + 4)
    scan = level - 1
    scan[20] = 14.0
    assert occupied(bin_evidence(scan, thresholds, GEOMETRY, UwbParams()), 20) / 0.8 == pytest.approx(0.9526, abs=1e-4)
    scan[19] = 6.0
    found = bin_evidence(scan, thresholds, GEOMETRY, UwbParams())
    assert 1 - found.weight[19] / 0.8 == pytest.approx(0.0067, abs=1e-4)


def test_what_stays_empty_is_cleared_and_what_echoes_is_not() -> None:
    random = np.random.default_rng(1)
    for echo, expected in ((0.0, True), (15.0, False)):
        made = clearing(lawn())
        for k, scan in enumerate(ground(random, 60)):
            scan[19:22] += [echo / 3, echo, echo / 3]
            made.step(scan - 1.5 * (echo == 0), replace(AT, t_s=k / 10), learn=False)
        found = made.result()
        assert found.seen[BUSH]
        assert bool(found.cleared[BUSH]) is expected
        assert (found.probability[BUSH] > 0.99) is not expected
        assert not found.cleared[~lawn().untraversable].any()


OTHER = (60, 38)
"""As far north as the bush and 2.4 m west of it."""


def two_bushes() -> Traversability:
    elevation_m = np.zeros((100, 100), np.float32)
    for at in (BUSH, OTHER):
        elevation_m[at] = 1.0
    return traversability_map(elevation_m, CELL_M)


def scans_of_two(random: np.random.Generator) -> list[tuple[np.ndarray, UwbPose]]:
    """Only the bush echoes. Seen from the west first, where the other one is 2.4 m nearer, then from the south."""
    west = UwbPose(0.0, 2.7, 7.9, math.pi / 2)
    out = []
    for k, scan in enumerate(ground(random, 160) - 1.5):
        pose = west if k < 60 else replace(AT, x_m=9.0)
        scan[round(math.hypot(10.1 - pose.x_m, 7.9 - pose.y_m) / GEOMETRY.bin_m)] += 20.0
        out.append((scan, replace(pose, t_s=k / 10)))
    return out


@pytest.mark.parametrize("params", [None, PAPERS_RULE])
def test_an_echo_is_no_news_of_a_cell_when_another_is_known_to_make_it(params: UwbParams | None) -> None:
    made = clearing(two_bushes(), params=params)
    for scan, pose in scans_of_two(np.random.default_rng(5)):
        made.step(scan, pose, learn=False)
    found = made.result()
    assert found.seen[BUSH]
    assert found.seen[OTHER]
    assert not found.cleared[BUSH]
    assert bool(found.cleared[OTHER]) is (params is None)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_what_stands_alone_is_judged_as_in_the_paper(seed: int) -> None:
    scan = ground(np.random.default_rng(seed), 1)[0] + np.where(np.arange(GEOMETRY.bins) == 20, 9.0, 0.0)
    ours, paper = clearing(lawn()), clearing(lawn(), params=PAPERS_RULE)
    for k in (0, 1, 2):
        for made in (ours, paper):
            made.step(scan, replace(AT, t_s=k / 10), learn=False)
    np.testing.assert_array_equal(ours.result().probability, paper.result().probability)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_more_power_never_makes_a_cell_emptier(seed: int) -> None:
    random = np.random.default_rng(seed)
    scan = ground(random, 1)[0]
    quiet, loud = clearing(lawn()), clearing(lawn())
    for k in (0, 1):
        quiet.step(scan, replace(AT, t_s=k / 10), learn=False)
        stronger = scan.copy()
        stronger[20] += 10
        loud.step(stronger, replace(AT, t_s=k / 10), learn=False)
    assert loud.result().probability[BUSH] >= quiet.result().probability[BUSH] - 1e-6


def test_only_open_known_ground_teaches() -> None:
    scan = np.full(GEOMETRY.bins, 30.0)
    assert UwbClearing(lawn(None), geometry=GEOMETRY, north_m=20.0).learn(scan, AT)
    assert not UwbClearing(lawn(), geometry=GEOMETRY, north_m=20.0).learn(scan, AT)
    behind = replace(AT, y_m=12.0)
    assert not UwbClearing(lawn(None), geometry=GEOMETRY, north_m=20.0).learn(scan, behind)
    hole = np.zeros((100, 100), np.float32)
    hole[58:62, 48:52] = np.nan
    assert not UwbClearing(traversability_map(hole, CELL_M), geometry=GEOMETRY, north_m=20.0).learn(scan, AT)


def test_a_log_learns_first_and_says_when_it_cannot() -> None:
    random = np.random.default_rng(3)
    away = [UwbPose(k / 10, 10.1, 9.0, -math.pi / 2) for k in range(30)]
    scans = ground(random, 60) - np.where(np.arange(60) >= 30, 1.5, 0.0)[:, None]
    poses = [*away, *(replace(AT, t_s=3 + k / 10) for k in range(30))]
    found, made = clear(lawn(), scans, poses, geometry=GEOMETRY, north_m=20.0)
    assert made.learning.scans == 30
    assert found.cleared[BUSH]
    with pytest.raises(ParameterError, match="0 of 30 scans look at nothing but traversable ground"):
        clear(lawn(), scans[30:], poses[30:], geometry=GEOMETRY, north_m=20.0)
    with pytest.raises(ParameterError, match="No time passes"):
        clear(lawn(), scans, [replace(pose, t_s=7.0) for pose in poses], geometry=GEOMETRY, north_m=20.0)


def test_time_is_counted_between_scans_and_not_across_pauses() -> None:
    made = clearing(lawn())
    scan = np.full(GEOMETRY.bins, 30.0)
    for t_s in (0.0, 0.1, 0.2, 60.0, 60.0, 59.0):
        made.step(scan, replace(AT, t_s=t_s), learn=False)
    assert made.time_in_view_s[BUSH] == pytest.approx(0.1 + 0.1 + 0.5)


def test_the_papers_rule_and_its_numbers_can_be_chosen() -> None:
    assert of_rule("explained") == UwbParams()
    assert of_rule("paper") == PAPERS_RULE
    chosen = of_rule("paper", free_before=0.3, prior=0.6, farthest_m=None)
    assert (chosen.free_behind, chosen.prior, chosen.farthest_m) == (pytest.approx(0.4), 0.6, 10.0)
    assert "the paper's rule; P_O 0.8, P_C2 0.3, P_C3 0.4" in in_words(chosen)
    assert "echoes explained" in in_words(UwbParams())
    for wrong in ({"most_occupied": math.nan}, {"free_before": 0.45}, {"nearest_m": 11.0}):
        with pytest.raises(ParameterError):
            of_rule("explained", **wrong)


def test_wrong_scans_poses_and_parameters_are_refused() -> None:
    made = clearing(lawn())
    for scan, pose in (
        (np.zeros(7), AT),
        (np.full(GEOMETRY.bins, np.nan), AT),
        (np.zeros(GEOMETRY.bins), replace(AT, heading_rad=math.inf)),
    ):
        with pytest.raises(ParameterError):
            made.step(scan, pose)
    for field, value in (
        ("nearest_m", 11.0),
        ("most_occupied", 1.2),
        ("free_before", 0.4),
        ("prior", 0.5),
        ("explained_apart_m", 0.0),
    ):
        with pytest.raises(ParameterError):
            replace(UwbParams(), **{field: value})
    for field, value in (("bins", 2), ("bin_m", 0.0), ("beamwidth_rad", 4.0)):
        with pytest.raises(ParameterError):
            replace(UwbGeometry(), **{field: value})


def test_evidence_stays_within_its_bounds() -> None:
    made = clearing(lawn(), params=UwbParams(seen_s=0.0))
    scan = np.full(GEOMETRY.bins, 30.0)
    scan[20] = 90.0
    for k in range(3000):
        made.step(scan, replace(AT, t_s=k / 10), learn=False)
    assert 0.99 < made.result().probability[BUSH] <= 1.0
    for k in range(200):
        made.step(np.full(GEOMETRY.bins, 24.0), replace(AT, t_s=400 + k / 10), learn=False)
    assert made.result().cleared[BUSH]
