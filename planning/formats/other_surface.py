"""Whether a mission is judged over another surface model than it was planned on: home's height changes with it."""

from __future__ import annotations

import math
import re

import numpy as np

from planning.basics.plan_model import Mission
from planning.formats.safe_text import clean_name
from planning.terrain.dsm import SurfaceModel

_DIGEST = re.compile(r"[0-9a-f]{64}")
_SHOWN = 8
SAME_HEIGHT_M = 0.01


def surface_digest(text: object) -> str:
    """A digest as files carry it; empty for anything else."""
    return text if isinstance(text, str) and _DIGEST.fullmatch(text) else ""


def other_surface(mission: Mission, dsm: SurfaceModel) -> str | None:
    """That ``dsm`` is not the planned one, or is read otherwise, and how far home moves; None: the same, or unknown."""
    planned = mission.surface_sha256
    if not planned:
        return None
    higher_m = _home_higher_m(mission, dsm)
    if planned != dsm.sha256:
        text = (
            f"This is judged over another surface model, {_called(dsm.name, dsm.sha256)}, than the mission was planned"
            f" on, {_called(mission.surface_name, planned)}"
        )
    elif abs(higher_m) > SAME_HEIGHT_M:
        text = "The mission was planned on this surface model, but read with another scale or other heights at home"
    else:
        return None
    if not math.isfinite(mission.home.alt_dsm_m):
        return f"{text}: heights are counted from home's ground, which may lie higher or lower here."
    if not math.isfinite(higher_m):
        return f"{text}: it knows no height where home was planned."
    direction = "higher" if higher_m >= 0 else "lower"
    return f"{text}: home's ground is {abs(higher_m):.2f} m {direction} here, and all heights are counted from it."


def _called(name: str, sha256: str) -> str:
    """Both: two models may have one name."""
    digest = f"SHA-256 {sha256[:_SHOWN]}"
    return f'"{clean_name(name)}" ({digest})' if name else f"one with {digest}"


def _home_higher_m(mission: Mission, dsm: SurfaceModel) -> float:
    home = mission.home
    if not (math.isfinite(home.lat_deg) and math.isfinite(home.lon_deg)):
        return math.nan
    xy_m = dsm.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]]))
    return float(dsm.elevation_at(xy_m)[0]) - home.alt_dsm_m
