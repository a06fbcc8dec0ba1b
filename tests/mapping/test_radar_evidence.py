"""What radar targets count: columns that grow step by step, and small echoes from far away."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry.poses import Pose
from mapping.perceiving.radar_evidence import EvidenceParams, RadarEvidence
from mapping.radar.targets import Polar

SURE = np.array([1.0])


def target(up_m: float) -> np.ndarray:
    return np.array([[10.5, 20.5, up_m]])


def believed_hut() -> RadarEvidence:
    evidence = RadarEvidence()
    evidence.judge(0.0, target(5.0), SURE)
    assert evidence.judge(0.1, target(5.0), SURE)[0].all()
    return evidence


@pytest.mark.parametrize(("up_m", "believed"), [(5.0, True), (7.9, True), (8.1, False), (60.0, False)])
def test_a_single_target_far_above_a_hut_makes_no_mast_of_it(up_m: float, believed: bool) -> None:
    assert believed_hut().judge(30.0, target(up_m), SURE)[0].tolist() == [believed]


def test_a_column_grows_as_the_vehicle_climbs_beside_it() -> None:
    evidence = believed_hut()
    for step in range(1, 20):
        found, _ = evidence.judge(30.0 + 0.1 * step, target(5.0 + step), SURE)
        assert found.all()


@pytest.mark.parametrize(
    ("range_m", "size_m2", "weight"), [(25.0, 0.05, 1.0), (35.0, 0.05, 0.5), (35.0, 0.5, 1.0), (25.0, 0.005, 0.5)]
)
def test_a_small_echo_from_far_away_is_doubtful(range_m: float, size_m2: float, weight: float) -> None:
    p = EvidenceParams()
    snr_db = p.rated_snr_db + 10 * np.log10(size_m2) - 40 * np.log10(range_m / p.rated_range_m)
    here = Pose(0.0, np.array([0.0, 0.0, 10.0]), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    seen = Polar(np.array([range_m]), np.zeros(1), np.zeros(1))
    weights = RadarEvidence().weights(seen, np.array([snr_db]), np.zeros(1), here, None)
    assert weights.tolist() == [weight]
