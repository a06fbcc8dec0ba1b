"""What the worker makes of a check beside the rows: whether waypoints can be handed over one at a time."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from planning.certificate.certificate_model import Certificate, HomeStand
from planning.planner.plan import plan_mission
from server.flying import check_task
from server.library.documents import demands_from_doc
from server.schemas import PlanDoc
from telemetry.topics.messages import PlanRecord
from tests.planning.plan_examples import request_over, small_dsm

PLAN = PlanDoc()
RECORD = PlanRecord(0.0, "Demo", "", "", "ardupilot", "", "", "", None, None, "", "", plan_json=PLAN.model_dump_json())
GUIDED_M = replace(demands_from_doc(PLAN), way="guided").clearance().required_clearance_m


@pytest.fixture(scope="module")
def certificate() -> Certificate:
    dsm = small_dsm()
    return plan_mission(dsm, request_over(dsm, [(0.3, 0.3), (0.7, 0.35)])).certificate


def keeping(certificate: Certificate, nominal_m: float, lowest_m: float) -> Certificate:
    """With the vehicle at the height of home's place, and on the lowest ground that it may stand on there."""
    drop_m = nominal_m - lowest_m
    home = HomeStand(100.0, 100.0 - drop_m, 100.0, drop_m, 2.85, "model", lowest_m)
    return replace(certificate, min_distance_m=nominal_m, home=home)


def test_waypoints_one_at_a_time_are_judged_from_the_lowest_ground_at_home(certificate: Certificate) -> None:
    enough_m = GUIDED_M + 0.1
    assert check_task._not_guided(RECORD, keeping(certificate, enough_m, enough_m)) == ""
    words = check_task._not_guided(RECORD, keeping(certificate, enough_m, GUIDED_M - 0.25))
    assert f"The line keeps {math.floor((GUIDED_M - 0.25) * 100) / 100:.2f} m" in words


@pytest.mark.parametrize("unknown", [None, math.nan])
def test_an_unknown_lower_end_says_nothing(certificate: Certificate, unknown: float | None) -> None:
    stand = (
        keeping(certificate, 9.0, math.nan)
        if unknown is not None
        else replace(certificate, min_distance_m=9.0, home=None)
    )
    assert stand.kept_m == 9.0
