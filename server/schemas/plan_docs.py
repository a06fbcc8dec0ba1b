"""The plan document: what the operator edits; every change is undoable and autosaved."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from planning.basics.limits import FEWEST_ITEMS, LONGEST_LOITER_S
from planning.basics.plan_model import MissionParams, PathParams, SurfaceParams, VehicleProfile
from planning.fence.fence_model import LARGEST_M, MOST_CORNERS
from planning.route.camera import LOOKS_DOWN_DEG
from server.schemas.strict_model import Asked, Latitude, Longitude, Metres, Name, Strict

Speed = Annotated[Metres, Asked(0.1, 50)]
Overlap = Annotated[float, Field(ge=0, lt=0.95), Asked(0, 0.94)]
_VEHICLE, _SURFACE, _PATH, _MISSION = VehicleProfile(""), SurfaceParams(), PathParams(), MissionParams()


MarkId = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,32}$")]


class PoiDoc(Strict):
    id: MarkId
    lat_deg: Latitude
    lon_deg: Longitude
    name: Name = ""
    loiter_s: Annotated[float, Field(ge=0, le=LONGEST_LOITER_S, allow_inf_nan=False)] = 0.0


class PlaceDoc(Strict):
    lat_deg: Latitude
    lon_deg: Longitude


class FencePolygonDoc(Strict):
    id: MarkId
    inclusion: bool
    """The vehicle stays inside; otherwise outside."""
    corners: list[PlaceDoc] = Field(min_length=3, max_length=MOST_CORNERS)


class FenceCircleDoc(Strict):
    id: MarkId
    inclusion: bool
    centre: PlaceDoc
    radius_m: Annotated[float, Field(gt=0, le=LARGEST_M), Asked(1, LARGEST_M, initial=20)]


class RallyDoc(Strict):
    """Where a vehicle may return to instead of home."""

    id: MarkId
    lat_deg: Latitude
    lon_deg: Longitude
    alt_rel_home_m: Annotated[Metres, Asked(-500, 2000)]


class FenceDoc(Strict):
    """Where the vehicle may be: inside every inclusion, outside every exclusion, between floor and ceiling."""

    polygons: list[FencePolygonDoc] = Field(default=[], max_length=MOST_CORNERS)
    circles: list[FenceCircleDoc] = Field(default=[], max_length=MOST_CORNERS)
    floor_rel_home_m: Annotated[Metres, Asked(-500, 2000, initial=-10)] | None = None
    ceiling_rel_home_m: Annotated[Metres, Asked(1, 5000, initial=120)] | None = None


class SurveyDoc(Strict):
    polygon: list[PlaceDoc] = Field(default=[], max_length=200)
    gsd_cm: Annotated[float, Field(gt=0, le=100), Asked(min=0.05)] = 1.0
    side_overlap: Overlap = 0.7
    front_overlap: Overlap = 0.8
    angle_deg: Annotated[float, Field(ge=0, lt=180), Asked(0, 179, initial=0)] | None = None


class CameraDoc(Strict):
    image_width_px: Annotated[int, Field(gt=0, le=100_000), Asked(min=1)]
    image_height_px: Annotated[int, Field(gt=0, le=100_000), Asked(min=1)]
    focal_mm: Annotated[float, Field(gt=0, le=1000), Asked(min=0.1)]
    sensor_width_mm: Annotated[float, Field(gt=0, le=200), Asked(min=0.1)]
    sensor_height_mm: Annotated[float, Field(gt=0, le=200), Asked(min=0.1)]


USUAL_CAMERA = CameraDoc(
    image_width_px=4000, image_height_px=3000, focal_mm=8.8, sensor_width_mm=13.2, sensor_height_mm=8.8
)
"""Of a vehicle that is given one: what the console begins with."""


class ProfileDoc(Strict):
    """A vehicle profile; the same fields as ``planning.basics.plan_model.VehicleProfile``."""

    name: Name
    firmware: Literal["ardupilot", "px4"] = _VEHICLE.firmware
    radius_m: Annotated[Metres, Asked(0.05, 20)] = _VEHICLE.radius_m
    mean_speed_m_s: Speed = _VEHICLE.mean_speed_m_s
    max_speed_m_s: Speed = _VEHICLE.max_speed_m_s
    max_climb_m_s: Speed = _VEHICLE.max_climb_m_s
    max_descent_m_s: Speed = _VEHICLE.max_descent_m_s
    max_accel_m_s2: Speed = _VEHICLE.max_accel_m_s2
    max_jerk_m_s3: Annotated[Metres, Asked(0.1, 50)] = _VEHICLE.max_jerk_m_s3
    brake_decel_m_s2: Metres = _VEHICLE.brake_decel_m_s2
    brake_jerk_m_s3: Annotated[Metres, Asked(0.5, 50)] = _VEHICLE.brake_jerk_m_s3
    endurance_s: Annotated[Metres, Asked(30, 86_400)] = _VEHICLE.endurance_s
    reserve_share: Annotated[Metres, Asked(0, 0.9)] = _VEHICLE.reserve_share
    max_items: Annotated[int, Asked(FEWEST_ITEMS, 100_000)] = _VEHICLE.max_items
    position_error_m: Annotated[Metres, Asked(0, 100)] = _VEHICLE.position_error_m
    rtl_height_m: Annotated[Metres, Asked(0, 2000)] = _VEHICLE.rtl_height_m
    following_m: Annotated[Metres, Asked(0, 50, initial=1)] | None = None
    dsm_rms_m: Annotated[Metres, Asked(0, 20)] = _VEHICLE.dsm_rms_m
    mass_kg: Annotated[Metres, Asked(0.05, 500)] = _VEHICLE.mass_kg
    rotors: Annotated[int, Asked(1, 32)] = _VEHICLE.rotors
    rotor_diameter_m: Annotated[Metres, Asked(0.03, 10)] = _VEHICLE.rotor_diameter_m
    downwash_m: Annotated[Metres, Asked(0, 50, initial=0.5)] | None = None
    camera: CameraDoc | None = None


class SurfaceDoc(Strict):
    radius_m: Annotated[Metres, Asked(0.1, 1000)] = _SURFACE.radius_m
    height_m: Annotated[Metres, Asked(0.1, 500)] = _SURFACE.height_m
    smooth_sigma_m: Annotated[Metres, Asked(0, 200)] | None = None
    floor: bool = _SURFACE.floor


class PathDoc(Strict):
    step_m: Annotated[Metres, Asked(0.05, 10)] = _PATH.step_m
    on_steep: Literal["raise", "slow"] = _PATH.on_steep


class MissionDoc(Strict):
    excess_height_m: Annotated[Metres, Asked(0, 100)] = _MISSION.excess_height_m
    end: Literal["rtl", "land"] = _MISSION.end
    altitude_reference: Literal["home", "amsl"] = _MISSION.altitude_reference
    heading: Literal["path", "fixed", "point"] = _MISSION.heading
    heading_deg: Annotated[float, Field(ge=0, lt=360), Asked(0, 359.9)] = _MISSION.heading_deg
    look_at: PlaceDoc | None = None
    gimbal_pitch_deg: Annotated[float, Field(ge=-90, le=30), Asked(initial=LOOKS_DOWN_DEG)] | None = None
    camera_trigger_m: Annotated[float, Field(gt=0, le=1000), Asked(min=0.1, initial=5)] | None = None


class ClearanceDoc(Strict):
    required_clearance_m: Annotated[Metres, Asked(0.01, 500)] | None = None
    """None: the sum of the terms of the vehicle's profile."""
    max_height_above_ground_m: Annotated[Metres, Asked(1, 10_000, initial=120)] | None = None
    way: Literal["auto", "guided"] = "auto"
    """How it will be flown: the autopilot departs from the line by that much."""


