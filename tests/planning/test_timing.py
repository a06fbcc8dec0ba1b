"""When the path's law reaches each sample."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.basics.plan_model import PathParams, SampledPath
from planning.errors import ParameterError
from planning.route.lspb import lspb
from planning.route.timing import path_timing


def straight(alt_m: np.ndarray, vertex: list[int], step_m: float = 0.1) -> SampledPath:
    s = np.arange(len(alt_m), dtype=np.float64) * step_m
    pois = tuple(range(len(vertex)))
    return SampledPath(np.column_stack([s, 0 * s]), s, alt_m, alt_m, alt_m, np.array(vertex), pois)


def test_segments_and_loiter_times_add_up() -> None:
    path, params = straight(np.zeros(801), [0, 300, 800]), PathParams()
    timing = path_timing(path, params, loiter_s=np.array([1.5, 4.0, 2.0]))
    first, second = lspb(30.0, params), lspb(50.0, params)
    assert timing.t_s[0] == 1.5
    assert timing.t_s[299] < 1.5 + first.duration_s
    assert timing.t_s[300] == pytest.approx(5.5 + first.duration_s)
    assert timing.t_s[-1] == pytest.approx(7.5 + first.duration_s + second.duration_s)
    assert timing.loiter_s[[0, 300, 800]].tolist() == [1.5, 4.0, 2.0]
    assert timing.loiter_s.sum() == 7.5
    assert timing.speed_m_s[[0, 300, 800]].tolist() == [0, 0, 0]
    assert timing.speed_m_s.max() == pytest.approx(5.0)


def test_without_loiter_times_nothing_waits() -> None:
    timing = path_timing(straight(np.zeros(101), [0, 100]), PathParams())
    assert timing.t_s[0] == 0
    assert not timing.loiter_s.any()


@settings(deadline=None)
@given(st.integers(2, 400), st.floats(0.0, 3.0), st.floats(1.0, 40.0))
def test_slow_mode_keeps_the_vertical_speeds_and_the_acceleration(n: int, height_m: float, wave_m: float) -> None:
    s = np.arange(n, dtype=np.float64) * 0.1
    path = straight(height_m * np.sin(2 * np.pi * s / wave_m), [0, n - 1])
    params = PathParams(on_steep="slow")
    timing = path_timing(path, params)
    dt, rise = np.diff(timing.t_s), np.diff(path.alt_dsm_m)
    assert np.all(dt > 0)
    assert np.all(rise / dt <= params.max_climb_m_s * (1 + 1e-6))
    assert np.all(rise / dt >= -params.max_descent_m_s * (1 + 1e-6))
    assert np.all(np.diff(timing.speed_m_s**2) <= 2 * params.max_accel_m_s2 * 0.1 + 1e-9)
    assert np.all(np.diff(timing.speed_m_s**2) >= -2 * params.max_accel_m_s2 * 0.1 - 1e-9)
    assert timing.t_s[-1] >= lspb(float(s[-1]), params).duration_s * (1 - 1e-9)


def test_slow_mode_on_level_ground_is_the_plain_law() -> None:
    path = straight(np.zeros(1001), [0, 1000])
    slow, plain = path_timing(path, PathParams(on_steep="slow")), path_timing(path, PathParams())
    np.testing.assert_allclose(slow.t_s, plain.t_s, rtol=2e-3)
    assert slow.t_s[-1] == pytest.approx(plain.t_s[-1], rel=1e-3)


@pytest.mark.parametrize("loiter_s", [[0.0, -1.0], [float("nan"), 0.0], [0.0]])
def test_useless_loiter_times_are_refused(loiter_s: list[float]) -> None:
    with pytest.raises(ParameterError, match="loiter"):
        path_timing(straight(np.zeros(11), [0, 10]), PathParams(), loiter_s=np.array(loiter_s))
