"""Relief shading and height colours of a surface model, for the report's map and the 3-D view."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from mapping.geometry.arrays import F64, U8
from planning.terrain.dsm import Dsm

SUN_AZIMUTH_DEG = 315.0
"""Light from the upper left, as maps have it: from elsewhere, relief reads inverted."""
SUN_ELEVATION_DEG = 45.0
UNKNOWN_RGB = (148, 148, 152)
_SHADES = 256


def hillshade(dsm: Dsm, *, exaggeration: float = 1.0) -> U8:
    """Lambertian relief shading.

    Horn 1981: brightness is the cosine between surface normal and sun, here from central differences.
    Returns (H, W) uint8; next to unknown cells the slope is one-sided, unknown cells are shaded as flat.
    """
    azimuth, elevation = math.radians(SUN_AZIMUTH_DEG), math.radians(SUN_ELEVATION_DEG)
    sun_enu = np.array(
        [
            math.sin(azimuth) * math.cos(elevation),
            math.cos(azimuth) * math.cos(elevation),
            math.sin(elevation),
        ]
    )
    return _shade(dsm.elevation_m, dsm.resolution_m / exaggeration, sun_enu)


@nb.njit(cache=True, parallel=True, nogil=True)
def _shade(z, step_m, sun_enu):
    rows, cols = z.shape
    out = np.empty((rows, cols), np.uint8)
    for i in nb.prange(rows):
        for j in range(cols):
            east = _slope(z[i, max(j - 1, 0)], z[i, j], z[i, min(j + 1, cols - 1)]) / step_m
            south = _slope(z[max(i - 1, 0), j], z[i, j], z[min(i + 1, rows - 1), j]) / step_m
            # The normal is (-dz/deast, -dz/dnorth, 1), and rows run south.
            light = -east * sun_enu[0] + south * sun_enu[1] + sun_enu[2]
            out[i, j] = int(max(0.0, min(1.0, light / math.sqrt(1.0 + east * east + south * south))) * 255 + 0.5)
    return out


@nb.njit(cache=True, nogil=True)
def _slope(before, here, after):
    """Height gained per cell; 0 where it cannot be told."""
    if np.isnan(here):
        return 0.0
    if np.isnan(before):
        return 0.0 if np.isnan(after) else float(after - here)
    return float(here - before) if np.isnan(after) else 0.5 * float(after - before)


def height_colors(dsm: Dsm, *, low_m: float | None = None, high_m: float | None = None) -> U8:
    """Height as colour, (H, W, 3) uint8 sRGB; unknown cells grey.

    The scale runs from ``low_m`` to ``high_m``, by default the model's lowest and highest known cell.
    """
    low = float(np.nanmin(dsm.elevation_m)) if low_m is None else low_m
    high = float(np.nanmax(dsm.elevation_m)) if high_m is None else high_m
    return _colored(dsm.elevation_m, low, max(high - low, 1e-6), scale_rgb(_SHADES), np.array(UNKNOWN_RGB, np.uint8))


@nb.njit(cache=True, parallel=True, nogil=True)
def _colored(z, low_m, span_m, scale, unknown):
    rows, cols = z.shape
    out = np.empty((rows, cols, 3), np.uint8)
    last = scale.shape[0] - 1
    for i in nb.prange(rows):
        for j in range(cols):
            if np.isnan(z[i, j]):
                out[i, j] = unknown
            else:
                share = max(0.0, min(1.0, (z[i, j] - low_m) / span_m))
                out[i, j] = scale[int(share * last + 0.5)]
    return out


def scale_rgb(count: int) -> U8:
    """The height scale from low to high, (count, 3) uint8 sRGB.

    Perceptually uniform: lightness and hue advance in equal steps in OKLCh (Ottosson 2020), from deep
    blue over green to pale yellow, so that equal height differences look equally different, in grey too.
    """
    share = np.linspace(0.0, 1.0, count)
    lightness, chroma = 0.36 + 0.58 * share, 0.085 + 0.03 * share
    hue = np.radians(262.0 - 162.0 * share)
    lab = np.column_stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)])
    linear = (lab @ _LMS_FROM_OKLAB.T) ** 3 @ _RGB_FROM_LMS.T
    return np.round(255 * _srgb(np.clip(linear, 0.0, 1.0))).astype(np.uint8)


_LMS_FROM_OKLAB = np.array(
    [[1.0, 0.3963377774, 0.2158037573], [1.0, -0.1055613458, -0.0638541728], [1.0, -0.0894841775, -1.2914855480]]
)
_RGB_FROM_LMS = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)


def _srgb(linear: F64) -> F64:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
