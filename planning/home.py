"""Home: where it lies on the surface model, and how heights are counted from it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from planning.dsm import Dsm, is_amsl
from planning.errors import DatumError, MissionError, PoiError
from planning.mission_items import FRAME_AMSL, FRAME_RELATIVE, Heights
from planning.model import FlownLine, Home, MissionParams, SampledPath, Unjudged

START_TOLERANCE_M = 0.5


def home_from_dsm(dsm: Dsm, lat_lon_deg: tuple[float, float]) -> Home:
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


def home_on_ground(line: FlownLine, unfilled: Dsm) -> FlownLine:
    """The line, named unjudged when home lies on a cell that was unknown before holes were filled.

    A filled hole has the height of its rim's highest cell, maybe a wall's; the vehicle counts its altitudes
    from the true ground there, and the whole flight would be lower by the difference.
    """
    if math.isfinite(float(unfilled.elevation_at(np.array([line.home_xy_m]))[0])):
        return line
    why = "Home lies in a hole of the surface model that was filled: its true height is unknown."
    unjudged = Unjudged(why, "Put home on ground that the surface model knows.")
    return replace(line, unjudged=(*line.unjudged, unjudged))


def item_heights(home: Home, params: MissionParams, dsm: Dsm) -> Heights:
    """How the mission's heights are written; ``DatumError`` when they cannot be above mean sea level."""
    if not math.isfinite(home.alt_dsm_m):
        raise MissionError("The height of home is unknown.", advice="Put home on known terrain.")
    if params.altitude_reference == "home":
        return Heights(FRAME_RELATIVE, home.alt_dsm_m)
    if not is_amsl(dsm.vertical_datum):
        datum = dsm.vertical_datum
        reason = f'are in "{datum}"' if datum else "have no declared vertical datum"
        raise DatumError(
            f"Altitudes above mean sea level were asked for, but the surface model's heights {reason}.",
            advice="Use altitudes relative to home, or declare the model's vertical datum if it is a geoid's.",
        )
    return Heights(FRAME_AMSL, 0.0)


def check_start(path: SampledPath, home: Home, dsm: Dsm) -> None:
    """Raise ``MissionError`` unless the path starts over home."""
    home_xy_m = dsm.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]]))[0]
    away_m = float(np.hypot(*(path.xy_m[0] - home_xy_m)))
    if not away_m <= START_TOLERANCE_M:
        raise MissionError(
            f"The path starts {away_m:.1f} m from home, and the way there was not planned.",
            advice="Start the path with a vertex over home.",
        )
