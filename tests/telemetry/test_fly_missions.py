"""Whole flights over real terrain, with wind, RTK noise and the real link: no contact, and near the plan."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bench.bench_flights import TERRAINS, allowed_p95_m, fly_seed


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_seeded_mission_keeps_what_was_certified(shared_data: Path, seed: int) -> None:
    flown = fly_seed(shared_data / "dsm" / TERRAINS[seed], seed)
    assert flown.completed, flown.text
    assert not flown.contact
    assert flown.figures is not None
    assert flown.figures.completed
    assert flown.figures.cross_track.p95_m <= allowed_p95_m()
    assert flown.figures.nearest is not None
    assert flown.figures.nearest.distance_m >= flown.certified_m - flown.position_error_m
