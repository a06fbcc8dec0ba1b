"""The real link node under the real supervisor: killed, it beats again for a vehicle that has said nothing since."""

import asyncio
import os
import signal
import time
from pathlib import Path

from server.work.supervisor import Supervisor
from telemetry.bus.bus import Bus
from telemetry.bus.node_lock import running_node
from telemetry.nodes.link import read_memory
from tests.free_ports import free_port
from tests.telemetry.bus_runs import run, short_folder
from tests.telemetry.fake_vehicle import UdpVehicle
from tests.telemetry.frames import heartbeat
from tests.telemetry.link_bench import until

LOADED_S = 15.0
"""At a load of ten for each processor; on a quiet machine it takes less than a second."""


def test_a_killed_link_beats_again_without_waiting_for_a_word_of_its_vehicle() -> None:
    async def whole(runtime: Path) -> None:
        port = free_port()
        vehicle = UdpVehicle(port)
        supervisor = Supervisor(runtime, changed=lambda _: None)
        async with await Bus.open(runtime, "server"), asyncio.TaskGroup() as tasks:
            keeping = tasks.create_task(supervisor.run())
            await supervisor.start("link", ["--link", f"udpin:127.0.0.1:{port}"])

            def adopted() -> bool:
                vehicle.send(heartbeat())
                return bool(vehicle.of("HEARTBEAT")) and read_memory(runtime / "link.json").adopted is not None

            await until(adopted)
            facts = running_node(runtime, "link")
            assert facts is not None
            os.kill(facts.pid, signal.SIGKILL)
            killed_s = time.monotonic()
            await until(lambda: running_node(runtime, "link") is None)
            vehicle.heard.clear()
            await until(lambda: vehicle.of("HEARTBEAT"))
            assert time.monotonic() - killed_s < LOADED_S
            await supervisor.stop("link")
            keeping.cancel()
        vehicle.close()

    with short_folder() as folder:
        run(lambda: whole(folder / "run"))
