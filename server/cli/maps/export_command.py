"""``hedgehop export``: a recording of Hedgehop for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.files_in_out import check_directory
from server.cli.shared.output import answer, say_notes
from server.errors import StorageError
from telemetry.recording.ros.ros2_export import export_ros2


@command
def export(
    recording: Annotated[Path, Argument(metavar="RECORDING", help="A recording of Hedgehop (.mcap).")],
    *,
    ros2: Annotated[Path, Option(metavar="FILE", help="The ROS 2 bag to write: .mcap.")],
    as_json: o.AsJson = False,
) -> None:
    """Write a recording as a ROS 2 bag: Odometry, TF, NavSatFix, and PointCloud2 of radar and camera."""
    if ros2.suffix.lower() != ".mcap":
        raise StorageError("ROS 2 bags are written as MCAP.", where=ros2.name, advice="Give --ros2 a name with .mcap.")
    if ros2.exists():
        raise StorageError("There is such a file already.", where=str(ros2), advice="Move it, or give another name.")
    check_directory(ros2.parent)
    made = export_ros2(recording, ros2)
    say_notes(*made.faults)
    lines = [
        f"{ros2.name}: a ROS 2 bag",
        *(f"  {topic}: {count:,} messages" for topic, count in made.messages.items()),
    ]
    answer({"file": str(ros2), "messages": made.messages, "faults": list(made.faults)}, lines, as_json=as_json)
