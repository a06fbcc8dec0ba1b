"""Missions changed at random: none that brute force finds unsafe may pass the check that stands before every start."""

from __future__ import annotations

import numpy as np

from planning.certificate.clearance import certify
from planning.missions.flown import flown_line
from tests.planning.mutated_missions import hilly, hugging_mission, hugging_params, is_safe, mutated
from tests.planning.test_clearance import dsm_of
from tests.trust.rows import Row, judged


def missions_row(mutations: int) -> Row:
    cells = hilly()
    dsm, mission = dsm_of(cells), hugging_mission(cells)
    params = hugging_params(dsm, mission, cells)
    rng, passed, wrong = np.random.default_rng(20260), 0, 0
    for _ in range(mutations):
        line = flown_line(mutated(mission, rng), dsm)
        if certify(dsm, line, params).certified:
            passed += 1
            wrong += not is_safe(cells, line, params)
    figure = f"{wrong} unsafe ones passed in {mutations} changed missions; {passed} passed, all measured by brute force"
    promise = "A defect of the planner: no unsafe mission passes the independent check"
    return Row("R16", promise, judged(wrong == 0 and passed > 0), figure, "make trust")
