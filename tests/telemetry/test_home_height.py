"""Home that was moved in flight, held against the surface model's ground."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from telemetry.errors import NotAllowedError
from telemetry.flight.home_height import check_home_height
from telemetry.flight.home_watch import home_of, home_of_takeoff
from telemetry.topics.vehicle import VehicleState
from tests.planning.test_guided_ways import HOME, at, flat, model

GROUND = model(flat(50.0))
LAT_DEG, LON_DEG = at(GROUND, *HOME)


def flying(home_alt_amsl_m: float | None = 53.0, **more: Any) -> VehicleState:
    """Its receiver is 3 m off."""
    told: dict[str, Any] = {"armed": True, "landed": "in_air", "gnss_fix": "3d", "home_alt_amsl_m": home_alt_amsl_m}
    return VehicleState(1, 1, home_lat_deg=LAT_DEG, home_lon_deg=LON_DEG, **(told | more))


@pytest.mark.parametrize(("rose_m", "words"), [(0.4, ""), (-8.0, "8.0 m below the ground"), (2.0, "2.0 m above")])
def test_heights_count_from_the_ground_of_the_take_off(rose_m: float, words: str) -> None:
    took_off, state = home_of(flying()), flying(53.0 + rose_m)
    if words:
        with pytest.raises(NotAllowedError, match=words):
            check_home_height(GROUND, took_off, state)
    else:
        check_home_height(GROUND, took_off, state)


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
        check_home_height(ground, None, state)
    else:
        with pytest.raises(NotAllowedError, match="was not heard here"):
            check_home_height(ground, None, state)


def test_a_home_whose_height_is_not_told_is_waited_for() -> None:
    with pytest.raises(NotAllowedError, match="does not tell how high"):
        check_home_height(GROUND, home_of(flying()), flying(None))


def test_home_of_the_take_off_is_the_first_in_the_air_of_a_flight_that_was_heard_from_the_ground_on() -> None:
    stands = flying(9.0, landed="on_ground")
    flight = [stands, flying(None), flying(53.0), flying(45.0)]
    assert home_of_takeoff(flight) == home_of(flying(53.0))
    assert home_of_takeoff(flight[1:]) is None
    assert home_of_takeoff([stands]) is None
    assert home_of_takeoff([]) is None
