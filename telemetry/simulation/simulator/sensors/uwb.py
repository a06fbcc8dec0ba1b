"""A simulated UWB radar (RaDeKL, Table I) over grass, calibrated on the paper's Table II and fig. 6.

Echoes add up as powers; the detector answers to what exceeds a least power, in whole counts, over the ground's own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from mapping.geometry.arrays import F64, U8, Bools
from mapping.uwb.uwb_params import UwbGeometry
from telemetry.simulation.simulator.sensors.uwb_scene import UwbScene, chords

EXTINCTION, EXTINCTION_POWER = 0.096, 2.24
"""There and back through n layers exp(-0.096 n^2.24) is left: 0.91, 0.64, 0.32, 0.12 and 0.03 for one to five, so
that fig. 6's bricks are still seen behind four layers and no longer behind five."""
LAYERS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0)
ECHO_M2_PER_M = (0.0, 0.005, 0.015, 0.06, 0.85, 0.70, 0.70)
"""Cross section of so many layers, per metre across the beam: fig. 6's own obstacle at four layers, less at five,
where more is scattered away than back."""


GAP_M = 0.1
"""Between clumps along a ray; with less they are one."""


@dataclass(frozen=True, slots=True)
class UwbModel:
    """The radar's numbers; powers are in m2 of cross section at 10 m on the axis."""

    geometry: UwbGeometry = field(default_factory=UwbGeometry)
    counts_per_m2: float = 10.3
    least_m2: float = 0.084
    """Below it the detector answers nothing: the stone and the box of Table II cannot be told from the ground."""
    pulse_sigma_m: float = 0.17
    """Of an echo's shape over range: 400 MHz, and three bins above the threshold as in fig. 2."""
    aspects: int = 36
    """Sides of a thing, each with an echo of its own, exponential around the mean (Swerling's first case); 0: the face
    that was measured for Table II from everywhere."""
    ground_counts: float = 22.0
    """Mean return of bare ground at 10 m, over ``dark_counts``."""
    dark_counts: float = 8.0
    speckle_counts: float = 2.1
    """Mean of that part of it which differs from place to place as the power of many small echoes does: a gamma
    distribution, mostly below its mean, now and then far above."""
    speckle_looks: float = 2.0
    """Its shape: so many independent powers are averaged."""
    ground_power: float = 1.0
    """Its even part grows with (10 m / r) to this."""
    speckle_power: float = 3.0
    """And the speckle to this: a thing's echo goes with the fourth power of the range, and the patch of ground in one
    range bin grows with its first."""
    noise_counts: float = 0.2
    same_ground_m: float = 0.3
    """How far the vehicle drives until its ground looks different."""
    same_ground_rad: float = math.radians(5.0)
    most_counts: int = 255
    echoes_to_m: float = 15.0
    """Further away nothing but ground is worked out."""
    ray_step_rad: float = math.radians(1.0)
    half_fan_rad: float = math.radians(35.0)

    def answer(self, power_m2: F64) -> F64:
        """Counts that an echo adds to the ground's."""
        return self.counts_per_m2 * np.maximum(0.0, power_m2 - self.least_m2)


def transmission(layers: F64) -> F64:
    """Share of the power that is left, there and back."""
    return np.exp(-EXTINCTION * layers**EXTINCTION_POWER)


