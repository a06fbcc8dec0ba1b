"""How commands reach ROS 2: the router or peer of rmw_zenoh, and the domain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from typer import Option

from server.errors import BadRequestError
from telemetry.ros2.grammar import MOST_DOMAIN
from telemetry.ros2.zenoh_endpoint import HERE, ZenohAddress, zenoh_address


@dataclass(frozen=True, slots=True)
class Ros2Reach:
    """Only the address that is named here is reached."""

    PANEL: ClassVar = "ROS 2"
    domain: Annotated[int, Option(metavar="N", help="ROS_DOMAIN_ID of the robot.")] = 0
    router: Annotated[
        str | None, Option(metavar="ADDR", help=f"Router of rmw_zenoh: HOST or HOST:PORT; default: {HERE}.")
    ] = None
    peer: Annotated[
        str | None, Option(metavar="ADDR", help="Instead of a router: the port at which one ROS 2 program listens.")
    ] = None

    def address(self) -> ZenohAddress:
        """Raises BadRequestError and Ros2AddressError."""
        if not 0 <= self.domain <= MOST_DOMAIN:
            raise BadRequestError(
                f"The domain is {self.domain}.", where="--domain", advice=f"Domains are 0 to {MOST_DOMAIN}."
            )
        if self.router is not None and self.peer is not None:
            raise BadRequestError("--router and --peer are two ways.", advice="Give one of them.")
        return zenoh_address(self.peer or self.router or HERE, is_peer=self.peer is not None)
