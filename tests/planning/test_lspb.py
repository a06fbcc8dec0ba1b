"""The timing law of one segment."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.basics.plan_model import PathParams
from planning.errors import ParameterError
from planning.route.lspb import lspb
from tests.reference.lspb import integrated, printed_law

lengths = st.floats(0.05, 2000)
speeds = st.tuples(st.floats(0.3, 15), st.floats(1.01, 2.0), st.floats(0.2, 8)).map(
    lambda v: PathParams(mean_speed_m_s=v[0], max_speed_m_s=v[0] * v[1], max_accel_m_s2=v[2])
)


@settings(deadline=None)
@given(lengths, speeds)
def test_ends_speed_and_acceleration(length: float, params: PathParams) -> None:
    law = lspb(length, params)
    t = np.linspace(0, law.duration_s, 101)
    np.testing.assert_allclose(law.position_m(t[[0, -1]]), [0, length], atol=1e-9 * length)
    np.testing.assert_allclose(law.speed_m_s(t[[0, -1]]), 0, atol=1e-9)
    assert law.speed_m_s(t).max() <= params.max_speed_m_s * (1 + 1e-12)
    assert np.abs(law.acceleration_m_s2(t)).max() <= params.max_accel_m_s2 * (1 + 1e-9)
    assert 2 * law.blend_s <= law.duration_s * (1 + 1e-9)
    assert law.duration_s >= length / params.mean_speed_m_s * (1 - 1e-9)


@settings(deadline=None)
@given(st.floats(1, 500), speeds)
def test_positions_are_the_integral_of_the_acceleration(length: float, params: PathParams) -> None:
    law = lspb(length, params)
    t = np.linspace(0, law.duration_s, 37)
    slow = integrated(law.duration_s, law.blend_s, law.accel_m_s2, t, steps=20_000)
    # The blends end inside a step: a speed error of one step's acceleration, carried to the end.
    np.testing.assert_allclose(law.position_m(t), slow, atol=law.accel_m_s2 * law.duration_s**2 / 20_000)


@settings(deadline=None)
@given(lengths, speeds, st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_the_inverse_leads_back(length: float, params: PathParams, shares: list[float]) -> None:
    law = lspb(length, params)
    s = np.sort(np.array(shares)) * length
    t = law.time_s(s)
    assert np.all(np.diff(t) >= 0)
    np.testing.assert_allclose(law.position_m(t), s, atol=1e-7 * length)


def test_a_long_segment_follows_the_printed_law() -> None:
    law = lspb(100.0, PathParams(mean_speed_m_s=3, max_speed_m_s=5, max_accel_m_s2=2.5))
    t_f, t_b, a = printed_law(100.0, 3, 5)
    assert (law.duration_s, law.blend_s, law.accel_m_s2) == pytest.approx((t_f, t_b, a))
    assert law.peak_m_s == 5


def test_a_short_segment_would_demand_nineteen_m_s2() -> None:
    assert printed_law(2.0, 3, 5)[2] > 18
    law = lspb(2.0, PathParams(mean_speed_m_s=3, max_speed_m_s=5, max_accel_m_s2=2.5))
    assert law.accel_m_s2 == pytest.approx(2.5)
    assert law.peak_m_s == pytest.approx(np.sqrt(2.0 * 2.5))
    assert law.duration_s == pytest.approx(2 * law.blend_s)


@settings(deadline=None)
@given(speeds)
def test_the_duration_grows_continuously_with_the_length(params: PathParams) -> None:
    reach = params.max_speed_m_s**2 / params.max_accel_m_s2
    lengths_m = np.linspace(0.01 * reach, 30 * reach, 3000)
    t = np.array([lspb(float(length), params).duration_s for length in lengths_m])
    assert np.all(np.diff(t) > 0)
    slack_s = 1 / params.mean_speed_m_s - 1 / params.max_speed_m_s
    for joint in (reach, params.max_speed_m_s / (params.max_accel_m_s2 * slack_s)):
        below, above = lspb(joint * (1 - 1e-9), params), lspb(joint * (1 + 1e-9), params)
        assert below.duration_s == pytest.approx(above.duration_s, rel=1e-7)


@pytest.mark.parametrize(("mean", "top"), [(5, 5), (5, 4), (2, 4.1)])
def test_contradictory_speeds_are_refused_with_advice(mean: float, top: float) -> None:
    with pytest.raises(ParameterError, match="contradict") as error:
        lspb(10.0, PathParams(mean_speed_m_s=mean, max_speed_m_s=top))
    assert "maximum speed above" in error.value.advice


@pytest.mark.parametrize("field", ["mean_speed_m_s", "max_speed_m_s", "max_accel_m_s2"])
@pytest.mark.parametrize("value", [0.0, -2.0, float("nan")])
def test_numbers_must_be_positive(field: str, value: float) -> None:
    with pytest.raises(ParameterError):
        lspb(10.0, replace(PathParams(), **{field: value}))


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf")])
def test_a_segment_must_have_a_length(length: float) -> None:
    with pytest.raises(ParameterError):
        lspb(length, PathParams())


def test_twice_the_mean_speed_is_a_triangle() -> None:
    law = lspb(1000.0, PathParams(mean_speed_m_s=3, max_speed_m_s=6))
    assert law.duration_s == pytest.approx(2 * law.blend_s)
    assert law.position_m(np.array([law.blend_s])) == pytest.approx(500)
