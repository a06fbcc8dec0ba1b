"""The simulated vehicle's fence and rally points: kept and given back as ArduCopter does. It acts on the fence."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.basics.mav_cmd import FENCE_CIRCLES, FENCE_POLYGONS, FENCES, MavCmd, MavFrame
from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.fence_shapes import FencePart
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.protocol.item_protocol import ItemInt, Target

FENCE_CAPACITY, RALLY_CAPACITY = 255, 20
MOST_CORNERS = 255
HIGHEST_RALLY_M = 32767
_SEA_AND_HOME = (
    MavFrame.GLOBAL, MavFrame.GLOBAL_INT, MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT,
)  # fmt: skip
_HOME = (MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT)
_PARAMETER_MAX = 127


class FenceStore:
    """A fence is taken as a whole or not at all: until all of a new one has come, the old one holds."""

    mission_type = wire.MAV_MISSION_TYPE_FENCE
    received = "Fence received"
    in_parts = False
    capacity = FENCE_CAPACITY

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self._kept: list[ItemInt] = []
        self._coming: list[ItemInt] = []

    @property
    def count(self) -> int:
        return len(self._kept)

    def begin(self, count: int) -> None:
        self._coming = []
        if count == 0:
            self.finish()

    def put(self, seq: int, item: ItemInt) -> int:
        if refusal := _place_refusal(item, FENCES, _SEA_AND_HOME):
            return refusal
        most = MOST_CORNERS if item.command in FENCE_POLYGONS else math.inf
        if not 0 <= item.param1 <= most:
            return wire.MAV_MISSION_INVALID_PARAM1
        del self._coming[seq:]
        self._coming.append(item)
        return wire.MAV_MISSION_ACCEPTED

    def finish(self) -> int:
        if not _is_whole(self._coming):
            self._autopilot.say(4, "Fence refused: corners are missing, or a radius is zero")
            return wire.MAV_MISSION_ERROR
        self._kept, self._coming = self._coming, []
        self._autopilot.fence.parts = fence_parts(self._kept, self._autopilot.frame)
        self._autopilot.parameters.set("FENCE_TOTAL", min(len(self._kept), _PARAMETER_MAX))
        return wire.MAV_MISSION_ACCEPTED

    def message(self, seq: int, target: Target) -> ItemInt | None:
        """Height and frame are not kept."""
        if seq >= len(self._kept):
            return None
        kept = self._kept[seq]
        first = 0.0 if kept.command == MavCmd.NAV_FENCE_RETURN_POINT else kept.param1
        return _item(target, seq, MavFrame.GLOBAL, kept, (first, 0.0), self.mission_type)

    def may_clear(self) -> bool:
        return True


class RallyStore:
    """Points are replaced in place, their heights kept in whole metres above home."""

    mission_type = wire.MAV_MISSION_TYPE_RALLY
    received = "Rally points received"
    in_parts = True
    capacity = RALLY_CAPACITY

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self._kept: list[ItemInt] = []

    @property
    def count(self) -> int:
        return len(self._kept)

    def begin(self, count: int) -> None:
        del self._kept[count:]

    def put(self, seq: int, item: ItemInt) -> int:
        if refusal := _place_refusal(item, frozenset({MavCmd.NAV_RALLY_POINT}), _HOME):
            return refusal
        if not abs(item.z) <= HIGHEST_RALLY_M:
            return wire.MAV_MISSION_INVALID_PARAM7
        self._kept[seq : seq + 1] = [item]
        return wire.MAV_MISSION_ACCEPTED

    def finish(self) -> int:
        return wire.MAV_MISSION_ACCEPTED

    def message(self, seq: int, target: Target) -> ItemInt | None:
        if seq >= len(self._kept):
            return None
        kept = self._kept[seq]
        whole_m = float(math.trunc(kept.z))
        return _item(target, seq, MavFrame.GLOBAL_RELATIVE_ALT, kept, (0.0, whole_m), self.mission_type)

    def may_clear(self) -> bool:
        return True


def fence_parts(items: Sequence[ItemInt], frame: NeuFrame) -> tuple[FencePart, ...]:
    """Of whole polygons and circles; return points are left out."""
    parts: list[FencePart] = []
    at = 0
    while at < len(items):
        first = items[at]
        run = int(first.param1) if first.command in FENCE_POLYGONS else 1
        places = tuple(frame.neu_from_geodetic(each.x / 1e7, each.y / 1e7, 0.0)[:2] for each in items[at : at + run])
        if first.command in FENCE_POLYGONS:
            parts.append(FencePart(first.command == MavCmd.NAV_FENCE_POLYGON_VERTEX_INCLUSION, places))
        elif first.command in FENCE_CIRCLES:
            parts.append(FencePart(first.command == MavCmd.NAV_FENCE_CIRCLE_INCLUSION, places, first.param1))
        at += max(run, 1)
    return tuple(parts)


def _place_refusal(item: ItemInt, commands: frozenset[MavCmd], frames: tuple[MavFrame, ...]) -> int:
    """0: nothing is wrong with the command and its place."""
    if item.command not in commands:
        return wire.MAV_MISSION_UNSUPPORTED
    if item.frame not in frames:
        return wire.MAV_MISSION_UNSUPPORTED_FRAME
    if abs(item.x) > 900_000_000:
        return wire.MAV_MISSION_INVALID_PARAM5_X
    return wire.MAV_MISSION_INVALID_PARAM6_Y if abs(item.y) > 1_800_000_000 else 0


def _is_whole(items: list[ItemInt]) -> bool:
    """Whether each polygon has the corners that it says, three or more in a row, and each circle a radius."""
    at = 0
    while at < len(items):
        first, run = items[at], 1
        if first.command in FENCE_CIRCLES and not first.param1 > 0:
            return False
        if first.command in FENCE_POLYGONS:
            run = int(first.param1)
            corners = items[at : at + run]
            same = all((c.command, c.param1) == (first.command, first.param1) for c in corners)
            if run < 3 or len(corners) < run or not same:
                return False
        at += run
    return True


def _item(
    target: Target, seq: int, frame: int, kept: ItemInt, values: tuple[float, float], mission_type: int
) -> ItemInt:
    """``values``: first parameter and height."""
    first, height_m = values
    return ItemInt(*target, seq, frame, kept.command, 0, 1, first, 0, 0, 0, kept.x, kept.y, height_m, mission_type)
