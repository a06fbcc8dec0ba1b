"""The inverse sensor model: from one radar scan to what each range bin says of being occupied (eqs 2, 3, 5, 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64, I8, I64, Bools
from mapping.uwb.thresholds import Thresholds
from mapping.uwb.uwb_params import UwbGeometry, UwbParams

UNTOLD, DETECTED, FREE_BEFORE, FREE_BEHIND = 0, 1, 2, 3
"""Regions along range: nothing is said; r1, r2 and r3 of the paper."""


@dataclass(frozen=True, slots=True)
class BinEvidence:
    """What a scan says of each range bin, straight ahead and before the distance scaler."""

    region: I8
    """(bins,) ``UNTOLD`` outside R_min..R_max and behind the last echo."""
    weight: F64
    """(bins,) G_pw G_pk P_O in r1, (1 - G_pw)(1 - P_C) in r2 and r3; 0 where nothing is said. Not yet held to 0.5."""
    peak: I64
    """(bins,) Number of the bin where the nearest peak above T_d is; -1 where there is none."""


def bin_evidence(scan: ArrayLike, thresholds: Thresholds, geometry: UwbGeometry, params: UwbParams) -> BinEvidence:
    """Regions and their scalers for one scan (bins,) of intensities."""
    intensity = np.asarray(scan, np.float64)
    over = intensity - thresholds.detection
    detected = over > 0.0
    region = regions(intensity, thresholds, geometry, params)
    power = power_scaler(over, thresholds, params)
    peak = nearest_peaks(intensity, detected)
    weight = np.zeros(len(intensity))
    here = region == DETECTED
    weight[here] = (power * peak_scaler(peak, params) * params.most_occupied)[here]  # Ahtiainen, eq. 2
    for which, least in ((FREE_BEFORE, params.free_before), (FREE_BEHIND, params.free_behind)):
        here = region == which
        weight[here] = (1.0 - power[here]) * (1.0 - least)  # Ahtiainen, eq. 3
    return BinEvidence(region, weight, peak)


def regions(intensity: F64, thresholds: Thresholds, geometry: UwbGeometry, params: UwbParams) -> I8:
    """(bins,) r1 above T_d, r2 free before the first detection above T_max, r3 after it; nothing behind the last."""
    range_m = bin_ranges(geometry)
    usable = (range_m >= params.nearest_m) & (range_m <= params.farthest_m)
    detected = usable & (intensity > thresholds.detection)
    strong = usable & (intensity > thresholds.highest)
    out = np.full(len(intensity), UNTOLD, np.int8)
    out[usable] = FREE_BEFORE
    if strong.any():
        out[usable & (np.arange(len(out)) > np.argmax(strong))] = FREE_BEHIND
    out[detected] = DETECTED
    if detected.any():
        out[np.flatnonzero(detected)[-1] + 1 :] = UNTOLD
    return out


def bin_ranges(geometry: UwbGeometry) -> F64:
    """(bins,) metres to the middle of each."""
    return geometry.first_bin_m + geometry.bin_m * np.arange(geometry.bins, dtype=np.float64)


def power_scaler(over: F64, thresholds: Thresholds, params: UwbParams) -> F64:
    """G_pw (eq. 5) of the intensity over T_d: 0.5 there, 0.9526 at T_max, 0.0067 at T_min.

    The sign of the printed exponential is a slip: with it the scaler would be negative.
    """
    above = params.above_scale * over / (thresholds.highest - thresholds.detection)
    below = params.below_scale * over / np.maximum(thresholds.detection - thresholds.lowest, 1e-6)
    return 1.0 / (1.0 + np.exp(-np.clip(np.where(over >= 0.0, above, below), -60.0, 60.0)))  # Ahtiainen, eq. 5


def nearest_peaks(intensity: F64, detected: Bools) -> I64:
    """(bins,) Number of the nearest bin above T_d that no neighbour exceeds; -1 without any."""
    padded = np.concatenate([[-np.inf], intensity, [-np.inf]])
    at = np.flatnonzero(detected & (intensity >= padded[:-2]) & (intensity >= padded[2:]))
    if len(at) == 0:
        return np.full(len(intensity), -1)
    return at[np.abs(np.arange(len(intensity))[:, None] - at[None, :]).argmin(axis=1)]


def peak_scaler(peak: I64, params: UwbParams) -> F64:
    """G_pk (eq. 6) by the distance in bins to the nearest peak above T_d, 1 at a peak.

    The curve is still 0.61 at four bins; that it "completely eliminates" what lies further away is a cut of ours.
    """
    away = np.abs(np.arange(len(peak)) - peak)
    curve = np.exp(-(away**2) / (2.0 * params.peak_sigma_bins**2))  # Ahtiainen, eq. 6
    return np.where((away <= params.peak_sigma_bins) & (peak >= 0), curve, 0.0)


def occupied(evidence: BinEvidence, bin_number: int) -> float:
    """P(z|occ) of a detection straight ahead, not held to 0.5: the numbers of Table II; NaN where none is detected."""
    # Ahtiainen, table II
    return float(evidence.weight[bin_number]) if evidence.region[bin_number] == DETECTED else float("nan")
