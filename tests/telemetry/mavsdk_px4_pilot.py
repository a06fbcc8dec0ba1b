"""Flies a PX4 with MAVSDK, as a process of its own: ``python -m tests.telemetry.mavsdk_px4_pilot URL LAT LON``.

A mission to its end, parameters, and OFFBOARD. Prints one line of JSON: what it saw.
"""

from __future__ import annotations

import asyncio
import json
import sys
from typing import Any

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionItem, MissionRawAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

from tests.telemetry.mavsdk_pilot import ABOVE_HOME_INT, PATIENCE_S, RETURN, TAKEOFF, WAYPOINT, first

IN_MISSION_FRAME = 2


def mission(lat_e7: int, lon_e7: int) -> list[MissionItem]:
    rows = [
        (ABOVE_HOME_INT, TAKEOFF, 0.0, lat_e7, lon_e7, 10.0),
        (ABOVE_HOME_INT, WAYPOINT, 1.6, lat_e7 + 1500, lon_e7, 12.34),
        (ABOVE_HOME_INT, WAYPOINT, 0.0, lat_e7 + 1500, lon_e7 + 1500, 15.5),
        (IN_MISSION_FRAME, RETURN, 0.0, 0, 0, 0.0),
    ]
    return [
        MissionItem(seq, frame, command, int(seq == 0), 1, held_s, 0.0, 0.0, float("nan"), x, y, z, 0)
        for seq, (frame, command, held_s, x, y, z) in enumerate(rows)
    ]


async def fly(url: str, lat_e7: int, lon_e7: int) -> dict[str, Any]:
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as sdk:
        await sdk.add_any_connection(url)
        system = await sdk.first_autopilot(timeout_s=PATIENCE_S)
        assert system is not None, f"no autopilot at {url}"
        telemetry, action, raw = TelemetryAsync(system), ActionAsync(system), MissionRawAsync(system)
        autopilot, parameters = await system.autopilot_type(), ParamAsync(system)
        await first(telemetry.subscribe_health(), lambda health: health.is_armable and health.is_global_position_ok)
        cone = await parameters.get_param_int("RTL_CONE_ANG")
        await parameters.set_param_float("RTL_RETURN_ALT", 17.5)
        await raw.upload_mission(mission(lat_e7, lon_e7))
        kept = await raw.download_mission()
        await action.arm()
        await raw.start_mission()
        highest = await first(telemetry.subscribe_position(), lambda position: position.relative_altitude_m > 14)
        await first(telemetry.subscribe_armed(), lambda armed: not armed)
        return {
            "autopilot": autopilot.name,
            "cone_deg": cone,
            "kept": [(item.frame, item.command, item.param1, item.x, item.y, item.z) for item in kept],
            "high_m": highest.relative_altitude_m,
            "end_m": (await first(telemetry.subscribe_position(), lambda position: True)).relative_altitude_m,
        }


if __name__ == "__main__":
    flight = fly(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    print(json.dumps(asyncio.run(asyncio.wait_for(flight, PATIENCE_S))))
