"""The plan document: what the operator edits; every change is undoable and autosaved."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from server.schemas.strict_model import Latitude, Longitude, Metres, Name, Strict


class PoiDoc(Strict):
    id: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
    lat_deg: Latitude
    lon_deg: Longitude
    name: Name = ""
    loiter_s: Annotated[float, Field(ge=0, le=3600, allow_inf_nan=False)] = 0.0


class PlaceDoc(Strict):
    lat_deg: Latitude
    lon_deg: Longitude


class SurveyDoc(Strict):
    polygon: list[PlaceDoc] = Field(default=[], max_length=200)
    gsd_cm: Annotated[float, Field(gt=0, le=100)] = 1.0
    side_overlap: Annotated[float, Field(ge=0, lt=0.95)] = 0.7
    front_overlap: Annotated[float, Field(ge=0, lt=0.95)] = 0.8
    angle_deg: Annotated[float, Field(ge=0, lt=180)] | None = None


class CameraDoc(Strict):
    image_width_px: Annotated[int, Field(gt=0, le=100_000)]
    image_height_px: Annotated[int, Field(gt=0, le=100_000)]
    focal_mm: Annotated[float, Field(gt=0, le=1000)]
    sensor_width_mm: Annotated[float, Field(gt=0, le=200)]
    sensor_height_mm: Annotated[float, Field(gt=0, le=200)]


class ProfileDoc(Strict):
    """A vehicle profile; the same fields as ``planning.model.VehicleProfile``."""

    name: Name
    firmware: Literal["ardupilot", "px4"] = "ardupilot"
    radius_m: Metres = 0.35
    mean_speed_m_s: Metres = 3.0
    max_speed_m_s: Metres = 5.0
    max_climb_m_s: Metres = 2.5
    max_descent_m_s: Metres = 1.5
    max_accel_m_s2: Metres = 2.5
    max_jerk_m_s3: Metres = 1.0
    brake_decel_m_s2: Metres = 7.5
    brake_jerk_m_s3: Metres = 5.0
    endurance_s: Metres = 1200.0
    reserve_share: Metres = 0.25
    max_items: int = 650
    position_error_m: Metres = 2.5
    rtl_height_m: Metres = 30.0
    following_m: Metres | None = None
    dsm_rms_m: Metres = 0.023
    mass_kg: Metres = 2.0
    rotors: int = 4
    rotor_diameter_m: Metres = 0.254
    downwash_m: Metres | None = None
    camera: CameraDoc | None = None


class SurfaceDoc(Strict):
    radius_m: Metres = 20.0
    height_m: Metres = 5.0
    smooth_sigma_m: Metres | None = None
    floor: bool = True


class PathDoc(Strict):
    step_m: Metres = 0.1
    on_steep: Literal["raise", "slow"] = "raise"


class MissionDoc(Strict):
    excess_height_m: Metres = 1.0
    end: Literal["rtl", "land"] = "rtl"
    altitude_reference: Literal["home", "amsl"] = "home"
    heading: Literal["path", "fixed", "point"] = "path"
    heading_deg: Annotated[float, Field(ge=0, lt=360)] = 0.0
    look_at: PlaceDoc | None = None
    gimbal_pitch_deg: Annotated[float, Field(ge=-90, le=30)] | None = None
    camera_trigger_m: Annotated[float, Field(gt=0, le=1000)] | None = None


class ClearanceDoc(Strict):
    required_clearance_m: Metres | None = None
    """None: the sum of the terms of the vehicle's profile."""
    max_height_above_ground_m: Metres | None = None
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
