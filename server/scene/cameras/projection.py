"""Where cameras stand, and what lies under a pointer on the screen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from viser import transforms

from mapping.geometry.arrays import F64

FOV_RAD = math.radians(45.0)
OBLIQUE = np.array([0.0, math.cos(math.radians(38.0)), -math.sin(math.radians(38.0))])
"""Looking north and down: maps have north up."""
TOP = np.array([0.0, 0.02, -1.0]) / math.hypot(0.02, 1.0)
"""Straight down would leave the orbit controls without an up."""
_MARGIN = 1.1
SCREEN_HEIGHT_PX = 800.0
"""Assumed: the pointer's reach need not be exact."""


@dataclass(frozen=True, slots=True)
class Pose:
    position: F64
    look_at: F64


@dataclass(frozen=True, slots=True)
class Lens:
    """A camera as it stands: z forward, x right, y down (OpenCV)."""

    position: F64
    R_scene_camera: F64
    fov_rad: float
    """Vertical"""
    aspect: float

    @staticmethod
    def of(wxyz: F64, position: F64, fov_rad: float, aspect: float) -> Lens:
        R = transforms.SO3(np.asarray(wxyz, dtype=np.float64)).as_matrix().astype(np.float64)
        return Lens(np.asarray(position, dtype=np.float64), R, fov_rad, aspect)

    def project(self, points: F64) -> tuple[F64, F64]:
        """(N, 3) scene -> (N, 2) shares of width and height from the top left, and (N,) depths."""
        p_camera = (points - self.position) @ self.R_scene_camera
        depth = p_camera[:, 2]
        tan_v = math.tan(self.fov_rad / 2)
        safe = np.where(depth > 0, depth, np.nan)
        shares = 0.5 + 0.5 * p_camera[:, :2] / (safe[:, None] * [tan_v * self.aspect, tan_v])
        return shares, depth

    def px(self, shares: F64) -> F64:
        """Shares of the view -> pixels of the assumed screen."""
        return shares * [SCREEN_HEIGHT_PX * self.aspect, SCREEN_HEIGHT_PX]


def fitted(points: F64, forward: F64, *, fov_rad: float = FOV_RAD, aspect: float = 1.6) -> Pose:
    """The nearest pose looking along ``forward`` that has all (N, 3) points in the picture."""
    look_at = (points.min(axis=0) + points.max(axis=0)) / 2
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    p, tan_v = points - look_at, math.tan(fov_rad / 2)
    needed = np.maximum(np.abs(p @ right) / (tan_v * aspect), np.abs(p @ up) / tan_v) - p @ forward
    return Pose(look_at - forward * max(float(needed.max()), 1.0) * _MARGIN, look_at)


def nearest_on_path(lens: Lens, path: F64, s_m: F64, pointer: F64, *, within_px: float) -> float | None:
    """The distance flown at the place of a polyline (N, 3) that lies nearest to the pointer on the screen.

    ``pointer`` is (2,) shares of the view. Pieces that reach behind the camera are left out; None when nothing
    lies within ``within_px``.
    """
    shares, depth = lens.project(path)
    px = lens.px(shares) - lens.px(pointer)
    a, ab = px[:-1], px[1:] - px[:-1]
    with np.errstate(invalid="ignore"):
        t = np.clip(-(a * ab).sum(axis=1) / np.maximum((ab * ab).sum(axis=1), 1e-12), 0.0, 1.0)
        away_px = np.hypot(*(a + t[:, None] * ab).T)
    if not np.isfinite(away_px).any():
        return None
    best = int(np.nanargmin(away_px))
    if away_px[best] > within_px:
        return None
    # Equal steps on the screen are not equal steps in space: divide by depth.
    near, far = depth[best], depth[best + 1]
    share = t[best] * near / (t[best] * near + (1 - t[best]) * far)
    return float(s_m[best] + share * (s_m[best + 1] - s_m[best]))