class UwbRadar:
    """Scans a scene from a place on the ground; the same seed gives the same scans."""

    def __init__(self, scene: UwbScene, seed: int, model: UwbModel | None = None) -> None:
        self.model = model or UwbModel()
        self._scene = scene
        self._random = np.random.default_rng((seed, 0x0B5E))
        geometry = self.model.geometry
        self._range_m = geometry.first_bin_m + geometry.bin_m * np.arange(geometry.bins)
        self._reached = int(np.searchsorted(self._range_m, self.model.echoes_to_m + 1.0))
        self._ground = self._random.standard_normal(geometry.bins)
        self._last: tuple[float, float, float] | None = None
        # The last side is the first again, so that one may go round.
        faces = self._random.exponential(size=(len(scene.cross_section_m2), max(1, self.model.aspects)))
        self._faces = np.column_stack([faces, faces[:, 0]])

    def scan(self, x_m: float, y_m: float, heading_rad: float) -> U8:
        """(bins,) counts; heading clockwise from y."""
        power = self.echoes(x_m, y_m, heading_rad)
        counts = self._clutter(x_m, y_m, heading_rad)
        counts += self.model.answer(power)
        counts += self.model.noise_counts * self._random.standard_normal(len(counts))
        return np.clip(np.rint(counts), 0, self.model.most_counts).astype(np.uint8)

    def echoes(self, x_m: float, y_m: float, heading_rad: float) -> F64:
        """(bins,) Power without ground and noise."""
        at_m = np.array([x_m, y_m])
        range_m, power = self._target_echoes(at_m, heading_rad)
        leaf_range_m, leaf_power = self._foliage_echoes(at_m, heading_rad)
        where, much = np.concatenate([range_m, leaf_range_m]), np.concatenate([power, leaf_power])
        out, reached_m = np.zeros(len(self._range_m)), self._range_m[: self._reached]
        out[: self._reached] = np.exp(-(((reached_m[:, None] - where) / self.model.pulse_sigma_m) ** 2) / 2.0) @ much
        return out

    def _target_echoes(self, at_m: F64, heading_rad: float) -> tuple[F64, F64]:
        scene = self._scene
        toward = scene.target_xy_m - at_m
        middle_m = np.maximum(np.hypot(*toward.T), 0.3)
        off_rad = _wrapped(np.arctan2(toward[:, 0], toward[:, 1]) - heading_rad)
        range_m = np.maximum(middle_m - scene.target_radius_m, 0.3)
        near = (np.abs(off_rad) < self.model.half_fan_rad) & (range_m < self.model.echoes_to_m)
        directions = toward[near] / middle_m[near, None]
        left = transmission(self._layers_before(at_m, directions, range_m[near]))
        left *= ~self._hidden(at_m, directions, range_m[near])
        faced_m2 = scene.cross_section_m2[near] * self._facing(near, np.arctan2(*-toward[near].T))
        power = faced_m2 * (10.0 / range_m[near]) ** 4 * self._gain(off_rad[near]) * left
        return range_m[near], power

    def _facing(self, which: Bools, aspect_rad: F64) -> F64:
        """(K,) Share of its mean echo that each chosen thing shows on this side."""
        if self.model.aspects == 0:
            return np.ones(len(aspect_rad))
        sector = (aspect_rad % (2.0 * math.pi)) / (2.0 * math.pi) * self.model.aspects
        low = np.minimum(sector.astype(np.intp), self.model.aspects - 1)
        faces, row = self._faces[which], np.arange(len(low))
        return faces[row, low] + (sector - low) * (faces[row, low + 1] - faces[row, low])

    def _foliage_echoes(self, at_m: F64, heading_rad: float) -> tuple[F64, F64]:
        """Each ray of a fan meets the clumps one after the other, the nearer ones in front of the farther."""
        model, scene = self.model, self._scene
        if len(scene.layers) == 0:
            return np.empty(0), np.empty(0)
        off_rad = np.arange(-model.half_fan_rad, model.half_fan_rad + 1e-9, model.ray_step_rad)
        bearing_rad = heading_rad + off_rad
        directions = np.column_stack([np.sin(bearing_rad), np.cos(bearing_rad)])
        enters_m, inside_m = chords(scene.foliage_xy_m, scene.foliage_radius_m, at_m, directions)
        met = _stretches(enters_m, inside_m, scene.layers / (2.0 * scene.foliage_radius_m))
        before = self._layers_before(at_m, directions[met.ray], met.enters_m)
        left = transmission(before) * ~self._hidden(at_m, directions[met.ray], met.enters_m)
        echo_m2 = np.interp(met.layers, LAYERS, ECHO_M2_PER_M) * met.enters_m * model.ray_step_rad
        power = echo_m2 * (10.0 / met.enters_m) ** 4 * self._gain(off_rad[met.ray]) * left
        return (met.enters_m + met.leaves_m) / 2.0, power

    def _layers_before(self, at_m: F64, directions: F64, range_m: F64) -> F64:
        """(K,) Layers of foliage on each ray up to its range."""
        scene = self._scene
        if len(scene.layers) == 0:
            return np.zeros(len(directions))
        enters_m, inside_m = chords(scene.foliage_xy_m, scene.foliage_radius_m, at_m, directions)
        reached_m = np.clip(range_m[:, None] - enters_m, 0.0, inside_m)
        return reached_m @ (scene.layers / (2.0 * scene.foliage_radius_m))

    def _hidden(self, at_m: F64, directions: F64, range_m: F64) -> Bools:
        """(K,) Whether something solid stands on the way."""
        scene = self._scene
        enters_m, _ = chords(scene.target_xy_m[scene.solid], scene.target_radius_m[scene.solid], at_m, directions)
        return np.asarray((enters_m < range_m[:, None] - 0.05).any(axis=1), np.bool_)

    def _gain(self, off_rad: F64) -> F64:
        """There and back: half of the power each way at the rim of the beam."""
        return np.exp(-2.0 * math.log(2.0) * (2.0 * off_rad / self.model.geometry.beamwidth_rad) ** 2)

    def _clutter(self, x_m: float, y_m: float, heading_rad: float) -> F64:
        """(bins,) The ground's own return: the same at the same place, another one further on."""
        model = self.model
        if self._last is not None:
            moved = math.hypot(x_m - self._last[0], y_m - self._last[1]) / model.same_ground_m
            turned = abs(float(_wrapped(np.array(heading_rad - self._last[2])))) / model.same_ground_rad
            self._ground = _drifted(self._ground, math.exp(-moved - turned), self._random)
        self._last = (x_m, y_m, heading_rad)
        nearness = 10.0 / np.maximum(self._range_m, 1.0)
        even = (model.ground_counts - model.speckle_counts) * nearness**model.ground_power
        uneven = model.speckle_counts * _gamma(self._ground, model.speckle_looks) * nearness**model.speckle_power
        return model.dark_counts + even + uneven


