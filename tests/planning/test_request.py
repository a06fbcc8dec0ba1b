"""Values that no flight can have are refused, each by its name."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.basics.limits import LARGEST
from planning.basics.plan_model import MissionParams, PathParams, SurfaceParams, VehicleProfile
from planning.errors import ParameterError
from planning.planner.request import PlanRequest, check_demands, check_request, check_size
from tests.planning.format_examples import make_dsm

SOUND = PlanRequest(pois=(), profile=VehicleProfile("quad"))
SURFACE = {"Radius R": "radius_m", "Height H": "height_m"}
PATH = {
    "Mean speed": "mean_speed_m_s",
    "Maximum speed": "max_speed_m_s",
    "Climb limit": "max_climb_m_s",
    "Descent limit": "max_descent_m_s",
    "Acceleration limit": "max_accel_m_s2",
    "Sampling step": "step_m",
}
PROFILE = {
    "Vehicle radius": "radius_m",
    "Endurance": "endurance_s",
    "Mass": "mass_kg",
    "Rotor diameter": "rotor_diameter_m",
}
NOT_POSITIVE = (0.0, -1.0, math.nan, math.inf, -math.inf, 2 * LARGEST)


def test_defaults_are_sound() -> None:
    check_request(SOUND)
    check_request(replace(SOUND, required_clearance_m=0.1, max_height_above_ground_m=120.0))


@pytest.mark.parametrize("value", NOT_POSITIVE)
@pytest.mark.parametrize("name", [*SURFACE, *PATH, *PROFILE])
def test_must_be_positive(name: str, value: float) -> None:
    parts = (("surface", SURFACE), ("path", PATH), ("profile", PROFILE))
    part, keys = next((part, keys) for part, keys in parts if name in keys)
    changed = replace(getattr(SOUND, part), **{keys[name]: value})
    with pytest.raises(ParameterError, match=f"^{name} is "):
        check_request(replace(SOUND, **{part: changed}))


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_must_not_be_negative(value: float) -> None:
    wrong = {
        "Position error": replace(SOUND, profile=replace(SOUND.profile, position_error_m=value)),
        "Following error": replace(SOUND, profile=replace(SOUND.profile, following_m=value)),
        "Rotor downwash": replace(SOUND, profile=replace(SOUND.profile, downwash_m=value)),
        "Accuracy of the surface model": replace(SOUND, profile=replace(SOUND.profile, dsm_rms_m=value)),
        "RTL height": replace(SOUND, profile=replace(SOUND.profile, rtl_height_m=value)),
        "Excess height": replace(SOUND, mission=MissionParams(excess_height_m=value)),
        "Smoothing": replace(SOUND, surface=SurfaceParams(smooth_sigma_m=value)),
        "Largest hole to fill": replace(SOUND, surface=SurfaceParams(fill_hole_area_m2=value)),
        "Required clearance": replace(SOUND, required_clearance_m=value),
        "Maximum height above ground": replace(SOUND, max_height_above_ground_m=value),
    }
    for name, request in wrong.items():
        with pytest.raises(ParameterError, match=f"^{name} is "):
            check_request(request)


def test_zero_where_it_makes_sense() -> None:
    check_request(
        replace(
            SOUND,
            profile=replace(SOUND.profile, position_error_m=0.0, rtl_height_m=0.0),
            surface=SurfaceParams(smooth_sigma_m=0.0, fill_hole_area_m2=0.0),
            mission=MissionParams(excess_height_m=0.0),
        )
    )


@given(mean=st.floats(0.1, 20.0), top=st.floats(0.1, 50.0))
def test_speeds_agree_or_are_refused(mean: float, top: float) -> None:
    request = replace(SOUND, path=PathParams(mean_speed_m_s=mean, max_speed_m_s=top))
    if mean < top <= 2 * mean:
        check_request(request)
    else:
        with pytest.raises(ParameterError, match="contradict"):
            check_request(request)


@pytest.mark.parametrize("share", [1.0, -0.1, math.nan])
def test_reserve(share: float) -> None:
    with pytest.raises(ParameterError, match="Reserve is"):
        check_demands(replace(SOUND, profile=replace(SOUND.profile, reserve_share=share)))


def test_item_limit() -> None:
    with pytest.raises(ParameterError, match="3 mission items"):
        check_demands(replace(SOUND, profile=replace(SOUND.profile, max_items=3)))


def test_step_beyond_the_radius() -> None:
    with pytest.raises(ParameterError, match="larger than radius R"):
        check_request(replace(SOUND, path=PathParams(step_m=21.0)))


def test_ball_larger_than_the_model() -> None:
    dsm = make_dsm(size_px=60)
    check_size(replace(SOUND, surface=SurfaceParams(60.0, 60.0)), dsm)
    for surface, name in ((SurfaceParams(60.5, 5.0), "Radius R"), (SurfaceParams(20.0, 60.5), "Height H")):
        with pytest.raises(ParameterError, match=f"^{name} is 60.5 m, larger than the surface model"):
            check_size(replace(SOUND, surface=surface), dsm)


def test_required_clearance_by_default() -> None:
    demanded = SOUND.clearance()
    assert demanded.budget is not None
    # Position error, following, three times the model's RMS, downwash, vehicle radius.
    assert demanded.required_clearance_m == pytest.approx(2.5 + 1.1 + 0.069 + 0.593 + 0.35, abs=0.001)
    assert demanded.following_m == 1.1
    assert replace(SOUND, way="guided").clearance().following_m > 1.1
    faster = replace(SOUND, path=PathParams(mean_speed_m_s=8.0, max_speed_m_s=12.0))
    assert faster.clearance().following_m == pytest.approx(4 * 1.1)
    assert replace(SOUND, required_clearance_m=2.0).clearance().required_clearance_m == 2.0
