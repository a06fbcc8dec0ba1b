"""The single items of a mission, each as its firmware wants it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Firmware, Home, MissionItem, MissionParams
from planning.errors import MissionError, ParameterError
from planning.terrain.dsm import Dsm

GROUND_SPEED = 1.0
MOUNT_TARGETING = 2.0
MIN_TAKEOFF_M = 2.0
LANDING_ITEMS = 3
"""At most: climb, over home, land."""
TRUNCATION_GUARD_M = 0.002
"""Above the whole centimetre: the vehicle takes heights as float32 and cuts them, 32.94 m became 32.93 m."""


@dataclass(frozen=True, slots=True)
class Heights:
    """How heights are written: in ``frame``, above ``origin_alt_dsm_m``."""

    frame: int
    origin_alt_dsm_m: float

    def item_m(self, alt_dsm_m: float) -> float:
        """A height on the centimetre grid as an item carries it."""
        height_m = round(float(alt_dsm_m - self.origin_alt_dsm_m), 2)
        # ArduPilot takes a stored height of 0 cm for "stay at the present height".
        return (0.01 if -0.015 < height_m < 0.005 else height_m) + TRUNCATION_GUARD_M


@dataclass(frozen=True, slots=True)
class Place:
    """A waypoint's place: WGS84 degrees and ``alt_dsm_m``."""

    lat_deg: float
    lon_deg: float
    alt_dsm_m: float


def unset(firmware: Firmware) -> float:
    """A yaw that is not given: NaN; ArduPilot stores and returns zero for it."""
    return 0.0 if firmware == "ardupilot" else math.nan


def action(command: int, *params: float, last: float = 0.0) -> MissionItem:
    """An item without a place; ``last`` is the seventh parameter."""
    p = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
    return MissionItem(command, MavFrame.MISSION, (p[0], p[1], p[2], p[3]), alt_m=last)


def takeoff(home: Home, heights: Heights, first_alt_dsm_m: float, firmware: Firmware) -> MissionItem:
    """Straight up over home to the first waypoint's height, two metres at least."""
    top_m = max(first_alt_dsm_m, home.alt_dsm_m + MIN_TAKEOFF_M)
    params = (0.0, 0.0, 0.0, unset(firmware))
    return MissionItem(
        MavCmd.NAV_TAKEOFF, heights.frame, params, _deg(home.lat_deg), _deg(home.lon_deg), heights.item_m(top_m)
    )


def waypoint(place: Place, heights: Heights, *, hold_s: float, yaw_deg: float) -> MissionItem:
    """Hold seconds are rounded up, because the vehicle cuts them to whole ones."""
    params = (float(math.ceil(hold_s)), 0.0, 0.0, yaw_deg)
    alt_m = heights.item_m(place.alt_dsm_m)
    return MissionItem(MavCmd.NAV_WAYPOINT, heights.frame, params, _deg(place.lat_deg), _deg(place.lon_deg), alt_m)


def _deg(degrees: float) -> float:
    return round(float(degrees), 7)


def aiming(params: MissionParams, firmware: Firmware, heights: Heights, dsm: Dsm) -> list[MissionItem]:
    """Gimbal and region of interest, set before the first waypoint."""
    items = []
    if params.heading == "point":
        items.append(_roi(params, heights, dsm))
    if params.gimbal_pitch_deg is not None:
        pitch_deg = params.gimbal_pitch_deg
        if not -180 <= pitch_deg <= 180:
            raise ParameterError(f"The gimbal's pitch is {pitch_deg} degrees.", advice="Give -90 to look down.")
        if firmware == "ardupilot":
            items.append(action(MavCmd.DO_MOUNT_CONTROL, pitch_deg, last=MOUNT_TARGETING))
        else:
            items.append(action(MavCmd.DO_GIMBAL_MANAGER_PITCHYAW, pitch_deg, 0.0, math.nan, math.nan))
    return items


def starting(params: MissionParams, firmware: Firmware) -> list[MissionItem]:
    """Camera and fixed heading, from the first waypoint on."""
    items = []
    if params.camera_trigger_m is not None:
        if not (math.isfinite(params.camera_trigger_m) and params.camera_trigger_m > 0):
            raise ParameterError(
                f"The distance between photos is {params.camera_trigger_m} m.", advice="Give metres above zero."
            )
        items.append(action(MavCmd.DO_SET_CAM_TRIGG_DIST, params.camera_trigger_m, 0.0, 1.0))
    if params.heading == "fixed" and firmware == "ardupilot":
        items.append(action(MavCmd.CONDITION_YAW, fixed_heading_deg(params)))
    return items


def stopping(params: MissionParams) -> list[MissionItem]:
    """Camera off and the nose free again, after the last waypoint."""
    camera = [action(MavCmd.DO_SET_CAM_TRIGG_DIST, 0.0)] if params.camera_trigger_m is not None else []
    return camera + ([action(MavCmd.DO_SET_ROI_NONE)] if params.heading == "point" else [])


def fixed_heading_deg(params: MissionParams) -> float:
    """The fixed heading in [0, 360)."""
    if not math.isfinite(params.heading_deg):
        raise ParameterError(f"The heading is {params.heading_deg} degrees.", advice="Give degrees from north.")
    return params.heading_deg % 360.0


def _roi(params: MissionParams, heights: Heights, dsm: Dsm) -> MissionItem:
    advice = "Give the latitude and longitude of a point on known terrain."
    if params.look_at is None:
        raise ParameterError('The heading "point" has no point to look at.', advice=advice)
    lat_deg, lon_deg = params.look_at
    ground_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([[lat_deg, lon_deg]])))[0])
    if not math.isfinite(ground_m):
        raise ParameterError(f"The terrain at the point to look at, {lat_deg}, {lon_deg}, is unknown.", advice=advice)
    alt_m = heights.item_m(ground_m)
    return MissionItem(
        MavCmd.DO_SET_ROI_LOCATION, heights.frame, (0.0, 0.0, 0.0, 0.0), _deg(lat_deg), _deg(lon_deg), alt_m
    )


def return_to_launch() -> list[MissionItem]:
    """The autopilot's own way home, at its own height."""
    return [action(MavCmd.NAV_RETURN_TO_LAUNCH)]


def landing(
    home: Home, last: Place, heights: Heights, *, transit_alt_dsm_m: float, yaw_deg: float
) -> list[MissionItem]:
    """Straight up over the last waypoint, level to over home, and down."""
    if not math.isfinite(transit_alt_dsm_m):
        raise MissionError(
            "There is no height from which the way home is known to be clear.",
            advice="Set the transit height of the landing, or end with RTL.",
        )
    top_m = max(last.alt_dsm_m, transit_alt_dsm_m)
    climb = Place(last.lat_deg, last.lon_deg, top_m)
    over_home = Place(home.lat_deg, home.lon_deg, top_m)
    items = [waypoint(climb, heights, hold_s=0.0, yaw_deg=yaw_deg)] if top_m > last.alt_dsm_m else []
    if (_deg(last.lat_deg), _deg(last.lon_deg)) != (_deg(home.lat_deg), _deg(home.lon_deg)):
        items.append(waypoint(over_home, heights, hold_s=0.0, yaw_deg=yaw_deg))
    ground_m = float(home.alt_dsm_m - heights.origin_alt_dsm_m)
    land = MissionItem(
        MavCmd.NAV_LAND, heights.frame, (0.0, 0.0, 0.0, yaw_deg), _deg(home.lat_deg), _deg(home.lon_deg), ground_m
    )
    return [*items, land]
