"""What ``hedgehop map`` asks of a bag of ROS, and the recording that a bag, or a log, becomes for it."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, ClassVar

from typer import Option

from server.cli.shared.output import progress, say_notes
from telemetry.errors import RecordingError
from telemetry.perception.rebuilding.log_readers import LogKind, log_kind
from telemetry.perception.rebuilding.range_flight import write_range_flight
from telemetry.recording.ros.bag import bag_kind, list_bag
from telemetry.recording.ros.bag_flight import BagAsked, BagFlight, write_bag_flight
from telemetry.recording.ros.bag_types import BAG_POINT_TYPES
from telemetry.recording.ros.placing import MOST_GAP_S
from telemetry.topics.obstacles import Sensor


@dataclass(frozen=True, slots=True)
class BagOptions:
    """Options of a bag; a recording of Hedgehop has none of them."""

    PANEL: ClassVar = "Bags of ROS"
    points: Annotated[
        str | None, Option(metavar="TOPIC", help="PointCloud2, LaserScan, Range or Livox's CustomMsg.")
    ] = None
    pose: Annotated[
        str | None,
        Option(metavar="TOPIC", help="Odometry, PoseStamped, or /tf; default: the only one, else the transforms."),
    ] = None
    frame: Annotated[
        str | None, Option(metavar="NAME", help="The robot's frame; default: as its poses say, else base_link.")
    ] = None
    max_gap_s: Annotated[float, Option(metavar="S", help="Gaps in poses and transforms up to this are bridged.")] = (
        MOST_GAP_S
    )
    home_alt_amsl_m: Annotated[
        float | None,
        Option(metavar="M", help="Height of the first pose above sea level, for .tif and .geojson; needs a NavSatFix."),
    ] = None


@contextmanager
def as_recording(path: Path, sensor: Sensor, given: BagOptions, *, placed: str | None) -> Iterator[Path]:
    """The path itself; of a bag, or a log, a recording that is made of it and is gone afterwards.

    ``placed``: what must lie somewhere on Earth; None: nothing must.
    """
    is_bag = bag_kind(path) is not None
    if not is_bag:
        refuse_for_recordings(path, given)
    kind = None if is_bag else log_kind(path)
    if not is_bag and kind is None:
        yield path
        return
    path = path.resolve()  # "." has no name
    with tempfile.TemporaryDirectory(prefix="hedgehop-map-") as folder:
        if kind is not None:
            out = Path(folder) / path.name  # errors say it
            _write_log(path, kind, sensor, out)
            yield out
            return
        # The name is the bag's: errors say it.
        out = Path(folder) / path.with_suffix(".mcap").name
        flight = _written(path, sensor, given, out)
        if placed is not None and not flight.is_on_earth:
            what = f"Nothing tells where on Earth, and how high above the sea, {placed} lies."
            advice = "Give --home-alt-amsl-m, with a NavSatFix in the bag; a .ply or .bt needs no place."
            raise RecordingError(what, where=path.name, advice=advice)
        yield out


def _write_log(path: Path, kind: LogKind, sensor: Sensor, out: Path) -> None:
    if sensor != "ranges":
        what = f"A log of this kind holds single distances, and nothing of a {sensor}."
        raise RecordingError(what, where=path.name, advice="Give --sensor ranges.")
    progress("Reading the log", 0.0)
    flight = write_range_flight(path, out, kind, progress=lambda share: progress("Placing distances", share))
    say_notes(*flight.notes)


def _written(path: Path, sensor: Sensor, given: BagOptions, out: Path) -> BagFlight:
    table = list_bag(path, progress=lambda share: progress("Looking through the bag", share))
    if given.points is None:
        listed = [f"{topic.name} ({topic.count:,})" for topic in table.of_types(BAG_POINT_TYPES)]
        advice = f"Give --points: {', '.join(listed[:20])}." if listed else "It holds no topic with points."
        raise RecordingError("Which points of the bag are to be mapped?", where=path.name, advice=advice)
    asked = BagAsked(given.points, given.pose, given.frame, given.max_gap_s, given.home_alt_amsl_m)
    flight = write_bag_flight(
        path, table, asked, sensor, out, progress=lambda share: progress("Reading the bag", share)
    )
    say_notes(*flight.notes)
    return flight


def refuse_for_recordings(path: Path, given: BagOptions) -> None:
    other = [field.name for field in fields(given) if getattr(given, field.name) != field.default]
    if other:
        names = ", ".join(f"--{name.replace('_', '-')}" for name in other)
        raise RecordingError(f"{names} only means something for a bag of ROS.", where=path.name, advice="Leave it out.")
