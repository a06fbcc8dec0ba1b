"""A vehicle made of MAVSDK's server side, as a process of its own: ``python -m tests.telemetry.mavsdk_vehicle URL``.

It speaks another implementation's mission protocol (it asks with MISSION_REQUEST_INT), can be armed and put in GUIDED,
and stands on the ground. ``URL`` is MAVSDK's spelling, such as ``udpout://127.0.0.1:14550`` or ``tcpin://127.0.0.1:5790``.
Prints ``ready`` when it is up and one line of JSON for every mission that it has taken.
"""

from __future__ import annotations

import asyncio
import json
import sys

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action_server import ActionServerAsync
from mavsdk.asyncio.plugins.mission_raw_server import MissionRawServerAsync
from mavsdk.asyncio.plugins.param_server import ParamServerAsync
from mavsdk.asyncio.plugins.telemetry_server import (
    Battery,
    Heading,
    LandedState,
    Position,
    TelemetryServerAsync,
    VelocityNed,
    VtolState,
)

HOME = (-37.1244507, 175.6892878, 803.24)
PUBLISH_S = 0.1


async def tell_missions(missions: MissionRawServerAsync) -> None:
    async for _, plan in missions.subscribe_incoming_mission():
        rows = [[item.seq, item.frame, item.command, item.x, item.y, item.z] for item in plan.mission_items]
        print(json.dumps(rows), flush=True)


async def publish(telemetry: TelemetryServerAsync) -> None:
    position = Position(HOME[0], HOME[1], HOME[2], 0.0)
    while True:
        await telemetry.publish_position(position, VelocityNed(0.0, 0.0, 0.0), Heading(0.0))
        await telemetry.publish_home(position)
        await telemetry.publish_sys_status(Battery(), True, True, True, True, True)
        await telemetry.publish_extended_sys_state(VtolState.UNDEFINED, LandedState.ON_GROUND)
        await asyncio.sleep(PUBLISH_S)


async def live(url: str) -> None:
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.AUTOPILOT)) as sdk:
        component = await sdk.server_component()
        assert component is not None
        parameters = ParamServerAsync(component)
        for name, value in (("MIS_TAKEOFF_ALT", 5.0), ("RTL_RETURN_ALT", 30.0)):
            await parameters.provide_param_float(name, value)
        missions, telemetry = MissionRawServerAsync(component), TelemetryServerAsync(component)
        action = ActionServerAsync(component)
        await action.set_armable(True, True)
        await action.set_disarmable(True, True)
        await sdk.add_any_connection(url)
        print("ready", flush=True)
        await asyncio.gather(tell_missions(missions), publish(telemetry))


if __name__ == "__main__":
    asyncio.run(live(sys.argv[1]))
