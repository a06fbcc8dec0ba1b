"""What must hold, and what must be set again, when a mission goes on in the middle."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from telemetry.errors import MissionUnknownError, TelemetryError
from telemetry.mavlink.adopted import AdoptedVehicle
from telemetry.mavlink.onboard import OnBoard
from telemetry.messages import Item, OnboardMission

ReadMission = Callable[[], Awaitable[OnboardMission]]
AGAIN_S = 8.0
"""A vehicle on the ground switches its motors off 10 s after it has armed."""
CHANGE_SPEED = 178
GROUND, AIR = 1, 0
"""SPEED_TYPE; a multirotor takes them for the same."""


def check_same_mission(onboard: OnBoard, digest: str) -> None:
    """Raises MissionUnknownError when another station may have replaced what was checked."""
    if onboard.digest == digest:
        return
    what = "What is on board is not known any more" if onboard.digest is None else "Another mission is on board"
    raise MissionUnknownError(
        f"{what}: somebody else has replaced it since it was checked.",
        advice="Return home, then upload the plan and check it again.",
    )


async def check_again(onboard: OnBoard, digest: str, read_mission: ReadMission) -> None:
    """The same, of a mission that is read back now: another station may have replaced it a moment ago.

    Raises MissionUnknownError.
    """
    check_same_mission(onboard, digest)
    try:
        async with asyncio.timeout(AGAIN_S):
            await read_mission()
    except (TelemetryError, TimeoutError) as error:
        raise MissionUnknownError(
            f"The mission on board could not be read once more before the start: {str(error) or 'it took too long'}.",
            advice="Improve the link, then start again.",
        ) from None
    check_same_mission(onboard, digest)


async def set_speeds(vehicle: AdoptedVehicle, item: int) -> None:
    """The speeds that hold at this item. ArduPilot forgets them whenever its flight mode changes.

    Raises RefusedError, SilentError: the vehicle then flies on at the speed of its own settings.
    """
    for kind, speed_m_s in speeds_before(vehicle.onboard.mission, item).items():
        await vehicle.obey(vehicle.orders.change_speed(kind, speed_m_s))


def speeds_before(mission: OnboardMission | None, item: int) -> dict[int, float]:
    """Of each SPEED_TYPE the speed in m/s that the items before this one (1 is the first) have set last."""
    speeds: dict[int, float] = {}
    for before in mission.items[: item - 1] if mission else ():
        if (found := _speed(before)) is not None:
            kind, speed_m_s = found
            speeds[kind] = speed_m_s
    return speeds


def _speed(item: Item) -> tuple[int, float] | None:
    kind, speed_m_s = item.params[:2]
    if item.command != CHANGE_SPEED or kind is None or speed_m_s is None or not speed_m_s > 0:
        return None
    return (GROUND if kind == AIR else int(kind)), speed_m_s
