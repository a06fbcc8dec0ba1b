"""What the simulated PX4 keeps of mission items, fences and rally points, and what it refuses."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.basics.mav_cmd import FENCE_CIRCLES, FENCE_POLYGONS, FENCES, MavCmd, MavFrame
from telemetry.simulation.simulator.autopilot.mission_steps import Step
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.autopilot.px4.px4_fence import INVALID
from telemetry.simulation.simulator.protocol.fence_lists import fence_parts
from telemetry.simulation.simulator.protocol.item_protocol import ItemInt
from telemetry.simulation.simulator.protocol.kept_items import KINDS, WITHOUT_MOTION

ACCEPTED = wire.MAV_MISSION_ACCEPTED
ABOVE_HOME = (MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT)
ABOVE_SEA = (MavFrame.GLOBAL, MavFrame.GLOBAL_INT)
PLACES = frozenset({
    MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_UNLIM, MavCmd.NAV_LOITER_TIME, MavCmd.NAV_LAND, MavCmd.NAV_TAKEOFF,
    MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI, MavCmd.DO_LAND_START,
})  # fmt: skip
MISSION_CAPACITY, FENCE_CAPACITY, RALLY_CAPACITY = 500, 64, 32


def back(item: ItemInt, target: tuple[int, int], seq: int, *, current: bool) -> ItemInt:
    """As it is read back: frames of places by their names for integers, everything else as it came."""
    frame = item.frame
    if frame in ABOVE_HOME:
        frame = MavFrame.GLOBAL_RELATIVE_ALT_INT
    elif frame in ABOVE_SEA and (item.command in PLACES or item.mission_type):
        frame = MavFrame.GLOBAL_INT
    return ItemInt(
        *target, seq, int(frame), item.command, int(current), item.autocontinue, item.param1, item.param2, item.param3,
        item.param4, item.x, item.y, item.z, item.mission_type,
    )  # fmt: skip


class MissionItems:
    """Taken as a whole: a broken-off upload leaves the old mission."""

    mission_type, capacity = wire.MAV_MISSION_TYPE_MISSION, MISSION_CAPACITY

    def __init__(self, pilot: Px4Pilot) -> None:
        self._pilot = pilot
        self.kept: list[ItemInt] = []

    def refusal(self, item: ItemInt) -> int:
        if item.command not in KINDS and item.command not in WITHOUT_MOTION:
            return wire.MAV_MISSION_UNSUPPORTED
        if item.command not in PLACES:
            return ACCEPTED
        if refusal := _misplaced(item):
            return refusal
        return ACCEPTED if math.isfinite(item.z) else wire.MAV_MISSION_INVALID_PARAM7

    def replace(self, items: list[ItemInt]) -> int:
        self.kept = items
        mission = self._pilot.mission
        mission.steps = [_step(item) for item in items]
        mission.restart()
        self._pilot.missions.state = "not_started"
        return ACCEPTED


class FenceItems:
    mission_type, capacity = wire.MAV_MISSION_TYPE_FENCE, FENCE_CAPACITY

    def __init__(self, pilot: Px4Pilot) -> None:
        self._pilot = pilot
        self.kept: list[ItemInt] = []

    def refusal(self, item: ItemInt) -> int:
        if item.command not in FENCES:
            return wire.MAV_MISSION_UNSUPPORTED
        if item.command in FENCE_POLYGONS and not item.param1 >= 3:
            return wire.MAV_MISSION_ERROR
        if item.command in FENCE_CIRCLES and not item.param1 > 0:
            return wire.MAV_MISSION_ERROR
        return _misplaced(item)

    def replace(self, items: list[ItemInt]) -> int:
        self.kept, pilot = items, self._pilot
        for _ in range(pilot.fence.take(fence_parts(items, pilot.frame), pilot.home_neu)):
            pilot.say(2, INVALID)
        return ACCEPTED


class RallyItems:
    mission_type, capacity = wire.MAV_MISSION_TYPE_RALLY, RALLY_CAPACITY

    def __init__(self) -> None:
        self.kept: list[ItemInt] = []

    def refusal(self, item: ItemInt) -> int:
        return _misplaced(item) if item.command == MavCmd.NAV_RALLY_POINT else wire.MAV_MISSION_UNSUPPORTED

    def replace(self, items: list[ItemInt]) -> int:
        self.kept = items
        return ACCEPTED


def _misplaced(item: ItemInt) -> int:
    if item.frame not in ABOVE_HOME + ABOVE_SEA:
        return wire.MAV_MISSION_UNSUPPORTED_FRAME
    if abs(item.x) > 900_000_000:
        return wire.MAV_MISSION_INVALID_PARAM5_X
    return wire.MAV_MISSION_INVALID_PARAM6_Y if abs(item.y) > 1_800_000_000 else ACCEPTED


def _step(item: ItemInt) -> Step:
    """Seconds stay fractional."""
    kind = KINDS.get(item.command, "nothing")
    p1, p2, p3, p4 = (value if math.isfinite(value) else 0.0 for value in _params(item))
    waits = kind in ("waypoint", "loiter_time", "delay")
    return Step(
        kind,
        lat_deg=item.x / 1e7 if item.command in PLACES else 0.0,
        lon_deg=item.y / 1e7 if item.command in PLACES else 0.0,
        alt_m=item.z,
        above="home" if item.frame in ABOVE_HOME else "sea",
        seconds=max(0.0, p1) if waits else 0.0,
        values=(p1, p2, p3, p4),
    )


def _params(item: ItemInt) -> tuple[float, float, float, float]:
    return item.param1, item.param2, item.param3, item.param4
