"""``hedgehop map``: the map of obstacles of a recording, a bag of ROS or a log, made from what its sensors saw."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer import Argument, Option

from mapping.errors import ParameterError
from planning.errors import DescribedError
from server.cli.maps.bag_options import BagOptions, as_recording, refuse_for_recordings
from server.cli.maps.made_map import MapOrder, lines_of, made_map, make_all
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.output import answer, end_progress, progress, say_notes
from telemetry.perception.rebuilding.export import KINDS as FORMATS
from telemetry.perception.rebuilding.export import Kind
from telemetry.perception.rebuilding.rebuild import OtherMap
from telemetry.perception.sensor_kinds import check_memory

NO_BAG = BagOptions()
ON_EARTH = frozenset({"tif", "geojson"})
"""Formats that say where on Earth, and how high above the sea."""


class MapFileError(DescribedError):
    """A file name that says no format."""

    code = "map_file"


@command
def build_map(
    recording: Annotated[
        Path,
        Argument(
            metavar="RECORDING",
            help="A recording of Hedgehop (.mcap), a bag of ROS, or a log (.bin, .ulg, .tlog); with --all a folder.",
        ),
    ],
    sensor: Annotated[Literal["radar", "vision", "ranges"], Option(help="Whose map.")],
    out: Annotated[
        Path,
        Option(
            metavar="FILE",
            help="Ends with .ply, .pcd, .bt, .mcap (octomap_msgs), .tif or .geojson; with --all a folder.",
        ),
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
    of_all: Annotated[bool, Option("--all", help="Of every recording of Hedgehop in the folder.")] = False,
    form: Annotated[str | None, Option("--format", metavar="NAME", help="With --all; default: ply.")] = None,
    cluster: o.Cluster = None,
    bag: BagOptions = NO_BAG,
    as_json: o.AsJson = False,
) -> None:
    """Build a recording's map of obstacles again, as it was in flight or otherwise; or that of a bag or a log."""
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
    if of_all:
        refuse_for_recordings(recording, bag)
        entries = make_all(recording, out, sensor, _kind(form or "ply", "--format"), other, cluster)
        made = [entry for entry in entries if "error" not in entry]
        lines = [line for entry in made for line in lines_of(entry, Path(entry["file"]))]
        answer({"maps": entries}, [*lines, f"{len(made)} of {len(entries)} recordings have a map."], as_json=as_json)
        raise typer.Exit(DONE if len(made) == len(entries) else FAILED)
    if form is not None or cluster is not None:
        what = "--format and --cluster mean something with --all only."
        raise ParameterError(what, where="--all", advice="Name the file by its format, and leave both out.")
    kind = _kind(out.suffix.lower().removeprefix("."), out.name)
    with as_recording(recording, sensor, bag, placed=f"a .{kind}" if kind in ON_EARTH else None) as flight:
        made_one = made_map(MapOrder(flight, sensor, kind, other), lambda share: progress("Building the map", share))
    end_progress()
    say_notes(*made_one.notes)
    out.write_bytes(made_one.data)
    answer(made_one.summary, lines_of(made_one.summary, out), as_json=as_json)


def _kind(name: str, where: str) -> Kind:
    kind: Kind | None = next((known for known in FORMATS if known == name), None)
    if kind is None:
        what = f"{name or 'No ending'} is no format of maps."
        raise MapFileError(what, where=where, advice=f"Choose {', '.join(f'.{known}' for known in FORMATS)}.")
    return kind


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
