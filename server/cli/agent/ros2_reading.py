"""What ``hedgehop agent`` reads of a robot of ROS 2."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Annotated, ClassVar, Literal

from typer import Option

from server.cli.shared.ros2_options import Ros2Reach
from server.errors import BadRequestError
from telemetry.agent.ros2_source import Ros2Asked
from telemetry.ros2.grammar import topic_name


@dataclass(frozen=True, slots=True)
class Ros2Options:
    """All but ``ros2`` mean something with it only."""

    PANEL: ClassVar = "ROS 2"
    ros2: Annotated[bool, Option("--ros2", help="Read topics of ROS 2, over rmw_zenoh; no ROS is needed.")] = False
    points: Annotated[str | None, Option(metavar="TOPIC", help="PointCloud2, LaserScan or Range.")] = None
    sensor: Annotated[
        Literal["radar", "vision"], Option(help="What its points count as; radar: with radial speed and snr.")
    ] = "radar"
    pose: Annotated[str | None, Option(metavar="TOPIC", help="Odometry, PoseStamped, or /tf; vision needs one.")] = None
    frame: Annotated[
        str | None, Option(metavar="NAME", help="The robot's frame; default: as its Odometry says, else base_link.")
    ] = None
    reach: Ros2Reach = field(default_factory=Ros2Reach)

    def check(self) -> None:
        """Raises BadRequestError, and Ros2AddressError for an address that is not reached."""
        if not self.ros2:
            groups = (self, self.reach)
            own = [
                each.name
                for group in groups
                for each in fields(group)
                if each.name != "reach" and getattr(group, each.name) != each.default
            ]
            if own:
                names = ", ".join(f"--{name}" for name in own)
                raise BadRequestError(f"{names} only means something with --ros2.", advice="Add --ros2.")
            return
        if self.points is None:
            raise BadRequestError(
                "Which points are to be read?",
                where="--points",
                advice="Name a topic; hedgehop ros2 topics lists them.",
            )
        if self.sensor == "vision" and self.pose is None:
            advice = "Give --pose: an Odometry, a PoseStamped, or /tf."
            raise BadRequestError("A vision map stands in the robot's own frame.", where="--pose", advice=advice)
        topic_name(self.points)
        if self.pose is not None:
            topic_name(self.pose)
        self.reach.address()

    def asked(self) -> Ros2Asked:
        """Of options that were checked."""
        pose = None if self.pose is None else topic_name(self.pose)
        return Ros2Asked(topic_name(self.points or ""), self.sensor, pose, self.frame, self.reach.domain)
