"""Equation 1 and its inverse."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.basics.plan_model import Camera
from planning.errors import ParameterError
from planning.route.camera import footprint_m, gsd_cm, height_from_gsd_m

CAMERA = Camera(6000, 4000, 20.0, 23.5, 15.6)


def test_equation_1_by_hand() -> None:
    assert height_from_gsd_m(CAMERA, 1.0) == pytest.approx(6000 * 1.0 * 20 / (23.5 * 100))


@settings(deadline=None)
@given(st.floats(0.05, 100))
def test_height_and_gsd_are_inverse(cm: float) -> None:
    assert gsd_cm(CAMERA, height_from_gsd_m(CAMERA, cm)) == pytest.approx(cm)


@settings(deadline=None)
@given(st.floats(1, 200))
def test_the_footprint_is_the_pixels_times_the_gsd(height_m: float) -> None:
    across_m, along_m = footprint_m(CAMERA, height_m)
    assert across_m == pytest.approx(6000 * gsd_cm(CAMERA, height_m) / 100)
    assert along_m == pytest.approx(across_m * 15.6 / 23.5)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_figures_must_be_positive(value: float) -> None:
    with pytest.raises(ParameterError):
        height_from_gsd_m(CAMERA, value)
    with pytest.raises(ParameterError):
        gsd_cm(CAMERA, value)
    with pytest.raises(ParameterError, match="focal"):
        footprint_m(replace(CAMERA, focal_mm=value), 10.0)
