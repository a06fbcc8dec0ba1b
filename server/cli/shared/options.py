"""Options that several commands share, as the groups in which ``--help`` shows them, and what groups of them say.

``server.cli.shared.command`` makes options of a group's fields; each is named as its field is.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from typer import Argument, Option

from planning.basics.plan_model import MissionParams, PathParams, SurfaceParams, VehicleProfile
from planning.errors import FormatError, ParameterError
from planning.missions.vehicle_profile import DEFAULT_PROFILE, shipped_profiles

_SURFACE, _PATH, _MISSION, _VEHICLE = SurfaceParams(), PathParams(), MissionParams(), VehicleProfile("")
_SHIPPED = f"A shipped profile ({', '.join(shipped_profiles())}) or a TOML file"
_FLOWN_AS = "Mission on board, or waypoints handed over one at a time"

DsmFile = Annotated[
    Path, Argument(metavar="DSM", help="Surface model: GeoTIFF, ESRI ASCII grid, folder of tiles, VRT or catalogue.")
]
FlightDsm = Annotated[
    Path | None,
    Option(metavar="FILE", help="Surface model that is flown over: GeoTIFF, ESRI ASCII grid, folder of tiles or VRT."),
]
MissionFile = Annotated[Path, Argument(metavar="MISSION", help="Mission: .waypoints or .plan.")]
Link = Annotated[
    str,
    Option(
        metavar="URL[,URL]",
        help="Connection to the vehicle: udpin:0.0.0.0:14550, tcp:10.0.0.7:5760, /dev/ttyACM0:57600; several ways to"
        " the same vehicle with commas between.",
    ),
]
Keys = Annotated[
    Path | None,
    Option(metavar="DIR", help="Sign as the Hedgehop of this data directory does, and keep the log of commands there."),
]
StationVehicle = Annotated[
    str | None,
    Option(
        metavar="NUMBER|STATION/NUMBER",
        help="Which vehicle, where the station has several: 2, or with the station's name Alpha/2.",
    ),
]
Out = Annotated[Path, Option(metavar="DIR", help="Directory for the files.")]
Cluster = Annotated[
    str | None,
    Option(
        metavar="local|ADDRESS",
        help="Spread over Dask workers: local (a process for each core), local:N, or a scheduler's tls://HOST:PORT. "
        "Needs hedgehop[cluster].",
    ),
]
AsJson = Annotated[bool, Option("--json", help="Print one JSON object on stdout, messages on stderr.")]


@dataclass(frozen=True, slots=True)
class ModelOptions:
    """How the surface model's file is to be understood, and what of it is to be mended."""

    PANEL: ClassVar = "Surface model"
    crs: Annotated[str | None, Option(help="Coordinate system of a model that names none: EPSG:2193.")] = None
    z_scale: Annotated[float | None, Option(help="Metres per stored unit: 0.01 for centimetres.")] = None
    vertical_datum: Annotated[
        str | None, Option(help='Datum of the heights: "EGM2008 height", "ellipsoid". AMSL altitudes need one.')
    ] = None
    catalogue: Annotated[
        bool,
        Option(
            "--catalogue",
            help="The folder holds several models, not the tiles of one: of each place the best counts. "
            "A STAC document (.json) always is one.",
        ),
    ] = False
    max_hole_m2: Annotated[
        float,
        Option(
            help="Holes of unknown cells smaller than this are filled with the highest cell around them; 0 keeps each "
            "one a column of infinite height."
        ),
    ] = _SURFACE.fill_hole_area_m2
    remove_spikes: Annotated[
        bool,
        Option(
            "--remove-spikes",
            help="Take isolated spikes and pits for errors of the model, and out of it. Look at each one first: "
            "it may be a mast.",
        ),
    ] = False


@dataclass(frozen=True, slots=True)
class SurfaceOptions:
    """The safe surface."""

    PANEL: ClassVar = "Surface to fly on"
    radius_m: Annotated[float, Option(help="Radius R of the dilating ball.")] = _SURFACE.radius_m
    height_m: Annotated[float, Option(help="Height H of the dilating ball.")] = _SURFACE.height_m
    smooth_m: Annotated[float | None, Option(help="Sigma of the Gaussian; default R / 10.")] = None
    paper: Annotated[
        bool, Option("--paper", help="The paper's own pipeline: no floor under the smoothing.")
    ] = not _SURFACE.floor


@dataclass(frozen=True, slots=True)
class PathOptions:
    """How fast, and how finely sampled."""

    PANEL: ClassVar = "Path and speeds"
    mean_speed_m_s: Annotated[
        float | None, Option(help=f"Mean speed between points; default: the profile's ({_VEHICLE.mean_speed_m_s:g}).")
    ] = None
    max_speed_m_s: Annotated[
        float | None,
        Option(help=f"Top speed, at most twice the mean; default: the profile's ({_VEHICLE.max_speed_m_s:g})."),
    ] = None
    max_climb_m_s: Annotated[
        float | None, Option(help=f"Climb limit; default: the profile's ({_VEHICLE.max_climb_m_s:g}).")
    ] = None
    max_descent_m_s: Annotated[
        float | None, Option(help=f"Descent limit; default: the profile's ({_VEHICLE.max_descent_m_s:g}).")
    ] = None
    max_accel_m_s2: Annotated[
        float | None, Option(help=f"Acceleration limit; default: the profile's ({_VEHICLE.max_accel_m_s2:g}).")
    ] = None
    step_m: Annotated[float, Option(help="Sampling distance along the path.")] = _PATH.step_m
    on_steep: Annotated[
        Literal["raise", "slow"],
        Option(help="Where the surface is steeper than the limits: raise the path, or fly slower."),
    ] = _PATH.on_steep


