"""Command-line options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

DsmFile = Annotated[Path, typer.Argument(help="Surface model: GeoTIFF or ESRI ASCII grid.", show_default=False)]
Crs = Annotated[str | None, typer.Option("--crs", help="Coordinate system of a model that names none, e.g. EPSG:2193.")]
ZScale = Annotated[float | None, typer.Option("--z-scale", help="Metres per stored unit, e.g. 0.01 for centimetres.")]
VerticalDatum = Annotated[
    str | None,
    typer.Option("--vertical-datum", help='Datum of the heights, e.g. "EGM2008 height"; needed for AMSL altitudes.'),
]
Profile = Annotated[
    str, typer.Option("--profile", help="Vehicle profile: a shipped name or a TOML file. Options below override it.")
]
PositionError = Annotated[
    float | None, typer.Option("--position-error-m", help="Position error: standalone GNSS 2.5 m, RTK 0.1 m.")
]
RequiredClearance = Annotated[
    float | None,
    typer.Option("--required-clearance-m", help="Default: position error + 0.5 m downwash + vehicle radius."),
]
RtlHeight = Annotated[
    float | None, typer.Option("--rtl-height-m", help="Return height above home, as set in the autopilot.")
]
MaxHeight = Annotated[
    float | None, typer.Option("--max-height-above-ground-m", help="Refuse to certify above this height, e.g. 120.")
]
Radius = Annotated[float, typer.Option("--radius-m", help="Radius R of the dilating ball.")]
Smooth = Annotated[float | None, typer.Option("--smooth-m", help="Sigma of the Gaussian; default R / 10.")]
Paper = Annotated[bool, typer.Option("--paper", help="The paper's own pipeline: no floor under the smoothing.")]
MeanSpeed = Annotated[float | None, typer.Option("--mean-speed-m-s", help="Mean speed; default 3 or the profile's.")]
MaxSpeed = Annotated[float | None, typer.Option("--max-speed-m-s", help="Maximum speed; default 5 or the profile's.")]
MaxClimb = Annotated[float | None, typer.Option("--max-climb-m-s", help="Climb limit; default 2.5 or the profile's.")]
MaxDescent = Annotated[
    float | None, typer.Option("--max-descent-m-s", help="Descent limit; default 1.5 or the profile's.")
]
MaxAccel = Annotated[
    float | None, typer.Option("--max-accel-m-s2", help="Acceleration limit; default 2.5 or the profile's.")
]
Step = Annotated[float, typer.Option("--step-m", help="Sampling distance along the path.")]
OnSteep = Annotated[
    str, typer.Option("--on-steep", help='Where the surface is too steep: "raise" the path or fly "slow".')
]
MaxItems = Annotated[int | None, typer.Option("--max-items", help="Mission items the vehicle takes; default 650.")]
Excess = Annotated[
    float, typer.Option("--excess-height-m", help="Straight lines may run this far above the path: fewer waypoints.")
]
Home = Annotated[
    str | None, typer.Option("--home", help="Take-off place LAT,LON; default: the first point.", metavar="LAT,LON")
]
End = Annotated[str, typer.Option("--end", help='"rtl" (return to launch) or "land" (fly back and land at home).')]
AltitudeReference = Annotated[
    str, typer.Option("--altitude-reference", help='"home" or "amsl" (needs a vertical datum).')
]
Gimbal = Annotated[float | None, typer.Option("--gimbal-pitch-deg", help="-90 looks straight down.")]
Out = Annotated[Path, typer.Option("--out", help="Directory for the files.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
