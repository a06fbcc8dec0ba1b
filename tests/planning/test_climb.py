"""The height profile under climb and descent limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planning.climb import limited_heights, slope_limits, smallest_profile, speed_caps
from planning.errors import ParameterError
from planning.model import PathParams
from tests.reference.climb import supremum_of_cones

surfaces = arrays(np.float64, st.integers(2, 60), elements=st.floats(-50, 50))
steps = st.floats(0.05, 2.0)
slopes = st.floats(0.05, 3.0)


@settings(deadline=None)
@given(surfaces, steps, slopes, slopes)
def test_it_is_the_supremum_of_the_cones(surface: np.ndarray, step: float, climb: float, descent: float) -> None:
    s = np.arange(len(surface), dtype=np.float64) * step
    profile = smallest_profile(s, surface, climb=climb, descent=descent)
    np.testing.assert_allclose(profile, supremum_of_cones(s, surface, climb, descent), atol=1e-9)


@settings(deadline=None)
@given(surfaces, steps, slopes, slopes)
def test_it_is_feasible_and_nowhere_below_the_surface(
    surface: np.ndarray, step: float, climb: float, descent: float
) -> None:
    s = np.arange(len(surface), dtype=np.float64) * step
    profile = smallest_profile(s, surface, climb=climb, descent=descent)
    rise = np.diff(profile)
    assert np.all(profile >= surface)
    assert np.all(rise <= climb * step + 1e-9)
    assert np.all(rise >= -descent * step - 1e-9)


@settings(deadline=None)
@given(surfaces, steps, slopes, slopes)
def test_once_is_enough(surface: np.ndarray, step: float, climb: float, descent: float) -> None:
    s = np.arange(len(surface), dtype=np.float64) * step
    once = smallest_profile(s, surface, climb=climb, descent=descent)
    np.testing.assert_allclose(smallest_profile(s, once, climb=climb, descent=descent), once, atol=1e-9)


@settings(deadline=None)
@given(surfaces, steps, slopes, slopes, st.data())
def test_no_sample_could_be_lower(
    surface: np.ndarray, step: float, climb: float, descent: float, data: st.DataObject
) -> None:
    s = np.arange(len(surface), dtype=np.float64) * step
    profile = smallest_profile(s, surface, climb=climb, descent=descent)
    other = smallest_profile(s, profile + data.draw(st.floats(0, 5)), climb=climb, descent=descent)
    lowered = np.minimum(profile + 1.0, other)
    assert np.all(lowered >= profile - 1e-9)
    i = data.draw(st.integers(0, len(s) - 1))
    sunk = profile.copy()
    sunk[i] -= 0.01
    feasible = np.all(np.diff(sunk) <= climb * step + 1e-12) and np.all(np.diff(sunk) >= -descent * step - 1e-12)
    assert not (feasible and sunk[i] >= surface[i])


def test_slopes_are_those_at_the_maximum_speed() -> None:
    assert slope_limits(PathParams(max_speed_m_s=5, max_climb_m_s=2.5, max_descent_m_s=1.5)) == (0.5, 0.3)


@pytest.mark.parametrize("name", ["max_climb_m_s", "max_descent_m_s", "max_speed_m_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_limits_must_be_positive(name: str, value: float) -> None:
    with pytest.raises(ParameterError):
        slope_limits(replace(PathParams(), **{name: value}))


@settings(deadline=None)
@given(surfaces)
def test_a_raised_path_never_needs_to_slow_down(surface: np.ndarray) -> None:
    params = PathParams()
    s = np.arange(len(surface), dtype=np.float64) * 0.1
    caps = speed_caps(s, limited_heights(s, surface, params), params)
    np.testing.assert_allclose(caps, params.max_speed_m_s, rtol=1e-6)


@settings(deadline=None)
@given(surfaces)
def test_at_the_caps_the_vertical_speeds_hold(surface: np.ndarray) -> None:
    params = PathParams()
    s = np.arange(len(surface), dtype=np.float64) * 0.1
    vertical = speed_caps(s, surface, params) * np.diff(surface) / np.diff(s)
    assert np.all(vertical <= params.max_climb_m_s * (1 + 1e-9))
    assert np.all(vertical >= -params.max_descent_m_s * (1 + 1e-9))
