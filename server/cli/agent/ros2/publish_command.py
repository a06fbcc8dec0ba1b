"""``hedgehop ros2 publish``: the vehicle, its alerts and its maps as topics of ROS 2, as long as it runs."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from pathlib import Path
from typing import Annotated

from typer import Option

from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, say
from server.cli.shared.ros2_options import Ros2Reach
from server.errors import NotFoundError
from server.settings import RUNTIME_FOLDER, default_data_dir
from telemetry.bus.bus import Bus
from telemetry.ros2.grammar import topic_name
from telemetry.ros2.outgoing import OUT_TOPICS
from telemetry.ros2.telling import NODE, Ros2Teller
from telemetry.ros2.wire import Ros2Wire
from telemetry.ros2.zenoh_endpoint import ZenohAddress

REACH = Ros2Reach()


@command
def publish(
    reach: Ros2Reach = REACH,
    data_dir: Annotated[
        Path | None, Option(metavar="DIR", help="Of the running station (a vehicle's: DIR/vehicles/2); default: yours.")
    ] = None,
    namespace: Annotated[str, Option(help="Before the topics' names.")] = NODE,
    humble: Annotated[bool, Option("--humble", help="For a robot of humble, whose topics have no hashes.")] = False,
    as_json: o.AsJson = False,
) -> None:
    """Tell a robot of a running station: pose, fix, alerts and occupied voxels. Ctrl+C ends it."""
    address = reach.address()
    topic_name(f"{namespace}/pose")
    folder = (data_dir or default_data_dir()) / RUNTIME_FOLDER
    if not folder.is_dir():
        advice = "Start hedgehop serve first, or name its data directory with --data-dir."
        raise NotFoundError("No station runs there.", where=str(folder.parent), advice=advice)
    counts = asyncio.run(_run(reach, address, folder, namespace, is_humble=humble))
    lines = [f"told: {counts.get(out.name, 0):8,d}  {out.name}" for out in OUT_TOPICS]
    answer({"told": counts}, lines, as_json=as_json)


async def _run(
    reach: Ros2Reach, address: ZenohAddress, folder: Path, namespace: str, *, is_humble: bool
) -> dict[str, int]:
    wire = await asyncio.to_thread(Ros2Wire.open, address, changed=_on_router)
    try:
        teller = Ros2Teller(wire, domain=reach.domain, namespace=namespace, is_humble=is_humble, tell=say)
        async with await Bus.open(folder, f"ros2-{os.getpid()}") as bus:
            names = ", ".join(f"/{namespace}/{out.name}" for out in OUT_TOPICS)
            say(f"Telling {address.endpoint}, domain {reach.domain}: {names}")
            running = asyncio.ensure_future(teller.run(bus))
            for number in (signal.SIGINT, signal.SIGTERM):
                asyncio.get_running_loop().add_signal_handler(number, running.cancel)
            with contextlib.suppress(asyncio.CancelledError):
                await running
    finally:
        await asyncio.to_thread(wire.close)
    return dict(teller.counts)


def _on_router(is_there: bool) -> None:
    say("The router is there." if is_there else "The router is gone: nobody hears; it is tried again.")
