"""Flies a vehicle with MAVSDK, as a process of its own: ``python -m tests.telemetry.mavsdk_pilot URL LAT LON LOG``,
and reads its newest log into the file LOG.

MAVSDK is a C++ library with threads; away from the test process nothing of it can outlive a test. Prints one line
of JSON: what it saw.
"""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import AsyncIterator, Callable
from typing import Any

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.asyncio.plugins.mission_raw import MissionItem, MissionRawAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

PATIENCE_S = 90.0
HOME, ABOVE_HOME_INT = 0, 6
WAYPOINT, TAKEOFF, RETURN = 16, 22, 20


def mission(lat_e7: int, lon_e7: int) -> list[MissionItem]:
    rows = [
        (HOME, WAYPOINT, 0.0, lat_e7, lon_e7, 0.0),
        (ABOVE_HOME_INT, TAKEOFF, 0.0, lat_e7, lon_e7, 10.0),
        (ABOVE_HOME_INT, WAYPOINT, 0.0, lat_e7 + 1500, lon_e7, 12.0),
        (ABOVE_HOME_INT, WAYPOINT, 1.0, lat_e7 + 1500, lon_e7 + 1500, 15.0),
        (ABOVE_HOME_INT, RETURN, 0.0, 0, 0, 0.0),
    ]
    return [
        MissionItem(seq, frame, command, int(seq == 0), 1, first, 0.0, 0.0, 0.0, x, y, z, 0)
        for seq, (frame, command, first, x, y, z) in enumerate(rows)
    ]


async def first(values: AsyncIterator[Any], fits: Callable[[Any], bool]) -> Any:
    async for value in values:
        if fits(value):
            return value
    raise AssertionError("the stream ended")


async def heights(telemetry: TelemetryAsync, into_m: list[float]) -> None:
    """Each height above home (metres) that the vehicle tells, until cancelled."""
    async for position in telemetry.subscribe_position():
        into_m.append(position.relative_altitude_m)


async def fly(url: str, lat_e7: int, lon_e7: int, log: str) -> dict[str, Any]:
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as sdk:
        await sdk.add_any_connection(url)
        system = await sdk.first_autopilot(timeout_s=PATIENCE_S)
        assert system is not None, f"no autopilot at {url}"
        telemetry, action, raw = TelemetryAsync(system), ActionAsync(system), MissionRawAsync(system)
        autopilot = await system.autopilot_type()
        # Like the autopilot, the vehicle sends nothing of this unasked.
        await telemetry.set_rate_position(10.0)
        await telemetry.set_rate_health(2.0)
        await first(telemetry.subscribe_health(), lambda health: health.is_armable and health.is_global_position_ok)
        items = mission(lat_e7, lon_e7)
        await raw.upload_mission(items)
        kept = await raw.download_mission()
        heights_m: list[float] = []
        # From before the flight to its end: at this speed the highest place passes while anything else is awaited.
        watch = asyncio.create_task(heights(telemetry, heights_m))
        await action.arm()
        await raw.start_mission()
        progress = await first(raw.subscribe_mission_progress(), lambda now: now.current >= 3)
        await first(telemetry.subscribe_armed(), lambda armed: not armed)
        watch.cancel()
        end = await first(telemetry.subscribe_position(), lambda position: True)
        logs = LogFilesAsync(system)
        entries = await logs.get_entries()
        async for _ in logs.download_log_file(entries[-1], log):
            pass
        return {
            "log_bytes": [entry.size_bytes for entry in entries],
            "autopilot": autopilot.name,
            "sent": len(items),
            "kept": [(item.frame, item.command, item.x, item.y, item.z) for item in kept],
            "total": progress.total,
            "high_m": max(heights_m),
            "end_m": end.relative_altitude_m,
        }


if __name__ == "__main__":
    print(
        json.dumps(
            asyncio.run(asyncio.wait_for(fly(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]), PATIENCE_S))
        )
    )
