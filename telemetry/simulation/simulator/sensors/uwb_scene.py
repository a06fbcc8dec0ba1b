"""What a ground vehicle's UWB radar looks at: obstacles with their echoes, and foliage that hides and weakens them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools

LAYER_M = 0.1
"""Thickness of one of the paper's layers of branches."""


@dataclass(frozen=True, slots=True)
class Target:
    """A solid thing on the ground: a disc as broad as it is."""

    name: str
    xy_m: tuple[float, float]
    radius_m: float
    height_m: float
    cross_section_m2: float
    solid: bool = True
    """Whether nothing behind it is seen."""


@dataclass(frozen=True, slots=True)
class Foliage:
    """A clump, or one stem's worth of a hedge: a disc; ``layers`` are counted through its middle."""

    xy_m: tuple[float, float]
    radius_m: float
    height_m: float
    layers: float


# Table II, without place: name, radar cross section, breadth and height as printed. The box reflects nothing at all.
TABLE_II = {
    "Metal Jerry": (8.6, 0.34, 0.45),
    "Large reflector": (7.3, 0.25, 0.25),
    "Plastic Jerry": (2.6, 0.32, 0.45),
    "Plywood": (2.3, 0.34, 0.36),
    "3 bricks": (1.5, 0.33, 0.23),
    "2 bricks": (0.2, 0.29, 0.17),
    "Stone": (0.1, 0.40, 0.30),
    "Cardboard box": (0.0, 0.28, 0.23),
}

SMALL_REFLECTOR = {"Small reflector": (3.0, 0.20, 0.20)}
"""The paper gives no size: a corner like the large one with edges of 20 cm, whose echo goes with their fourth power."""


def target(name: str, xy_m: tuple[float, float]) -> Target:
    """One of Table II, or the small reflector. Small things hide nothing behind them."""
    cross_section_m2, breadth_m, height_m = {**TABLE_II, **SMALL_REFLECTOR}[name]
    return Target(name, xy_m, breadth_m / 2.0, height_m, cross_section_m2, solid=False)


def screen(
    xy_m: tuple[float, float],
    width_m: float,
    height_m: float,
    layers: float,
    *,
    along_rad: float = 0.0,
    per_radius: float = 10.0,
) -> list[Foliage]:
    """A hedge of even density in front of something: ``along_rad`` is its direction, counter-clockwise from x.

    Discs side by side, ``per_radius`` to each radius, overlap so that a ray across meets about ``layers`` wherever it
    passes.
    """
    radius_m = max(0.15, layers * LAYER_M / 2.0)
    count = max(1, round(width_m / radius_m * per_radius))
    at_m = (np.arange(count) - (count - 1) / 2.0) * width_m / count
    share = layers * 2.0 * width_m / (count * math.pi * radius_m)
    x_m, y_m = xy_m
    return [
        Foliage((x_m + math.cos(along_rad) * float(a), y_m + math.sin(along_rad) * float(a)), radius_m, height_m, share)
        for a in at_m
    ]


@dataclass(frozen=True, slots=True)
class UwbScene:
    """Columns of numbers of all that stands there. Made by ``uwb_scene``."""

    target_xy_m: F64
    """(N, 2)"""
    target_radius_m: F64
    cross_section_m2: F64
    solid: Bools
    foliage_xy_m: F64
    """(M, 2)"""
    foliage_radius_m: F64
    layers: F64


def uwb_scene(targets: Iterable[Target], foliage: Iterable[Foliage] = ()) -> UwbScene:
    things, clumps = list(targets), list(foliage)
    return UwbScene(
        np.array([thing.xy_m for thing in things], np.float64).reshape(-1, 2),
        np.array([thing.radius_m for thing in things], np.float64),
        np.array([thing.cross_section_m2 for thing in things], np.float64),
        np.array([thing.solid for thing in things], np.bool_),
        np.array([clump.xy_m for clump in clumps], np.float64).reshape(-1, 2),
        np.array([clump.radius_m for clump in clumps], np.float64),
        np.array([clump.layers for clump in clumps], np.float64),
    )


def chords(discs_xy_m: F64, radius_m: F64, at_m: F64, directions: F64) -> tuple[F64, F64]:
    """(K, M) where each of K rays (unit vectors (K, 2)) from ``at_m`` enters each disc, and how far it is inside.

    Rays that miss a disc enter it at infinity and stay inside for 0 m.
    """
    toward = discs_xy_m - at_m
    along = directions @ toward.T
    beside2 = np.maximum(0.0, (toward**2).sum(axis=1)[None, :] - along**2)
    half = np.sqrt(np.maximum(0.0, radius_m[None, :] ** 2 - beside2))
    enters, leaves = np.maximum(0.0, along - half), along + half
    hit = (half > 0.0) & (leaves > 0.0)
    return np.where(hit, enters, math.inf), np.where(hit, leaves - enters, 0.0)
