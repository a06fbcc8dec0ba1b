"""The smallest profile within slope limits as its definition says: the supremum of cones, in quadratic time."""

import numpy as np


def supremum_of_cones(s_m: np.ndarray, surface_m: np.ndarray, climb: float, descent: float) -> np.ndarray:
    """Over each place, the highest cone of any sample: it falls by ``descent`` ahead and by ``climb`` behind."""
    out = np.empty(len(s_m))
    for i in range(len(s_m)):
        out[i] = max(
            surface_m[j] - (descent * (s_m[i] - s_m[j]) if j <= i else climb * (s_m[j] - s_m[i]))
            for j in range(len(s_m))
        )
    return out
