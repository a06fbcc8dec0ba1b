"""``hedgehop bag``: what is in a bag of ROS 1 or ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Argument

from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, end_progress, harmless, progress, say_notes
from server.library.shelf import iso_utc
from telemetry.recording.ros.bag import BagTable, BagTopic, list_bag

KINDS = {"ros1": "ROS 1 bag", "folder": "ROS 2 bag", "mcap": "ROS 2 bag (MCAP)", "db3": "ROS 2 bag (SQLite)"}


@command
def bag(
    file: Annotated[Path, Argument(metavar="BAG", help="A .bag, an .mcap, a .db3, or the folder with metadata.yaml.")],
    as_json: o.AsJson = False,
) -> None:
    """List a robot's recording: its topics by type, how many messages each has, and from when until when."""
    table = list_bag(file, progress=lambda share: progress("Reading the bag", share))
    end_progress()
    say_notes(f"It is damaged: nothing could be read after a place ({table.fault})." if table.fault else None)
    answer(_json(table), _lines(table), as_json=as_json)


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
