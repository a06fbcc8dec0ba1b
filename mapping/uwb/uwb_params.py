"""Numbers of the UWB radar and of its sensor model: the paper's, and the few of our own, marked as such."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from mapping.errors import ParameterError

Rule = Literal["explained", "paper"]
"""How echoes are fused: ours, where an echo that a likely obstacle accounts for says little of other cells, or the
paper's, where every cell at its range is to blame."""


@dataclass(frozen=True, slots=True)
class UwbGeometry:
    """How a scan's numbers lie in range, and the beam's width (Table I)."""

    bins: int = 256
    bin_m: float = 0.30
    first_bin_m: float = 0.0
    """Range of the middle of the first bin."""
    beamwidth_rad: float = math.radians(40.0)
    """theta: the whole beam."""

    def __post_init__(self) -> None:
        if not (self.bins >= 8 and math.isfinite(self.first_bin_m) and 0.0 < self.bin_m <= 10.0):
            raise ParameterError(
                f"{self.bins} range bins of {self.bin_m:g} m, the first at {self.first_bin_m:g} m, are no UWB radar's.",
                advice="Give at least 8 bins of up to 10 m.",
            )
        if not 0.0 < self.beamwidth_rad < math.pi:
            raise ParameterError(f"A beam of {math.degrees(self.beamwidth_rad):g} deg is no UWB radar's.")


@dataclass(frozen=True, slots=True)
class UwbParams:
    """Of the sensor model (section III). Raises ParameterError for numbers that contradict each other."""

    nearest_m: float = 3.5
    """R_min"""
    farthest_m: float = 10.0
    """R_max"""
    least_headroom: float = 3.0
    """c_th of eq. 1, in units of the radar's intensity."""
    most_occupied: float = 0.8
    """P_O"""
    free_before: float = 0.2
    """P_C2"""
    free_behind: float = 0.3
    """P_C3"""
    above_scale: float = 3.0
    """c of eq. 5 above the detection threshold: 0.9526 at T_max."""
    below_scale: float = 5.0
    """c of eq. 5 below it: 0.0067 at T_min."""
    peak_sigma_bins: float = 4.0
    """sigma of eq. 6; bins further away from a peak than this say nothing."""
    prior: float = 0.9
    """That an untraversable cell is an obstacle, before the radar has seen it. Ours: the paper only says "high"."""
    explained_apart_m: float = 0.9
    """Ours: an echo that an untraversable cell at least so far away accounts for says less of this one. Three range
    bins: one thing's echo spans as many (fig. 2), so that no part of it is taken for another thing. Infinite: every
    cell is to blame for every echo, as in the paper."""
    learning_scans: int = 20
    """Of traversable ground, before thresholds are believed."""
    seen_s: float = 2.0
    """A cell counts as seen after more than this in view."""
    longest_gap_s: float = 0.5
    """Of time in view between two scans; more is a pause of the log."""

    def __post_init__(self) -> None:
        if not 0.0 < self.nearest_m < self.farthest_m < math.inf:
            raise ParameterError(f"The radar is to be used from {self.nearest_m:g} to {self.farthest_m:g} m.")
        if not (0.5 < self.most_occupied < 1.0 and 0.0 < self.free_before <= self.free_behind < 0.5):
            raise ParameterError(
                f"P_O = {self.most_occupied:g}, P_C2 = {self.free_before:g} and P_C3 = {self.free_behind:g}.",
                advice="P_O lies between 0.5 and 1, 0 < P_C2 <= P_C3 < 0.5.",
            )
        if not (0.5 < self.prior < 1.0 and self.least_headroom > 0.0 and self.learning_scans >= 2):
            raise ParameterError(f"The prior, c_th or the number of scans of {self} make no sense.")
        if not self.explained_apart_m > 0.0:
            raise ParameterError(
                f"Cells that are {self.explained_apart_m:g} m apart cannot explain each other's echoes.",
                advice="Give a distance above 0, or infinity for the paper's own rule.",
            )


def of_rule(rule: Rule, **numbers: float | None) -> UwbParams:
    """That rule with the paper's numbers, but for those that are given. Raises ParameterError.

    P_C3 follows P_C2, 0.1 above it as in fig. 9, unless it is given itself.
    """
    given = {name: value for name, value in numbers.items() if value is not None}
    for name, value in given.items():
        if not math.isfinite(value):
            raise ParameterError(f"{name} is {value:g}.", where="UWB radar", advice="Give a number.")
    if "free_before" in given:
        given.setdefault("free_behind", given["free_before"] + 0.1)
    usual = UwbParams(explained_apart_m=math.inf) if rule == "paper" else UwbParams()
    return replace(usual, **given)


def in_words(params: UwbParams) -> str:
    """For operators: which rule, and its numbers."""
    rule = "the paper's rule" if math.isinf(params.explained_apart_m) else "echoes explained"
    p = params
    return (
        f"{rule}; P_O {p.most_occupied:g}, P_C2 {p.free_before:g}, P_C3 {p.free_behind:g}, c_th "
        f"{p.least_headroom:g}, {p.nearest_m:g} to {p.farthest_m:g} m, prior {p.prior:g}"
    )
