"""Colours of the 3D view. Red, orange and green mean clearance and nothing else."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64, U8

SAFE = (0, 190, 70)
CLOSE = (255, 145, 0)
INSIDE = (235, 20, 40)
ACCENT = (186, 85, 255)
"""Selection, hover and the tool in hand."""
POI = (250, 250, 250)
HOME = (255, 255, 255)
CURTAIN = (16, 20, 28)
SURFACE = (96, 165, 250)
SURVEY = (240, 240, 250)
FENCE = (150, 222, 255)
LOOK_AT = (200, 205, 220)
VEHICLE = (0, 216, 255)
NOSE = (255, 255, 255)
REPLAY = (236, 214, 255)
REPLAY_NOSE = (150, 110, 190)
"""A replayed vehicle is never taken for the live one."""
RECORDED_PLAN = (250, 250, 250)
UNKNOWN = ((104, 92, 120), (130, 115, 148))
"""Two stripes"""
RADAR = (240, 90, 205)
VISION = (255, 225, 80)
VISION_FLIGHT = (225, 190, 70)
"""Of the sensors that see obstacles, the last of the camera on its whole way: magenta and yellow stay apart for every
kind of colour blindness."""
TRACK = (255, 255, 255)
TRACK_DANGEROUS = INSIDE
SITE = (250, 250, 250)
KNOWN_GROUND = (150, 154, 162)
"""Voxels that the surface model explains."""
_FAINT_SHARE = 0.6
"""What is left of a colour where a voxel is as likely free as occupied."""
_SURE = 0.97
_STEPS = 8
"""Shades of probability: finer ones are not told apart, and each change of a shade travels."""
_DIM = (128, 132, 140)
_DIM_SHARE = 0.65


def clearance_rgb(clearance_m: F64, required_m: float) -> U8:
    """(N,) metres -> (N, 3); inside, on or over unknown terrain is red, below the requirement orange."""
    clearance = np.where(np.isnan(clearance_m), -np.inf, clearance_m)
    bands = np.array([INSIDE, CLOSE, SAFE], dtype=np.uint8)
    return bands[(clearance > 0).astype(np.intp) + ((clearance > 0) & (clearance >= required_m))]


def probability_rgb(hue: tuple[int, int, int], probability: F64) -> U8:
    """(N,) probabilities of 0.5 and more -> (N, 3): the surer, the lighter."""
    share = np.clip((np.asarray(probability) - 0.5) / (_SURE - 0.5), 0.0, 1.0)
    share = np.round(share * _STEPS) / _STEPS
    return np.round((_FAINT_SHARE + (1 - _FAINT_SHARE) * share)[:, None] * np.array(hue)).astype(np.uint8)


def dimmed(rgb: U8 | tuple[int, int, int], *, stale: bool) -> U8:
    """Greyed while a newer answer is being computed."""
    color = np.asarray(rgb, dtype=np.float64)
    return (color + _DIM_SHARE * (np.array(_DIM) - color) if stale else color).astype(np.uint8)