class PlannedOnDoc(Strict):
    """The surface model that points were planned on elsewhere, or before the plan was given another one."""

    name: Name = ""
    sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
    home_lat_deg: Latitude | None = None
    home_lon_deg: Longitude | None = None
    home_alt_dsm_m: float | None = None
    """Null: not known."""


class PlanDoc(Strict):
    name: Name = "Untitled plan"
    terrain_id: str | None = None
    planned_on: PlannedOnDoc | None = None
    """Null: no other than that of ``terrain_id``, as far as anybody knows."""
    orthophoto_id: str | None = None
    seen_id: str | None = None
    """What was seen and raises the surface model as columns; None: the model is as it was read."""
    seen_lacks: Annotated[str, StringConstraints(max_length=300)] = ""
    """Sentences: what was seen, and is not among these columns."""
    source: Literal["pois", "survey"] = "pois"
    pois: list[PoiDoc] = Field(default=[], max_length=5000)
    survey: SurveyDoc = SurveyDoc()
    home: PlaceDoc | None = None
    """None: the first point."""
    profile: ProfileDoc = ProfileDoc(name="Generic quad")
    surface: SurfaceDoc = SurfaceDoc()
    path: PathDoc = PathDoc()
    mission: MissionDoc = MissionDoc()
    clearance: ClearanceDoc = ClearanceDoc()
    fence: FenceDoc = FenceDoc()
    rally: list[RallyDoc] = Field(default=[], max_length=MOST_CORNERS)
