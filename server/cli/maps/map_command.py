"""``hedgehop map``: the map of obstacles of a recording or a bag of ROS, made from what its sensors saw."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Annotated, Any, Literal

from typer import Argument, Option

from mapping.errors import ParameterError
from planning.errors import DescribedError
from server.cli.maps.bag_options import BagOptions, as_recording
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, end_progress, progress, say_notes
from telemetry.perception.rebuilding.export import KINDS as FORMATS
from telemetry.perception.rebuilding.export import ExportError, Kind, exported
from telemetry.perception.rebuilding.rebuild import OtherMap, Rebuilt, rebuild
from telemetry.perception.sensor_kinds import KINDS, check_memory

NO_BAG = BagOptions()
ON_EARTH = frozenset({"tif", "geojson"})
"""Formats that say where on Earth, and how high above the sea."""


class MapFileError(DescribedError):
    """A file name that says no format."""

    code = "map_file"


@command
def build_map(
    recording: Annotated[Path, Argument(metavar="RECORDING", help="A recording of Hedgehop (.mcap), or a bag of ROS.")],
    sensor: Annotated[Literal["radar", "vision", "ranges"], Option(help="Whose map.")],
    out: Annotated[
        Path, Option(metavar="FILE", help="Ends with .ply, .pcd, .bt, .mcap (octomap_msgs), .tif or .geojson.")
    ],
    resolution_m: Annotated[float | None, Option(metavar="M", help="Edge of a voxel; default: as in flight.")] = None,
    memory_mb: Annotated[
        float | None, Option(metavar="MB", help="The map's memory limit; default: as in flight.")
    ] = None,
    radar_variant: Annotated[
        Literal["heading-only", "full-attitude", "full-attitude-flat"] | None,
        Option(help="How radar targets are put into the map; default: as in flight."),
    ] = None,
    azimuth_deg: Annotated[
        float | None, Option("--radar-azimuth-deg", help="Radar targets to both sides up to; default: as in flight.")
    ] = None,
    low_deg: Annotated[
        float | None, Option("--radar-low-deg", help="And from this elevation; default: as in flight.")
    ] = None,
    high_deg: Annotated[float | None, Option("--radar-high-deg", help="Up to this one; default: as in flight.")] = None,
    cloud_voxel_m: Annotated[
        float | None,
        Option(
            metavar="M", help="Of the camera's clouds one point per voxel of this edge, 0: all; default: as in flight."
        ),
    ] = None,
    whole_flight: Annotated[
        bool, Option("--whole-flight", help="Of the camera: all that it saw on its way, not its last frame alone.")
    ] = False,
    bag: BagOptions = NO_BAG,
    as_json: o.AsJson = False,
) -> None:
    """Build a recording's map of obstacles again, exactly as it was in flight or otherwise; or that of a bag of ROS."""
    kind: Kind | None = next((name for name in FORMATS if out.suffix.lower() == f".{name}"), None)
    if kind is None:
        what = f"{out.suffix or 'No ending'} is no format of maps."
        raise MapFileError(what, where=out.name, advice="Choose .ply, .pcd, .bt, .mcap, .tif or .geojson.")
    began_s = time.monotonic()
    other = OtherMap(
        resolution_m,
        _limit_bytes(memory_mb),
        _variant(radar_variant),
        azimuth_deg,
        low_deg,
        high_deg,
        cloud_voxel_m,
        whole_flight,
    )
    with as_recording(recording, sensor, bag, placed=f"a .{kind}" if kind in ON_EARTH else None) as flight:
        built = rebuild(flight, KINDS[sensor], other=other, progress=lambda share: progress("Building the map", share))
    end_progress()
    say_notes(*built.notes)
    _check_not_empty(built, recording)
    out.write_bytes(exported(kind, built.folded))
    answer(_summary(built, time.monotonic() - began_s), _lines(built, out), as_json=as_json)


def _check_not_empty(built: Rebuilt, recording: Path) -> None:
    if built.voxels_occupied == 0:
        raise ExportError(
            f"The map is empty: {built.frames:,} frames with {built.points:,} points went into it, "
            f"{built.dropped:,} were not taken.",
            where=recording.name,
            advice="Choose another sensor, or a recording in which something was seen.",
        )


def _variant(name: str | None) -> Any:
    return None if name is None else name.replace("-", "_")


def _limit_bytes(memory_mb: float | None) -> int | None:
    """Raises CapacityError for more than this computer has, ParameterError for what is no size."""
    if memory_mb is None:
        return None
    if not (math.isfinite(memory_mb) and memory_mb > 0.0):
        raise ParameterError(f"{memory_mb:g} MB is no size of a map.", where="--memory-mb", advice="Try 1000.")
    limit_bytes = round(memory_mb * 1e6)
    check_memory(limit_bytes, maps=1)
    return limit_bytes


def _lines(built: Rebuilt, out: Path) -> list[str]:
    east_m, north_m, up_m = built.extent_m
    size = f"{east_m:.0f} x {north_m:.0f} x {up_m:.0f} m"
    return [
        f"{out.name}: {built.voxels_occupied:,} occupied voxels of {built.resolution_m:g} m in {size}",
        f"  of {built.frames:,} frames with {built.points:,} points; {built.dropped:,} frames were not taken",
    ]


def _summary(built: Rebuilt, seconds: float) -> dict[str, Any]:
    return {
        "frames": built.frames,
        "dropped": built.dropped,
        "points": built.points,
        "voxels_occupied": built.voxels_occupied,
        "resolution_m": built.resolution_m,
        "left_out": built.left_out,
        "extent_m": list(built.extent_m),
        "seconds": round(seconds, 3),
    }
