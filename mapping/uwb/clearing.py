"""Fusion: an untraversable cell that the radar keeps seeing through becomes soft vegetation (section III-C)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.errors import ParameterError
from mapping.geometry.arrays import F32, F64, Bools
from mapping.traversability import Traversability
from mapping.uwb.fusion import fuse, view_is_clear
from mapping.uwb.sensor_model import bin_evidence
from mapping.uwb.thresholds import Learning, Thresholds
from mapping.uwb.uwb_params import UwbGeometry, UwbParams


@dataclass(frozen=True, slots=True)
class UwbPose:
    """Of the radar when it scanned; in the grid's own frame: x east, y north along its columns and rows."""

    t_s: float
    x_m: float
    y_m: float
    heading_rad: float
    """Of the beam's axis, clockwise from the grid's north."""


@dataclass(frozen=True, slots=True)
class Cleared:
    """The augmented map T_ma and the evidence behind it; all (rows, cols)."""

    probability: F32
    """Of being an obstacle: 0 to 1; NaN unknown. Cells that T_m calls traversable keep T_m's value."""
    time_in_view_s: F32
    cleared: Bools
    """Untraversable in T_m, and now more likely free: a rover may pass, a rotor may not touch."""
    seen: Bools
    """Untraversable in T_m and in view for more than 2 s."""


class UwbClearing:
    """Learns thresholds from scans of traversable ground and clears foliage with all others, scan by scan.

    ``west_m, north_m`` is the outer corner of cell (0, 0), in the frame of the poses; rows run south.
    """

    def __init__(
        self,
        traversability: Traversability,
        *,
        geometry: UwbGeometry | None = None,
        params: UwbParams | None = None,
        west_m: float = 0.0,
        north_m: float = 0.0,
    ) -> None:
        self.geometry = geometry or UwbGeometry()
        self.params = params or UwbParams()
        self.learning = Learning(self.geometry.bins)
        self._map = traversability
        self._corner = (west_m, north_m)
        self._blocked = traversability.untraversable
        self._open = traversability.known & ~self._blocked
        prior = math.log(self.params.prior / (1.0 - self.params.prior))
        self._log_odds = np.where(self._blocked, np.float32(prior), np.float32(0.0))
        self.time_in_view_s: F32 = np.zeros(self._blocked.shape, np.float32)
        self._last_t_s = math.nan
        self._thresholds: Thresholds | None = None

    @property
    def thresholds(self) -> Thresholds | None:
        """None until enough traversable ground has been scanned."""
        if self._thresholds is None and self.learning.scans >= self.params.learning_scans:
            self._thresholds = self.learning.thresholds(self.params.least_headroom)
        return self._thresholds

    def learn(self, scan: ArrayLike, pose: UwbPose) -> bool:
        """Takes the scan for the thresholds if its whole field of view is traversable; says whether it did."""
        intensity = self._checked(scan, pose)
        p, g = self.params, self.geometry
        if not view_is_clear(self._open, self._local(pose), p.nearest_m, p.farthest_m, g.beamwidth_rad / 2.0):
            return False
        self.learning.take(intensity)
        self._thresholds = None
        return True

    def step(self, scan: ArrayLike, pose: UwbPose, *, learn: bool = True) -> bool:
        """One scan (bins,) as it arrives: learnt from if it may be, then fused. Says whether it was fused.

        Scans before there are thresholds, or that are not later than the one before, are not. Raises ParameterError
        for a scan of another length or with numbers that are not finite.
        """
        intensity = self._checked(scan, pose)
        gap_s = pose.t_s - self._last_t_s
        self._last_t_s = pose.t_s
        if learn:
            self.learn(intensity, pose)
        thresholds = self.thresholds
        if thresholds is None or not gap_s > 0.0:
            return False
        evidence = bin_evidence(intensity, thresholds, self.geometry, self.params)
        fuse(
            self._log_odds,
            self.time_in_view_s,
            self._blocked,
            self._local(pose),
            evidence.region,
            evidence.weight,
            evidence.peak,
            (self.geometry.first_bin_m, self.geometry.bin_m, self.geometry.beamwidth_rad),
            (self.params.nearest_m, self.params.farthest_m),
            min(gap_s, self.params.longest_gap_s),
            self.params.explained_apart_m,
        )
        return True

    def result(self) -> Cleared:
        """The map as it is now; a copy."""
        chance = (1.0 / (1.0 + np.exp(-self._log_odds))).astype(np.float32)
        probability = np.where(self._blocked, chance, self._map.value)
        seen = self._blocked & (self.time_in_view_s > self.params.seen_s)
        return Cleared(probability, self.time_in_view_s.copy(), self._blocked & (chance < 0.5), seen)

    def _local(self, pose: UwbPose) -> tuple[float, float, float, float]:
        """Fractional row and column of the radar (k + 0.5 is the middle of cell k), heading, metres per cell."""
        cell_m = self._map.resolution_m
        west_m, north_m = self._corner
        return (north_m - pose.y_m) / cell_m, (pose.x_m - west_m) / cell_m, pose.heading_rad, cell_m

    def _checked(self, scan: ArrayLike, pose: UwbPose) -> F64:
        intensity = np.asarray(scan, np.float64)
        if intensity.shape != (self.geometry.bins,) or not np.isfinite(intensity).all():
            raise ParameterError(
                f"A scan of shape {intensity.shape} is not {self.geometry.bins} finite intensities.",
                where=f"t = {pose.t_s:g} s",
                advice="Check the log's number of range bins.",
            )
        if not all(math.isfinite(number) for number in (pose.t_s, pose.x_m, pose.y_m, pose.heading_rad)):
            raise ParameterError(f"The pose {pose} is not finite.", where="pose")
        return intensity


def clear(
    traversability: Traversability,
    scans: NDArray[Any],
    poses: Iterable[UwbPose],
    *,
    geometry: UwbGeometry | None = None,
    params: UwbParams | None = None,
    west_m: float = 0.0,
    north_m: float = 0.0,
) -> tuple[Cleared, UwbClearing]:
    """A whole log at once, (scans, bins): thresholds first, from all of its scans of traversable ground, as the paper.

    Raises ParameterError when too few scans look at nothing but traversable ground, or when no time passes.
    """
    clearing = UwbClearing(traversability, geometry=geometry, params=params, west_m=west_m, north_m=north_m)
    places = list(poses)
    for scan, pose in zip(scans, places, strict=True):
        clearing.learn(scan, pose)
    if clearing.thresholds is None:
        raise ParameterError(
            f"{clearing.learning.scans} of {len(places)} scans look at nothing but traversable ground, "
            f"{clearing.params.learning_scans} are needed to know what bare ground returns.",
            where="UWB log",
            advice="Begin the log with a few metres of open ground ahead, inside the surface model.",
        )
    fused = sum(clearing.step(scan, pose, learn=False) for scan, pose in zip(scans, places, strict=True))
    if not fused:
        raise ParameterError(
            "No time passes from scan to scan.", where="UWB log", advice="Give each scan its own time, in seconds."
        )
    return clearing.result(), clearing
