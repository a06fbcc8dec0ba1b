"""Random changes to a certified mission: the certificate against brute force."""

from __future__ import annotations

import numpy as np

from planning.certificate.clearance import certify
from planning.missions.flown import flown_line
from tests.planning.mutated_missions import hilly, hugging_mission, hugging_params, is_safe, mutated
from tests.planning.test_clearance import dsm_of


def test_no_mutation_that_brute_force_finds_unsafe_is_certified():
    """Promise: hundreds of random changes to a certified mission, and none is wrongly certified."""
    cells = hilly()
    dsm, mission = dsm_of(cells), hugging_mission(cells)
    params = hugging_params(dsm, mission, cells)
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
