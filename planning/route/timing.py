"""When the path's law reaches each sample."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import PathParams, SampledPath, Timing
from planning.errors import ParameterError
from planning.route.lspb import lspb
from planning.route.slopes import speed_caps


def path_timing(path: SampledPath, params: PathParams, *, loiter_s: F64 | None = None) -> Timing:
    """LSPB from vertex to vertex (Melita 2020, section 6), waiting ``loiter_s`` (V,) at each vertex.

    With ``on_steep`` "slow" the speed also stays below what the vertical limits allow on each
    step, and approaches those caps within the acceleration limit.
    """
    waits_s = _waits(path, loiter_s)
    step_s, speed_m_s = np.zeros(len(path.s_m)), np.zeros(len(path.s_m))
    for first, last in zip(path.vertex[:-1], path.vertex[1:], strict=True):
        part = slice(int(first), int(last) + 1)
        t_s, speed_m_s[part] = _segment(path.s_m[part], path.alt_dsm_m[part], params)
        step_s[first + 1 : last + 1] = np.diff(t_s)
    return Timing(t_s=np.cumsum(step_s + waits_s), speed_m_s=speed_m_s, loiter_s=waits_s)


def _segment(s_m: F64, alt_m: F64, params: PathParams) -> tuple[F64, F64]:
    law = lspb(float(s_m[-1] - s_m[0]), params)
    t_s = law.time_s(s_m - s_m[0])
    speed_m_s = law.speed_m_s(t_s)
    speed_m_s[[0, -1]] = 0.0
    return _slowed(s_m, alt_m, speed_m_s, params) if params.on_steep == "slow" else (t_s, speed_m_s)


def _slowed(s_m: F64, alt_m: F64, speed_m_s: F64, params: PathParams) -> tuple[F64, F64]:
    """Cap the speeds, then let v^2 change by at most ``2 a ds``; v^2 is linear in s on every step."""
    cap_m_s = speed_caps(s_m, alt_m, params)
    squared = speed_m_s**2
    squared[:-1] = np.minimum(squared[:-1], cap_m_s**2)
    squared[1:] = np.minimum(squared[1:], cap_m_s**2)
    shear = 2 * params.max_accel_m_s2 * (s_m - s_m[0])
    squared = np.minimum.accumulate(squared - shear) + shear
    squared = np.minimum.accumulate((squared + shear)[::-1])[::-1] - shear
    speed = np.sqrt(np.maximum(squared, 0.0))
    speed[[0, -1]] = 0.0
    both = speed[1:] + speed[:-1]
    if len(both) == 1:
        # One step from rest to rest: no sample in between carries the peak speed.
        peak = min(math.sqrt(params.max_accel_m_s2 * (s_m[-1] - s_m[0])), float(cap_m_s[0]))
        both = np.array([peak])
    return np.concatenate([[0.0], np.cumsum(2 * np.diff(s_m) / both)]), speed


def _waits(path: SampledPath, loiter_s: F64 | None) -> F64:
    waits_s = np.zeros(len(path.s_m))
    if loiter_s is None:
        return waits_s
    given_s = np.asarray(loiter_s, dtype=np.float64)
    if given_s.shape != path.vertex.shape:
        raise ParameterError(f"{len(path.vertex)} vertices came with {given_s.size} loiter times.")
    bad = np.flatnonzero(~(np.isfinite(given_s) & (given_s >= 0)))
    if bad.size:
        raise ParameterError(
            f"The loiter time is {given_s[bad[0]]} s.",
            where=f"vertex {bad[0] + 1} of the path",
            advice="Give zero or a positive number of seconds.",
        )
    waits_s[path.vertex] = given_s
    return waits_s
