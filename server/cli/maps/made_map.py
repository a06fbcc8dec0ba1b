"""One map as a file's bytes, what is said of it, and how every recording of a folder gets one."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planning.errors import DescribedError, FormatError
from server.cli.shared.files_in_out import check_directory
from server.cli.shared.output import end_progress, progress, say, say_notes
from server.work.cluster import spread
from telemetry.perception.rebuilding.export import ExportError, Kind, exported
from telemetry.perception.rebuilding.rebuild import OtherMap, Rebuilt, rebuild
from telemetry.perception.sensor_kinds import KINDS
from telemetry.topics.obstacles import Sensor


@dataclass(frozen=True, slots=True)
class MapOrder:
    """A recording of Hedgehop, and the map that is wanted of it."""

    recording: Path
    sensor: Sensor
    kind: Kind
    other: OtherMap


@dataclass(frozen=True, slots=True)
class MadeMap:
    data: bytes
    notes: tuple[str, ...]
    summary: dict[str, Any]


def made_map(order: MapOrder, told: Callable[[float], None] | None = None) -> MadeMap:
    """Raises ExportError for an empty one, RecordingError, CapacityError."""
    began_s = time.monotonic()
    built = rebuild(order.recording, KINDS[order.sensor], other=order.other, progress=told or (lambda share: None))
    if built.voxels_occupied == 0:
        raise ExportError(
            f"The map is empty: {built.frames:,} frames with {built.points:,} points went into it, "
            f"{built.dropped:,} were not taken.",
            where=order.recording.name,
            advice="Choose another sensor, or a recording in which something was seen.",
        )
    return MadeMap(exported(order.kind, built.folded), built.notes, _summary(built, time.monotonic() - began_s))


def lines_of(summary: dict[str, Any], out: Path) -> list[str]:
    east_m, north_m, up_m = summary["extent_m"]
    size = f"{east_m:.0f} x {north_m:.0f} x {up_m:.0f} m"
    return [
        f"{out.name}: {summary['voxels_occupied']:,} occupied voxels of {summary['resolution_m']:g} m in {size}",
        f"  of {summary['frames']:,} frames with {summary['points']:,} points; "
        f"{summary['dropped']:,} frames were not taken",
    ]


def make_all(
    folder: Path, out: Path, sensor: Sensor, kind: Kind, other: OtherMap, cluster: str | None
) -> list[dict[str, Any]]:
    """Writes a map for each recording below ``folder`` into ``out``, under the recording's own path and name.

    One entry each: its file and summary, or its error; a recording that has no map keeps none of the others from
    theirs. Raises FormatError for a folder without recordings, ClusterError, OSError.
    """
    if not folder.is_dir():
        raise FormatError("This is no folder.", where=str(folder), advice="Leave --all away, or give a folder.")
    recordings = sorted(path for path in folder.rglob("*.mcap") if path.is_file())
    if not recordings:
        raise FormatError("There is no recording (.mcap) in it.", where=str(folder), advice="Choose another folder.")
    check_directory(out)
    orders = [MapOrder(path.absolute(), sensor, kind, other) for path in recordings]
    found = []
    with closing(spread(_tried, orders, cluster, lambda share: progress("Building maps", share))) as answers:
        for recording, answer in zip(recordings, answers, strict=True):
            end_progress()
            name = recording.relative_to(folder)
            found.append({"recording": str(name)} | _taken(answer, out / name.with_suffix(f".{kind}")))
    return found


def _tried(order: MapOrder) -> MadeMap | DescribedError:
    try:
        return made_map(order)
    except DescribedError as error:
        return error


def _taken(answer: MadeMap | DescribedError, target: Path) -> dict[str, Any]:
    if isinstance(answer, DescribedError):
        say(f"Error: {answer}")
        return {"error": {"code": answer.code, "what": answer.what, "where": answer.where, "advice": answer.advice}}
    say_notes(*(f"{target.name}: {note}" for note in answer.notes))
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(answer.data)
    return {"file": str(target)} | answer.summary


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
