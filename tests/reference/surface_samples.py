"""Places on the surfaces of simulated shapes, drawn at random: what distances to them are held to."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.simulation.simulator.scene.primitives import BOX, CYLINDER


def sample(rows: F64, spacing_m: float, random: np.random.Generator) -> F64:
    """(N, 3) spread evenly over the surfaces of primitives, one per ``spacing_m`` squared; no undersides."""
    parts = [_on(row, spacing_m, random) for row in rows]
    return np.concatenate(parts) if parts else np.empty((0, 3))


def _on(row: F64, spacing_m: float, random: np.random.Generator) -> F64:
    if row[0] == BOX:
        local = _on_box(row, spacing_m, random)
        cos, sin = row[7], row[8]
        turned = np.column_stack(
            [local[:, 0] * cos + local[:, 1] * sin, local[:, 1] * cos - local[:, 0] * sin, local[:, 2]]
        )
        return turned + np.array([row[1], row[2], row[3]])
    local = _on_cylinder(row, spacing_m, random) if row[0] == CYLINDER else _on_ellipsoid(row, spacing_m, random)
    return local + np.array([row[1], row[2], row[3]])


def _count(area_m2: float, spacing_m: float) -> int:
    return max(1, round(area_m2 / spacing_m**2))


def _on_box(row: F64, spacing_m: float, random: np.random.Generator) -> F64:
    a, b, height = row[5], row[6], row[4] - row[3]
    out = []
    for side, half, across in ((0, a, b), (1, b, a)):
        for sign in (-1.0, 1.0):
            n = _count(2 * across * height, spacing_m)
            face = np.empty((n, 3))
            face[:, side], face[:, 1 - side] = sign * half, random.uniform(-across, across, n)
            face[:, 2] = random.uniform(0.0, height, n)
            out.append(face)
    n = _count(4 * a * b, spacing_m)
    out.append(np.column_stack([random.uniform(-a, a, n), random.uniform(-b, b, n), np.full(n, height)]))
    return np.concatenate(out)


def _on_cylinder(row: F64, spacing_m: float, random: np.random.Generator) -> F64:
    radius, height = row[5], row[4] - row[3]
    n, m = _count(2 * math.pi * radius * height, spacing_m), _count(math.pi * radius**2, spacing_m)
    around, on_top = random.uniform(0, 2 * math.pi, n), random.uniform(0, 2 * math.pi, m)
    out = radius * np.sqrt(random.uniform(0, 1, m))
    side = np.column_stack([radius * np.sin(around), radius * np.cos(around), random.uniform(0.0, height, n)])
    return np.concatenate([side, np.column_stack([out * np.sin(on_top), out * np.cos(on_top), np.full(m, height)])])


def _on_ellipsoid(row: F64, spacing_m: float, random: np.random.Generator) -> F64:
    radius, half = row[5], (row[4] - row[3]) / 2
    p = 1.6075  # Thomsen's approximation of an ellipsoid's area
    area = 4 * math.pi * ((radius ** (2 * p) + 2 * (radius * half) ** p) / 3) ** (1 / p)
    direction = random.standard_normal((_count(area, spacing_m), 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * [radius, radius, half] + [0.0, 0.0, half]
