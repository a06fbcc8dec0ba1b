"""The simulated UWB radar: the paper's Table II and fig. 6, and what physics demands of any scene."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.uwb.thresholds import Thresholds
from telemetry.simulation.scenarios.foliage.foliage_calibration import PRINTED, fig_6, lawn_thresholds, table_ii
from telemetry.simulation.simulator.sensors.uwb import UwbModel, UwbRadar, transmission
from telemetry.simulation.simulator.sensors.uwb_scene import Foliage, Target, chords, screen, uwb_scene

PLAIN = UwbModel(aspects=0)


@pytest.fixture(scope="module", params=[0, 1])
def thresholds(request: pytest.FixtureRequest) -> Thresholds:
    return lawn_thresholds(request.param)


def test_table_ii_small_targets_included(thresholds: Thresholds) -> None:
    found = table_ii(thresholds)
    for name in ("Metal Jerry", "Large reflector", "Plastic Jerry", "Plywood", "3 bricks"):
        assert found[name] == pytest.approx(PRINTED[name], abs=0.001)
    assert found["2 bricks"] == pytest.approx(PRINTED["2 bricks"], abs=0.02)
    assert found["Stone"] == pytest.approx(PRINTED["Stone"], abs=0.002)
    assert found["2 bricks"] > 0.5 > found["Stone"] >= found["Cardboard box"]
    ranked = sorted(PRINTED, key=lambda name: -PRINTED[name])
    assert [round(found[name], 4) for name in ranked] == sorted((round(p, 4) for p in found.values()), reverse=True)


def test_fig_6_layer_by_layer(thresholds: Thresholds) -> None:
    layers = fig_6(thresholds)
    bricks = [layer.bricks for layer in layers]
    assert bricks == sorted(bricks, reverse=True)
    assert bricks[4] > 1.0
    assert bricks[5] < 0.5
    assert all(layer.leaves < layer.leaves_limit / 2 for layer in layers[:4])
    assert layers[4].leaves > layers[4].leaves_limit
    assert layers[5].leaves > layers[5].leaves_limit
    assert layers[5].leaves < layers[4].leaves


def test_near_ground_is_as_much_more_uneven_as_its_patch_echoes_more(thresholds: Thresholds) -> None:
    uneven = thresholds.highest - thresholds.detection
    assert uneven[17] / uneven[34] == pytest.approx(8.0, rel=0.3)


def test_the_same_seed_gives_the_same_scans_and_a_standing_radar_the_same_ground() -> None:
    scene = uwb_scene([Target("post", (0.0, 8.0), 0.2, 1.0, 2.0)])
    one, other, third = (UwbRadar(scene, seed) for seed in (4, 4, 5))
    for k in range(5):
        a, b, c = (radar.scan(0.0, k * 0.5, 0.0) for radar in (one, other, third))
        np.testing.assert_array_equal(a, b)
        assert (a != c).any()
    still = np.array([one.scan(0.0, 2.0, 0.0) for _ in range(20)], float)
    assert still.std(axis=0).max() < 1.5


@settings(max_examples=30)
@given(st.floats(4, 14), st.floats(-0.3, 0.3), st.floats(0.1, 10))
def test_an_echo_lies_in_its_bin_and_fades_with_distance_and_angle(away_m: float, off: float, m2: float) -> None:
    def power(range_m: float, angle: float) -> np.ndarray:
        at = (range_m * math.sin(angle), range_m * math.cos(angle))
        return UwbRadar(uwb_scene([Target("t", at, 0.0, 1.0, m2)]), 0, PLAIN).echoes(0.0, 0.0, 0.0)

    found = power(away_m, off)
    assert abs(np.argmax(found) * 0.3 - away_m) <= 0.16
    assert power(away_m, off * 1.5).sum() <= found.sum() + 1e-12
    total = power(away_m, 0.0).max() * (away_m / 10) ** 4
    assert total <= m2 * (1 + 1e-9)


def test_turning_around_shows_nothing_and_solid_things_hide_others() -> None:
    wall = [Target("wall", (x, 6.0), 0.3, 2.0, 1.0) for x in (-0.5, 0.0, 0.5)]
    behind = Target("drum", (0.0, 9.0), 0.3, 1.0, 5.0)
    free = UwbRadar(uwb_scene([behind]), 0, PLAIN)
    assert free.echoes(0.0, 0.0, math.pi).max() == 0.0
    assert free.echoes(0.0, 0.0, 0.0)[29] > 1.0
    assert UwbRadar(uwb_scene([*wall, behind]), 0, PLAIN).echoes(0.0, 0.0, 0.0)[28:32].max() < 0.01


def test_foliage_weakens_what_is_behind_and_not_what_is_before() -> None:
    drum = [Target("drum", (0.0, 8.0), 0.2, 1.0, 3.0, solid=False)]
    alone = UwbRadar(uwb_scene(drum), 0, PLAIN).echoes(0.0, 0.0, 0.0)[26]
    for at_m, share in ((6.0, float(transmission(np.array(2.0)))), (10.5, 1.0)):
        leaves = screen((0.0, at_m), 2.0, 1.0, 2.0)
        found = UwbRadar(uwb_scene(drum, leaves), 0, PLAIN).echoes(0.0, 0.0, 0.0)[26]
        assert found == pytest.approx(alone * share, rel=0.08)


def test_close_clumps_echo_as_one() -> None:
    one = uwb_scene((), [Foliage((0.0, 8.0), 0.5, 1.0, 4.0)])
    halves = uwb_scene((), [Foliage((0.0, 8.0), 0.5, 1.0, 2.0)] * 2)
    np.testing.assert_allclose(
        UwbRadar(one, 0).echoes(0.0, 0.0, 0.0), UwbRadar(halves, 0).echoes(0.0, 0.0, 0.0), rtol=1e-9
    )


def test_chords_of_a_disc() -> None:
    enters_m, inside_m = chords(
        np.array([[0.0, 5.0], [0.3, 3.0], [0.0, -4.0]]), np.array([1.0, 0.5, 1.0]), np.zeros(2), np.array([[0.0, 1.0]])
    )
    np.testing.assert_allclose(enters_m, [[4.0, 2.6, math.inf]])
    np.testing.assert_allclose(inside_m, [[2.0, 0.8, 0.0]])