@dataclass(frozen=True, slots=True)
class _Stretches:
    """(K,) each: where a ray runs through foliage without a gap."""

    ray: NDArray[np.intp]
    enters_m: F64
    leaves_m: F64
    layers: F64


def _stretches(enters_m: F64, inside_m: F64, layers_per_m: F64) -> _Stretches:
    """Clumps that stand close together echo as one: what four layers return is not four times what one does."""
    ray, clump = np.nonzero((inside_m > 0.0) & (enters_m > 0.3))
    begin_m, length_m = enters_m[ray, clump], inside_m[ray, clump]
    layers = length_m * layers_per_m[clump]
    order = np.lexsort((begin_m, ray))
    ray, begin_m, end_m, layers = ray[order], begin_m[order], (begin_m + length_m)[order], layers[order]
    # One long line of all rays, far enough apart, so that the farthest end so far never reaches into the next ray.
    apart_m = ray * 1e6
    reached_m = np.maximum.accumulate(end_m + apart_m) if len(ray) else end_m
    first = np.flatnonzero(np.concatenate([[True], (begin_m + apart_m)[1:] > reached_m[:-1] + GAP_M])[: len(ray)])
    if len(first) == 0:
        return _Stretches(ray, begin_m, end_m, layers)
    return _Stretches(ray[first], begin_m[first], np.maximum.reduceat(end_m, first), np.add.reduceat(layers, first))


def _gamma(normal: F64, looks: float) -> F64:
    """Standard normal numbers as gamma-distributed ones of mean 1, after Wilson and Hilferty; cut at three sigma."""
    cut = np.clip(normal, -3.0, 3.0)
    return np.maximum(0.0, 1.0 - 1.0 / (9.0 * looks) + cut / (3.0 * math.sqrt(looks))) ** 3


def _drifted(ground: F64, alike: float, random: Generator) -> F64:
    return alike * ground + math.sqrt(1.0 - alike**2) * random.standard_normal(len(ground))


def _wrapped(angle_rad: F64) -> F64:
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
