"""Command-line options that several commands share, in the order and groups in which ``--help`` shows them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from planning.errors import FormatError
from planning.missions.vehicle_profile import shipped_profiles

_MODEL, _SURFACE, _PATH = "Surface model", "Surface to fly on", "Path and speeds"
_VEHICLE, _CLEARANCE, _MISSION = "Vehicle", "Clearance", "Mission"

DsmFile = Annotated[
    Path, typer.Argument(metavar="DSM", help="Surface model: GeoTIFF or ESRI ASCII grid.", show_default=False)
]
FlightDsm = Annotated[
    Path | None,
    typer.Option("--dsm", metavar="FILE", help="Surface model that is flown over: GeoTIFF or ESRI ASCII grid."),
]
MissionFile = Annotated[
    Path, typer.Argument(metavar="MISSION", help="Mission: .waypoints or .plan.", show_default=False)
]
Link = Annotated[
    str,
    typer.Option(
        "--link",
        metavar="URL",
        help="Connection to the vehicle: udpin:0.0.0.0:14550, tcp:10.0.0.7:5760, /dev/ttyACM0:57600.",
        show_default=False,
    ),
]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Directory for the files.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout, messages on stderr.")]

Crs = Annotated[
    str | None,
    typer.Option("--crs", help="Coordinate system of a model that names none: EPSG:2193.", rich_help_panel=_MODEL),
]
ZScale = Annotated[
    float | None,
    typer.Option("--z-scale", help="Metres per stored unit: 0.01 for centimetres.", rich_help_panel=_MODEL),
]
VerticalDatum = Annotated[
    str | None,
    typer.Option(
        "--vertical-datum",
        help='Datum of the heights: "EGM2008 height", "ellipsoid". AMSL altitudes need one.',
        rich_help_panel=_MODEL,
    ),
]
MaxHole = Annotated[
    float,
    typer.Option(
        "--max-hole-m2",
        help="Holes of unknown cells smaller than this are filled with the highest cell around them; 0 keeps each "
        "one a column of infinite height.",
        rich_help_panel=_MODEL,
    ),
]
RemoveSpikes = Annotated[
    bool,
    typer.Option(
        "--remove-spikes",
        help="Take isolated spikes and pits for errors of the model, and out of it. Look at each one first: "
        "it may be a mast.",
        rich_help_panel=_MODEL,
    ),
]

Radius = Annotated[float, typer.Option("--radius-m", help="Radius R of the dilating ball.", rich_help_panel=_SURFACE)]
Height = Annotated[float, typer.Option("--height-m", help="Height H of the dilating ball.", rich_help_panel=_SURFACE)]
Smooth = Annotated[
    float | None, typer.Option("--smooth-m", help="Sigma of the Gaussian; default R / 10.", rich_help_panel=_SURFACE)
]
Paper = Annotated[
    bool,
    typer.Option("--paper", help="The paper's own pipeline: no floor under the smoothing.", rich_help_panel=_SURFACE),
]

MeanSpeed = Annotated[
    float | None,
    typer.Option(
        "--mean-speed-m-s", help="Mean speed between points; default: the profile's (3).", rich_help_panel=_PATH
    ),
]
MaxSpeed = Annotated[
    float | None,
    typer.Option(
        "--max-speed-m-s", help="Top speed, at most twice the mean; default: the profile's (5).", rich_help_panel=_PATH
    ),
]
MaxClimb = Annotated[
    float | None,
    typer.Option("--max-climb-m-s", help="Climb limit; default: the profile's (2.5).", rich_help_panel=_PATH),
]
MaxDescent = Annotated[
    float | None,
    typer.Option("--max-descent-m-s", help="Descent limit; default: the profile's (1.5).", rich_help_panel=_PATH),
]
MaxAccel = Annotated[
    float | None,
    typer.Option("--max-accel-m-s2", help="Acceleration limit; default: the profile's (2.5).", rich_help_panel=_PATH),
]
Step = Annotated[float, typer.Option("--step-m", help="Sampling distance along the path.", rich_help_panel=_PATH)]
OnSteep = Annotated[
    Literal["raise", "slow"],
    typer.Option(
        "--on-steep",
        help="Where the surface is steeper than the limits: raise the path, or fly slower.",
        rich_help_panel=_PATH,
    ),
]

Profile = Annotated[
    str,
    typer.Option(
        "--profile",
        metavar="NAME|FILE",
        help=f"A shipped profile ({', '.join(shipped_profiles())}) or a TOML file. Options override it.",
        rich_help_panel=_VEHICLE,
    ),
]
MissionProfile = Annotated[
    str | None,
    typer.Option(
        "--profile",
        metavar="NAME|FILE",
        help=(
            f"A shipped profile ({', '.join(shipped_profiles())}) or a TOML file; default: the one in the mission's"
            " file. Options override it."
        ),
        rich_help_panel=_VEHICLE,
    ),
]
MaxItems = Annotated[
    int | None,
    typer.Option(
        "--max-items", help="Mission items the vehicle takes; default: the profile's (650).", rich_help_panel=_VEHICLE
    ),
]
PositionError = Annotated[
    float | None,
    typer.Option(
        "--position-error-m",
        help="Standalone GNSS 2.5 m, RTK 0.1 m; default: the profile's (2.5).",
        rich_help_panel=_VEHICLE,
    ),
]
RtlHeight = Annotated[
    float | None,
    typer.Option(
        "--rtl-height-m",
        help="Return height above home, as set in the autopilot; default: the profile's (30).",
        rich_help_panel=_VEHICLE,
    ),
]
MissionFlownAs = Annotated[
    Literal["auto", "guided"] | None,
    typer.Option(
        "--flown-as",
        help="Mission on board, or waypoints handed over one at a time; default: as it was planned.",
        rich_help_panel=_CLEARANCE,
    ),
]
RequiredClearance = Annotated[
    float | None,
    typer.Option(
        "--required-clearance-m",
        help="Default: the sum of vehicle radius, position error, following, surface model's accuracy and downwash.",
        rich_help_panel=_CLEARANCE,
    ),
]
VehicleRadius = Annotated[
    float | None,
    typer.Option(
        "--vehicle-radius-m",
        help="Half its largest extent, rotors included; default: the profile's (0.35).",
        rich_help_panel=_CLEARANCE,
    ),
]
FollowingError = Annotated[
    float | None,
    typer.Option(
        "--following-m",
        help="Farthest that the autopilot departs from the line; default: as measured, by autopilot, way and speed.",
        rich_help_panel=_CLEARANCE,
    ),
]
DsmRms = Annotated[
    float | None,
    typer.Option(
        "--dsm-rms-m",
        help="RMS error of the surface model; three times that is kept. Default: the profile's (0.023).",
        rich_help_panel=_CLEARANCE,
    ),
]
Downwash = Annotated[
    float | None,
    typer.Option(
        "--downwash-m",
        help="Kept for the rotors' downwash; default: by momentum theory from mass and rotors.",
        rich_help_panel=_CLEARANCE,
    ),
]
FlownAs = Annotated[
    Literal["auto", "guided"],
    typer.Option(
        "--flown-as",
        help="Mission on board, or waypoints handed over one at a time: how well the line is followed.",
        rich_help_panel=_CLEARANCE,
    ),
]
MaxHeight = Annotated[
    float | None,
    typer.Option(
        "--max-height-above-ground-m",
        help="Do not certify a flight higher than this, e.g. 120.",
        rich_help_panel=_CLEARANCE,
    ),
]

Home = Annotated[
    str | None,
    typer.Option(
        "--home", metavar="LAT,LON", help="Take-off place; default: the first point.", rich_help_panel=_MISSION
    ),
]
End = Annotated[
    Literal["rtl", "land"],
    typer.Option("--end", help="Return to launch, or fly back and land at home.", rich_help_panel=_MISSION),
]
AltitudeReference = Annotated[
    Literal["home", "amsl"],
    typer.Option(
        "--altitude-reference",
        help="Altitudes above home, or above mean sea level (needs a vertical datum).",
        rich_help_panel=_MISSION,
    ),
]
Excess = Annotated[
    float,
    typer.Option(
        "--excess-height-m",
        help="Straight legs may run this far above the path: more means fewer waypoints.",
        rich_help_panel=_MISSION,
    ),
]
ShortestOrder = Annotated[
    bool,
    typer.Option("--shortest-order", help="Visit the points in the shortest order.", rich_help_panel=_MISSION),
]
Loiter = Annotated[
    float | None,
    typer.Option(
        "--loiter-s", help="Seconds to wait at each point whose file asks for none.", rich_help_panel=_MISSION
    ),
]
Heading = Annotated[
    Literal["path", "fixed", "point"] | None,
    typer.Option(
        "--heading",
        help="Nose along the path (default), in a fixed direction, or toward a point.",
        rich_help_panel=_MISSION,
    ),
]
HeadingDeg = Annotated[
    float | None,
    typer.Option("--heading-deg", help="The fixed direction, clockwise from north.", rich_help_panel=_MISSION),
]
LookAt = Annotated[
    str | None,
    typer.Option("--look-at", metavar="LAT,LON", help="The point to look at.", rich_help_panel=_MISSION),
]
Gimbal = Annotated[
    float | None,
    typer.Option("--gimbal-pitch-deg", help="-90 looks straight down.", rich_help_panel=_MISSION),
]
CameraTrigger = Annotated[
    float | None,
    typer.Option("--camera-trigger-m", help="Take a photo every so many metres.", rich_help_panel=_MISSION),
]


def existing(path: Path | None) -> Path | None:
    """The path; FormatError when there is no such file."""
    if path is not None and not path.is_file():
        raise FormatError("There is no such file.", where=str(path), advice="Check the path.")
    return path
