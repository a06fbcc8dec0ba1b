"""Random changes to a certified mission: the certificate against brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planning.certificate.clearance import certify
from planning.missions.flown import flown_line
from tests.planning.mutated_missions import hilly, hugging_mission, is_safe, mutated
from tests.planning.test_clearance import PARAMS, dsm_of


def test_no_mutation_that_brute_force_finds_unsafe_is_certified():
    """Promise: hundreds of random changes to a certified mission, and none is wrongly certified."""
    cells = hilly()
    dsm, mission = dsm_of(cells), hugging_mission(hilly())
    home_m = float(cells[30, 12])
    measured = replace(PARAMS, home_known_dsm_m=(home_m, home_m))
    scout = certify(dsm, flown_line(mission, dsm), measured)
    tight = replace(measured, required_clearance_m=scout.min_distance_m - 0.02)
    needed_m = certify(dsm, flown_line(mission, dsm), tight).rtl_height_needed_m
    params = replace(tight, rtl_height_m=needed_m + 0.02)
    assert certify(dsm, flown_line(mission, dsm), params).certified
    rng = np.random.default_rng(20260)
    certified = refused = rightly_refused = 0
    for _ in range(300):
        line = flown_line(mutated(mission, rng), dsm)
        if certify(dsm, line, params).certified:
            certified += 1
            assert is_safe(cells, line, params)
        else:
            refused += 1
            rightly_refused += refused <= 25 and not is_safe(cells, line, params)
    assert certified > 66
    assert refused > 66
    assert rightly_refused > 15
