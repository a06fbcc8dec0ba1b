"""Home that was moved in flight, held against the surface model's ground."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from planning.basics.plan_model import VehicleProfile
from planning.certificate.certificate_model import ClearanceParams
from planning.fence.fence_model import Fence
from telemetry.errors import NotAllowedError
from telemetry.flight.certified_way import Flown, demanded
from telemetry.flight.home_height import home_off_m
from telemetry.flight.home_watch import home_of, home_of_takeoff
from telemetry.topics.vehicle import VehicleState
from tests.planning.test_guided_ways import HOME, at, flat, model

GROUND = model(flat(50.0))
LAT_DEG, LON_DEG = at(GROUND, *HOME)


def flying(home_alt_amsl_m: float | None = 53.0, **more: Any) -> VehicleState:
    """Its receiver is 3 m off."""
    told: dict[str, Any] = {"armed": True, "landed": "in_air", "gnss_fix": "3d", "home_alt_amsl_m": home_alt_amsl_m}
    return VehicleState(1, 1, home_lat_deg=LAT_DEG, home_lon_deg=LON_DEG, **(told | more))


@pytest.mark.parametrize(
    ("rose_m", "off_m", "words"),
    [
        (0.3, 0.0, ""),
        (0.4, 0.4, ""),
        (-1.2, -1.2, ""),
        (-8.0, None, "8.0 m below the ground"),
        (2.1, None, "2.1 m above"),
    ],
)
def test_heights_count_from_the_ground_of_the_take_off(rose_m: float, off_m: float | None, words: str) -> None:
    took_off, state = home_of(flying()), flying(53.0 + rose_m)
    if off_m is None:
        with pytest.raises(NotAllowedError, match=words):
            home_off_m(GROUND, took_off, state)
    else:
        assert home_off_m(GROUND, took_off, state) == pytest.approx(off_m)


@pytest.mark.parametrize("off_m", [-1.2, 1.2])
def test_what_home_may_be_off_is_judged_at_the_worse_end(off_m: float) -> None:
    limit = ClearanceParams(2.0, 0.3, 0.5, 30.0, max_height_above_ground_m=120.0)
    ceiling = Fence(ceiling_rel_home_m=50.0)
    told = {"gnss_t_mono_s": 1.0, "horizontal_accuracy_m": 0.02, "vertical_accuracy_m": 0.02}
    state = flying(alt_rel_home_m=10.0, gnss_fix="rtk_fixed", **told)
    flown = Flown(VehicleProfile("quad"), limit, {}, ceiling)
    known, doubted = demanded(state, flown), demanded(state, replace(flown, home_off_m=off_m))
    assert doubted.required_clearance_m == pytest.approx(known.required_clearance_m + 1.2)
    assert known.max_height_above_ground_m == 120.0
    assert doubted.max_height_above_ground_m == pytest.approx(120.0 - max(0.0, off_m))
    assert doubted.fence_margin_m == pytest.approx(known.fence_margin_m + max(0.0, off_m))


@pytest.mark.parametrize(
    ("alt_m", "fix", "datum", "is_known"),
    [
        (50.1, "rtk_fixed", "EGM2008 height", True),
        (42.0, "rtk_fixed", "EGM2008 height", False),
        (50.1, "3d", "EGM2008 height", False),
        (50.1, "rtk_fixed", None, False),
    ],
)
def test_without_the_take_off_only_a_receiver_that_tells_centimetres_says_it(
    alt_m: float, fix: str, datum: str | None, is_known: bool
) -> None:
    ground, state = replace(GROUND, vertical_datum=datum), flying(alt_m, gnss_fix=fix)
    if is_known:
        assert home_off_m(ground, None, state) == 0.0
    else:
        with pytest.raises(NotAllowedError, match="was not heard here"):
            home_off_m(ground, None, state)


def test_a_home_whose_height_is_not_told_is_waited_for() -> None:
    with pytest.raises(NotAllowedError, match="does not tell how high"):
        home_off_m(GROUND, home_of(flying()), flying(None))


def test_home_of_the_take_off_is_the_first_in_the_air_of_a_flight_that_was_heard_from_the_ground_on() -> None:
    stands = flying(9.0, landed="on_ground")
    flight = [stands, flying(None), flying(53.0), flying(45.0)]
    assert home_of_takeoff(flight) == home_of(flying(53.0))
    assert home_of_takeoff(flight[1:]) is None
    assert home_of_takeoff([stands]) is None
    assert home_of_takeoff([]) is None
