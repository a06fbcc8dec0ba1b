"""Melita 2020, section 6, written slowly: the LSPB law by integrating its acceleration in small steps."""

import numpy as np


def printed_law(length_m: float, mean_m_s: float, max_m_s: float) -> tuple[float, float, float]:
    """(t_f, t_b, a) as printed, whatever acceleration that takes."""
    t_f = length_m / mean_m_s
    t_b = t_f - length_m / max_m_s
    return t_f, t_b, max_m_s / t_b


def integrated(t_f: float, t_b: float, a: float, times_s: np.ndarray, steps: int = 20_000) -> np.ndarray:
    """Positions at the times, by the midpoint rule on the piecewise constant acceleration."""
    edges = np.linspace(0.0, t_f, steps + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    acceleration = np.where(middle < t_b, a, np.where(middle > t_f - t_b, -a, 0.0))
    dt = t_f / steps
    speed = np.concatenate([[0.0], np.cumsum(acceleration) * dt])
    position = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2) * dt])
    return np.interp(times_s, edges, position)
