"""A guided way is judged with what the vehicle tells of itself; what it does not tell is not taken for granted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planning.basics.plan_model import ANY_VEHICLE, FlownLine
from planning.certificate.certificate_model import ClearanceParams
from planning.certificate.clearance import certify
from planning.guided.guided_model import GoTo, GuidedWay, Orbit, ToHome, Wish
from planning.missions.vehicle_terms import budget_of
from planning.terrain.dsm import Dsm
from telemetry.errors import NotAllowedError
from telemetry.flight.certified_way import Flown, judged_way, part_for, way_request
from telemetry.flight.home_watch import HomePlace
from telemetry.topics.requests import FlyWay, Operator
from telemetry.topics.vehicle import VehicleState
from tests.planning.catalogue_samples import NORTH_M, WEST_M, tower_beside
from tests.planning.test_guided_ways import CLEARANCE, HOME, at, flat, model

DSM = model(flat())
TOLD: dict[str, float | None] = {"RTL_ALT": 3000.0, "RTL_CONE_SLOPE": 3.0}


def judged(
    wish: Wish,
    parameters: dict[str, float | None],
    *,
    dsm: Dsm = DSM,
    clearance: ClearanceParams = CLEARANCE,
    **more: Any,
) -> GuidedWay:
    (home_lat, home_lon), (lat, lon) = at(DSM, *HOME), at(DSM, 70.0, 60.0)
    places: dict[str, Any] = {"lat_deg": lat, "lon_deg": lon, "home_lat_deg": home_lat, "home_lon_deg": home_lon}
    heard: dict[str, Any] = {
        "position_t_mono_s": 0.0,
        "gnss_t_mono_s": 0.0,
        "heartbeat_t_mono_s": 0.0,
        "gnss_fix": "rtk_fixed",
    }
    places["home_alt_amsl_m"] = 100.0
    flies: dict[str, Any] = {"autopilot": "ardupilot", "armed": True, "landed": "in_air", "alt_rel_home_m": 12.0}
    state = VehicleState(1, 1, **(places | heard | flies | more))
    flown = Flown(ANY_VEHICLE, clearance, parameters)
    return judged_way(dsm, None, state, wish, flown, speed_m_s=1.0, now_s=0.0)


def test_with_all_that_its_return_rests_on_it_may_be_flown() -> None:
    assert judged(GoTo(9.0), TOLD).problem is None
    px4: dict[str, float | None] = {"RTL_RETURN_ALT": 30.0, "RTL_CONE_ANG": 45.0, "RTL_MIN_DIST": 10.0}
    assert judged(GoTo(9.0), px4, autopilot="px4").problem is None


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({}, "does not tell its return height (RTL_ALT)"),
        ({"RTL_ALT": None}, "does not tell its return height (RTL_ALT)"),
        (TOLD | {"RTL_CONE_SLOPE": 0.5}, "climbs less on its return"),
    ],
)
def test_a_return_that_is_not_known_is_not_certified_but_may_be_accepted(
    parameters: dict[str, float | None], words: str
) -> None:
    way = judged(GoTo(9.0), parameters)
    assert way.problem == "return"
    assert not way.certificate.certified
    assert words in way.reasons[-1]
    assert judged(ToHome(9.0), parameters).problem is None, "a certified way home does not need the vehicle's own"


def test_the_vehicles_own_ceiling_is_kept_and_its_floor_stops_no_climb_from_below_it() -> None:
    acts: dict[str, float | None] = TOLD | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 9.0, "FENCE_ALT_MIN": 20.0}
    assert judged(GoTo(30.0), acts | {"FENCE_ALT_MAX": 100.0}).problem is None
    way = judged(GoTo(30.0), acts | {"FENCE_ALT_MAX": 30.0})
    assert way.problem == "way"
    assert "ceiling is at 30 m" in " ".join(way.reasons)
    assert judged(GoTo(30.0), acts | {"FENCE_ALT_MAX": 30.0, "FENCE_ENABLE": 0.0}).problem is None
    low = acts | {"FENCE_ALT_MAX": 100.0, "FENCE_MARGIN": 2.0}
    for floor_m, problem in ((8.0, "way"), (7.0, None), (11.0, None)):  # from 12 m to 9 m; below it no floor acts yet
        down = judged(GoTo(9.0), low | {"FENCE_ALT_MIN": floor_m})
        assert (down.problem, "its own floor" in " ".join(r.text for r in down.certificate.reasons)) == (
            problem,
            problem is not None,
        )
    around = acts | {"FENCE_TYPE": 2.0, "FENCE_RADIUS": 900.0}
    assert judged(GoTo(30.0), around).problem is None
    assert judged(GoTo(30.0), around | {"FENCE_RADIUS": 1.0}).problem == "way"


@pytest.mark.parametrize("missing", ["home_lat_deg", "home_lon_deg", "home_alt_amsl_m"])
def test_without_a_whole_home_nothing_is_certified_that_the_link_could_not_hold_against_it(missing: str) -> None:
    unknown: dict[str, Any] = {missing: None}
    with pytest.raises(NotAllowedError, match="does not tell its home, place and height") as refused:
        judged(GoTo(9.0), TOLD, **unknown)
    assert refused.value.advice == "Wait for it."


def test_what_the_model_tells_of_its_error_is_demanded_also_beside_what_the_receiver_tells() -> None:
    """The requirement is then no sum of its terms, and counted as set by hand."""
    budget = budget_of(ANY_VEHICLE, "guided")
    asked = replace(CLEARANCE, required_clearance_m=budget.total_m, budget=budget, position_error_m=0.5)
    told = replace(DSM, rms_m=0.5)
    more_m = 3 * 0.5 - budget.value_m("dsm_accuracy")
    receivers: tuple[dict[str, Any], ...] = ({}, {"horizontal_accuracy_m": 0.9})
    for receiver in receivers:
        plain = judged(GoTo(9.0), TOLD, clearance=asked, **receiver).certificate
        worse = judged(GoTo(9.0), TOLD, clearance=asked, dsm=told, **receiver).certificate
        assert worse.required_clearance_m == pytest.approx(plain.required_clearance_m + more_m)


def test_no_way_is_asked_of_the_link_without_the_home_that_it_was_judged_for() -> None:
    me, wish, home = Operator("console", 1), GoTo(9.0), HomePlace(37.0, 15.0, 100.0)
    way = judged(wish, TOLD)
    with pytest.raises(NotAllowedError, match="does not tell its home"):
        way_request(me, way, wish, None, speed_m_s=1.0, most_m_s=2.0)
    request = way_request(me, way, wish, home, speed_m_s=1.0, most_m_s=2.0)
    assert isinstance(request, FlyWay)
    assert request.home == home


def test_a_wide_orbit_is_judged_with_the_errors_of_the_models_that_it_leads_over() -> None:
    catalogue, truth = tower_beside(1477.5, 15.0)
    ((lat, lon),) = catalogue.lat_lon_from_xy(np.array([[WEST_M + 1002.5, NORTH_M - 1002.5]])).tolist()
    places = {"lat_deg": lat, "lon_deg": lon, "home_lat_deg": lat, "home_lon_deg": lon, "home_alt_amsl_m": 0.0}
    wish = Orbit((lat, lon), 475.0, 30.0)
    state = VehicleState(1, 1, **places)
    part = part_for(catalogue, state, wish, ())
    assert part.place_m == 15.0
    assert part_for(catalogue, state, replace(wish, radius_m=20.0), ()).place_m == 0.0
    budget = budget_of(ANY_VEHICLE, "guided")
    clearance = ClearanceParams(budget.total_m, ANY_VEHICLE.radius_m, 0.3, rtl_height_m=30.0, budget=budget)
    way = judged(wish, TOLD, dsm=part, clearance=clearance, alt_rel_home_m=30.0, **places)
    assert way.problem is None
    line = FlownLine(way.points_m, np.arange(len(way.points_m) - 1), tuple(way.points_m[0, :2]), 0.0, 30.0, True)
    real = certify(truth, line, clearance)
    assert real.min_distance_m >= clearance.required_clearance_m