@dataclass(frozen=True, slots=True)
class VehicleOptions:
    """The vehicle of a mission that was planned before: None is as the mission's own file says, or the profile."""

    PANEL: ClassVar = "Vehicle"
    profile: Annotated[
        str | None,
        Option(metavar="NAME|FILE", help=f"{_SHIPPED}; default: the one in the mission's file. Options override it."),
    ] = None
    max_items: Annotated[
        int | None, Option(help=f"Mission items the vehicle takes; default: the profile's ({_VEHICLE.max_items}).")
    ] = None
    position_error_m: Annotated[
        float | None,
        Option(help=f"Standalone GNSS 2.5 m, RTK 0.1 m; default: the profile's ({_VEHICLE.position_error_m:g})."),
    ] = None
    rtl_height_m: Annotated[
        float | None,
        Option(
            help="Return height above home, as set in the autopilot; "
            f"default: the profile's ({_VEHICLE.rtl_height_m:g})."
        ),
    ] = None


@dataclass(frozen=True, slots=True)
class PlannedVehicle(VehicleOptions):
    """The vehicle of a mission that is to be planned."""

    profile: Annotated[str, Option(metavar="NAME|FILE", help=f"{_SHIPPED}. Options override it.")] = DEFAULT_PROFILE


@dataclass(frozen=True, slots=True)
class ClearanceOptions:
    """What is demanded of a mission that was planned before: None is as the mission's own file says."""

    PANEL: ClassVar = "Clearance"
    vehicle_radius_m: Annotated[
        float | None,
        Option(help=f"Half its largest extent, rotors included; default: the profile's ({_VEHICLE.radius_m:g})."),
    ] = None
    following_m: Annotated[
        float | None,
        Option(
            help="Farthest that the autopilot departs from the line; default: as measured, by autopilot, way and speed."
        ),
    ] = None
    dsm_rms_m: Annotated[
        float | None,
        Option(
            help="RMS error of the surface model; three times that is kept. "
            f"Default: the profile's ({_VEHICLE.dsm_rms_m:g})."
        ),
    ] = None
    downwash_m: Annotated[
        float | None, Option(help="Kept for the rotors' downwash; default: by momentum theory from mass and rotors.")
    ] = None
    flown_as: Annotated[Literal["auto", "guided"] | None, Option(help=f"{_FLOWN_AS}; default: as it was planned.")] = (
        None
    )
    required_clearance_m: Annotated[
        float | None,
        Option(
            help="Default: the sum of vehicle radius, position error, following, surface model's accuracy and downwash."
        ),
    ] = None
    max_height_above_ground_m: Annotated[
        float | None, Option(help="Do not certify a flight higher than this, e.g. 120.")
    ] = None


@dataclass(frozen=True, slots=True)
class PlannedClearance(ClearanceOptions):
    """What is demanded of a mission that is to be planned."""

    flown_as: Annotated[Literal["auto", "guided"], Option(help=f"{_FLOWN_AS}: how well the line is followed.")] = "auto"


@dataclass(frozen=True, slots=True)
class MissionOptions:
    """What the path becomes."""

    PANEL: ClassVar = "Mission"
    home: Annotated[str | None, Option(metavar="LAT,LON", help="Take-off place; default: the first point.")] = None
    end: Annotated[Literal["rtl", "land"], Option(help="Return to launch, or fly back and land at home.")] = (
        _MISSION.end
    )
    altitude_reference: Annotated[
        Literal["home", "amsl"], Option(help="Altitudes above home, or above mean sea level (needs a vertical datum).")
    ] = _MISSION.altitude_reference
    excess_height_m: Annotated[
        float, Option(help="Straight legs may run this far above the path: more means fewer waypoints.")
    ] = _MISSION.excess_height_m


@dataclass(frozen=True, slots=True)
class FenceOptions:
    """Where the vehicle may be."""

    PANEL: ClassVar = "Fence"
    fence: Annotated[
        Path | None,
        Option(metavar="FILE", help="Fence and rally points to keep to: .plan, .waypoints, .kml, .kmz or .geojson."),
    ] = None


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """Everything that ``plan`` and ``survey`` ask alike."""

    model: ModelOptions = ModelOptions()
    surface: SurfaceOptions = SurfaceOptions()
    path: PathOptions = PathOptions()
    vehicle: PlannedVehicle = PlannedVehicle()
    clearance: PlannedClearance = PlannedClearance()
    mission: MissionOptions = MissionOptions()
    fence: FenceOptions = FenceOptions()


def of_vehicle(*groups: PathOptions | VehicleOptions | ClearanceOptions) -> dict[str, float]:
    """What was given of the vehicle itself, by the names of ``VehicleProfile``."""
    own = {"vehicle_radius_m": "radius_m"} | {field.name: field.name for field in fields(VehicleProfile)}
    given = {field.name: getattr(group, field.name) for group in groups for field in fields(group)}
    return {own[name]: value for name, value in given.items() if name in own and value is not None}


def existing(path: Path | None) -> Path | None:
    """The path; FormatError when there is no such file."""
    if path is not None and not path.is_file():
        raise FormatError("There is no such file.", where=str(path), advice="Check the path.")
    return path


def parse_place(text: str | None, option: str) -> tuple[float, float] | None:
    """ "LAT,LON" in degrees; None stays None."""
    if text is None:
        return None
    try:
        lat_deg, lon_deg = (float(part) for part in text.split(","))
    except ValueError:
        raise ParameterError(
            f"{text!r} is no place.", where=option, advice="Give LAT,LON in degrees, such as -37.1245,175.6893."
        ) from None
    if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
        raise ParameterError(
            f"{text!r} lies outside the range of degrees.", where=option, advice="Give the latitude first."
        )
    return lat_deg, lon_deg
