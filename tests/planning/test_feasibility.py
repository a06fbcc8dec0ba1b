"""The second verdict: whether the vehicle can fly a mission at all."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planning.basics.plan_model import Home, Mission, MissionItem, VehicleProfile
from planning.missions.feasibility import (
    commanded_speed_m_s,
    feasibility_json,
    feasibility_of,
    photos_row,
    verdict_words,
)

QUAD = VehicleProfile("quad", endurance_s=1000.0, reserve_share=0.25)
NAN = float("nan")


def mission(*speeds: tuple[float, float], items: int = 3) -> Mission:
    """Items of DO_CHANGE_SPEED (kind, m/s), then waypoints."""
    change = tuple(MissionItem(178, 2, (kind, speed, -1.0, 0.0)) for kind, speed in speeds)
    return Mission(Home(0.0, 0.0, 0.0), (*change, *items * (MissionItem(16, 3),)))


def states(flight: Mission, predicted_s: float | None = 100.0, profile: VehicleProfile = QUAD) -> dict[str, str]:
    return {row.code: row.state for row in feasibility_of(flight, profile, predicted_s).rows}


@pytest.mark.parametrize(
    ("predicted_s", "state", "feasible"), [(750.0, "holds", True), (750.1, "fails", False), (None, "unknown", None)]
)
def test_battery(predicted_s: float | None, state: str, feasible: bool | None) -> None:
    found = feasibility_of(mission(), QUAD, predicted_s)
    assert found.rows[0].state == state
    assert found.feasible is feasible
    assert all(row.mend for row in found.failures)


def test_speeds_and_climbs_beyond_the_vehicle() -> None:
    assert states(mission((1, 5.0)))["speed"] == "holds"
    assert states(mission((1, 5.0), (0, 5.1)))["speed"] == "fails"
    assert states(mission((2, 2.5), (3, 1.5)))["climb"] == "holds"
    assert states(mission((2, 2.6)))["climb"] == states(mission((3, 1.6)))["climb"] == "fails"
    assert states(mission((1, -1.0)))["speed"] == "holds"
    assert commanded_speed_m_s(mission((1, 3.0), (2, 9.0), (1, 4.0))) == 4.0
    assert commanded_speed_m_s(mission((1, -2.0))) is None


def test_items() -> None:
    few = replace(QUAD, max_items=4)
    assert states(mission(items=4), profile=few)["items"] == "holds"
    assert states(mission(items=5), profile=few)["items"] == "fails"


def test_more_rows_can_be_added() -> None:
    found = feasibility_of(mission(), QUAD, 100.0)
    assert found.feasible is True
    assert found.with_rows(photos_row(())).feasible is True
    more = found.with_rows(photos_row(("Only 57 % of the area is photographed at all.",)))
    assert more.feasible is False
    assert [row.code for row in more.failures] == ["photos"]
    assert feasibility_json(more)["feasibility"][-1]["code"] == "photos"


def test_both_verdicts_in_words() -> None:
    assert verdict_words(certified=True, feasible=False) == "CERTIFIED, NOT FEASIBLE"
    assert verdict_words(certified=False, feasible=True) == "NOT CERTIFIED, FEASIBLE"
    assert verdict_words(certified=True, feasible=None) == "CERTIFIED, feasibility not judged"
