"""``hedgehop bag``: what is in a bag of ROS 1 or ROS 2, and the bag as a recording of Hedgehop."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated, Any, Literal

from typer import Argument, Option

from planning.errors import ParameterError
from server.cli.maps.bag_options import BagOptions, as_recording
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.files_in_out import check_directory
from server.cli.shared.output import answer, end_progress, harmless, progress, say_notes
from server.errors import StorageError
from server.library.shelf import iso_utc
from telemetry.recording.ros.bag import BagTable, BagTopic, bag_kind, list_bag
from telemetry.topics.obstacles import Sensor

NOTHING = BagOptions()
KINDS = {"ros1": "ROS 1 bag", "folder": "ROS 2 bag", "mcap": "ROS 2 bag (MCAP)", "db3": "ROS 2 bag (SQLite)"}


@command
def bag(
    file: Annotated[Path, Argument(metavar="BAG", help="A .bag, an .mcap, a .db3, or the folder with metadata.yaml.")],
    out: Annotated[
        Path | None, Option(metavar="FILE", help="Make a recording of it (.mcap), which Review opens; needs --points.")
    ] = None,
    sensor: Annotated[Literal["radar", "vision", "ranges"], Option(help="What its points count as.")] = "radar",
    given: BagOptions = NOTHING,
    as_json: o.AsJson = False,
) -> None:
    """List a robot's recording: its topics by type, how many messages each has, and from when until when."""
    if out is not None:
        _make_recording(file, sensor, given, out, as_json=as_json)
        return
    if given != NOTHING:
        what = "Topics and frames are chosen for a recording that is made of a bag."
        raise ParameterError(what, where=file.name, advice="Give --out as well, or the bag's name alone.")
    table = list_bag(file, progress=lambda share: progress("Reading the bag", share))
    end_progress()
    say_notes(f"It is damaged: nothing could be read after a place ({table.fault})." if table.fault else None)
    answer(_json(table), _lines(table), as_json=as_json)


def _make_recording(file: Path, sensor: Sensor, given: BagOptions, out: Path, *, as_json: bool) -> None:
    if out.suffix.lower() != ".mcap":
        raise StorageError("Recordings are MCAP files.", where=out.name, advice="Give --out a name with .mcap.")
    if out.exists():
        raise StorageError("There is such a file already.", where=str(out), advice="Move it, or give another name.")
    check_directory(out.parent)
    if bag_kind(file) is None:
        list_bag(file)  # says what it is instead
    with as_recording(file, sensor, given, placed="a flight in Review") as flight:
        shutil.copyfile(flight, out)
    end_progress()
    size = out.stat().st_size
    answer({"file": str(out), "bytes": size}, [f"{out.name}: a recording, {size / 1e6:.2f} MB"], as_json=as_json)


def _json(table: BagTable) -> dict[str, Any]:
    topics = [
        {
            "topic": topic.name,
            "type": topic.type,
            "messages": topic.count,
            "messages_said": topic.said,
            "first_utc_s": topic.first_utc_s,
            "last_utc_s": topic.last_utc_s,
        }
        for topic in table.topics
    ]
    return {"kind": table.kind, "fault": table.fault or None, "topics": topics}


def _lines(table: BagTable) -> list[str]:
    """What is understood first, then the others; each by its type."""
    lines = [f"{KINDS[table.kind]}, {sum(topic.count for topic in table.topics):,} messages"]
    for topic in sorted(table.topics, key=lambda topic: (not topic.is_known, topic.type, topic.name)):
        short = "/".join(topic.type.split("/")[::2])
        lines.append(f"{harmless(short):34s} {harmless(topic.name):36s} {topic.count:9,d}  {_when(topic)}".rstrip())
    return lines


def _when(topic: BagTopic) -> str:
    first_s, last_s = topic.first_utc_s, topic.last_utc_s
    if first_s is None or last_s is None:
        return ""
    begun = iso_utc(first_s) if 0.0 <= first_s < 4e9 else f"{first_s:.3f} s"
    return f"{begun} + {last_s - first_s:.1f} s"
