"""Whether heights still count from the ground: home that was moved in flight may lie above or below it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mapping.geometry.frames import apart_m
from planning.terrain.dsm import SurfaceModel
from planning.terrain.vertical_datum import is_amsl
from telemetry.errors import NotAllowedError
from telemetry.flight.home_watch import MOVED_M, HomePlace, home_of, is_there
from telemetry.flight.preflight.preflight import LARGEST_SHIFT_M
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.vehicle import VehicleState

LARGEST_DOUBT_M = 2.0
"""PX4 corrects home's height in flight by its receiver: 1.2 m were measured. Who is right is not known: ways are judged
at the worse end. What is beyond this is no correction."""


def home_off_m(ground: SurfaceModel, took_off: HomePlace | None, state: VehicleState) -> float:
    """By how much home may lie above the surface model's ground (below: negative), of a vehicle in the air.

    Its home is taken to lie on the ground as that of its take-off did. ``took_off`` None: that is not known. 0 for what
    receivers wander. Raises NotAllowedError where home is off by more than can be judged at the worse end.
    """
    now = home_of(state)
    if now is None:
        raise NotAllowedError("The vehicle does not tell how high its home is.", where="home", advice="Wait for it.")
    if took_off is None:
        if not abs(_by_its_receiver_m(ground, now, state)) <= LARGEST_SHIFT_M:
            what = "Home of the take-off was not heard here: whether its height is the ground's now is not known."
            raise NotAllowedError(what, where="home", advice="Return home or land, then start from here.")
        return 0.0
    off_m = now.alt_amsl_m - took_off.alt_amsl_m
    if apart_m((now.lat_deg, now.lon_deg), (took_off.lat_deg, took_off.lon_deg)) > MOVED_M:
        off_m -= _ground_m(ground, now) - _ground_m(ground, took_off)
    if abs(off_m) <= LARGEST_SHIFT_M:
        return 0.0
    if not abs(off_m) <= LARGEST_DOUBT_M:
        far = f"{abs(off_m):.1f} m {'above' if off_m > 0 else 'below'} the ground" if np.isfinite(off_m) else "off"
        what = f"Home was moved in flight to a height that is {far} of the surface model there."
        raise NotAllowedError(what, where="home", advice="Set home here or there: it then lies on the ground again.")
    return off_m


def home_on_ground(origins: Sequence[MapOrigin], took_off: HomePlace | None, state: VehicleState) -> HomePlace:
    """A home that lies on the surface model's ground, from which maps of these origins are laid on the model.

    Home of the take-off; where that is not known, home as it is now. Raises NotAllowedError where a map was begun
    under another one then: by how much that lay higher than the ground nobody knows.
    """
    if took_off is not None:
        return took_off
    now = home_of(state)
    if now is None:
        what = "The vehicle does not tell its home: how high things stand that were seen is not known."
        raise NotAllowedError(what, where="home", advice="Wait for it.")
    if not all(is_there(HomePlace(each.lat_deg, each.lon_deg, each.alt_amsl_m), now) for each in origins):
        what = "Things were seen under another home, and home of the take-off was not heard here: how high they stand"
        flies = state.armed and is_in_the_air(state)
        advice = "Steer clear by sight, and land." if flies else "Plan without them, or empty the maps and look again."
        raise NotAllowedError(f"{what} is not known.", where="home", advice=advice)
    return now


def up_zero_m(ground: SurfaceModel, home: HomePlace, origin: MapOrigin) -> float:
    """Height in the model of a map's up = 0, which counts from the home that the map was begun under.

    ``home``: one that lies on the ground. Raises NotAllowedError where the model does not know that place.
    """
    ground_m = _ground_m(ground, home)
    if not math.isfinite(ground_m):
        what = "The surface model knows no height at the home of the flight: how high things stand is not known."
        raise NotAllowedError(what, where="home", advice="Open the model of the ground that it lies on.")
    return ground_m + origin.alt_amsl_m - home.alt_amsl_m


def _by_its_receiver_m(ground: SurfaceModel, home: HomePlace, state: VehicleState) -> float:
    """Home above the ground, NaN where that needs what is not there: heights above the sea, told to centimetres."""
    if state.gnss_fix != "rtk_fixed" or not is_amsl(ground.vertical_datum):
        return math.nan
    return home.alt_amsl_m - _ground_m(ground, home)


def _ground_m(ground: SurfaceModel, home: HomePlace) -> float:
    return float(ground.elevation_at(ground.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]])))[0])
