"""Home: where it lies on the surface model, where it is put for want of one, and how heights are counted from it."""

from __future__ import annotations

import math

import numpy as np
from pyproj import Geod

from planning.basics.mav_cmd import MavFrame
from planning.basics.plan_model import Home, MissionParams, SampledPath
from planning.certificate.certificate_model import BetterHome, ClearanceParams
from planning.certificate.home_stand import better_home, ground_at
from planning.certificate.reasons import direction
from planning.errors import DatumError, MissionError, PoiError
from planning.missions.mission_items import Heights
from planning.terrain.dsm import Dsm, SurfaceModel
from planning.terrain.vertical_datum import is_amsl

START_TOLERANCE_M = 0.5
HOME_DECIMALS = 9
"""As files carry degrees: home's height is taken where they say it is."""


def home_from_dsm(dsm: SurfaceModel, lat_lon_deg: tuple[float, float]) -> Home:
    """Home on the surface model's ground. Raises ``PoiError`` off the model or on unknown terrain."""
    lat_deg, lon_deg = lat_lon_deg
    alt_m = math.nan
    if abs(lat_deg) <= 90 and abs(lon_deg) <= 180:
        alt_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([lat_lon_deg])))[0])
    if not math.isfinite(alt_m):
        raise PoiError(
            f"The height of home at {lat_deg:.7f}, {lon_deg:.7f} is unknown.",
            where="home",
            advice="Put home on a known part of the surface model; give the latitude first.",
        )
    return Home(lat_deg, lon_deg, alt_m, dsm.vertical_datum)


def default_home(
    ground: SurfaceModel, first_lat_lon_deg: tuple[float, float], params: ClearanceParams, *, most_drop_m: float
) -> tuple[Home, str]:
    """Home at the first point of interest, or at the nearest place where a vehicle can start; and why not at it.

    A vehicle there stands at most ``most_drop_m`` lower than its cell, or as little as it may around. ``ground`` is
    the model before its holes were filled. Raises ``PoiError`` where nothing around is known.
    """
    xy_m = ground.xy_from_lat_lon(np.array([first_lat_lon_deg]))[0]
    here = ground_at(ground, (float(xy_m[0]), float(xy_m[1])), params)
    drop_m = here.alt_dsm_m - here.low_dsm_m if here.obstacle is None else math.inf
    if drop_m <= most_drop_m:
        return home_from_dsm(ground, first_lat_lon_deg), ""
    better = better_home(ground, (float(xy_m[0]), float(xy_m[1])), params, spare_m=most_drop_m)
    if better is None or better.drop_m >= drop_m:
        return home_from_dsm(ground, first_lat_lon_deg), ""
    why = here.obstacle or f"a vehicle may stand {drop_m:.2f} m lower than the model's ground"
    return home_there(ground, better), why


def home_there(ground: SurfaceModel, better: BetterHome) -> Home:
    """Home at a place that was found to do."""
    return home_from_dsm(ground, (round(better.lat_deg, HOME_DECIMALS), round(better.lon_deg, HOME_DECIMALS)))


def moved_note(first_lat_lon_deg: tuple[float, float], home: Home, why: str) -> str:
    """Says that home was put beside the first point, and why."""
    lat_deg, lon_deg = first_lat_lon_deg
    bearing_deg, _, away_m = Geod(ellps="WGS84").inv(lon_deg, lat_deg, home.lon_deg, home.lat_deg)
    return (
        f"Home was put {away_m:.1f} m to the {direction(bearing_deg % 360.0)} of the first point, at"
        f" {home.lat_deg:.7f}, {home.lon_deg:.7f}: at the point itself {why}."
    )


def item_heights(home: Home, params: MissionParams, dsm: Dsm) -> Heights:
    """How the mission's heights are written; ``DatumError`` when they cannot be above mean sea level."""
    if not math.isfinite(home.alt_dsm_m):
        raise MissionError("The height of home is unknown.", advice="Put home on known terrain.")
    if params.altitude_reference == "home":
        return Heights(MavFrame.GLOBAL_RELATIVE_ALT, home.alt_dsm_m)
    if not is_amsl(dsm.vertical_datum):
        datum = dsm.vertical_datum
        reason = f'are in "{datum}"' if datum else "have no declared vertical datum"
        raise DatumError(
            f"Altitudes above mean sea level were asked for, but the surface model's heights {reason}.",
            advice="Use altitudes relative to home, or declare the model's vertical datum if it is a geoid's.",
        )
    return Heights(MavFrame.GLOBAL, 0.0)


def check_start(path: SampledPath, home: Home, dsm: Dsm) -> None:
    """Raise ``MissionError`` unless the path starts over home."""
    home_xy_m = dsm.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]]))[0]
    away_m = float(np.hypot(*(path.xy_m[0] - home_xy_m)))
    if not away_m <= START_TOLERANCE_M:
        raise MissionError(
            f"The path starts {away_m:.1f} m from home, and the way there was not planned.",
            advice="Start the path with a vertex over home.",
        )
