"""What ground stations may keep on the simulated vehicle: its mission, its fence and its rally points."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.mission_steps import Step
from telemetry.simulation.simulator.protocol.fence_lists import FenceStore, RallyStore
from telemetry.simulation.simulator.protocol.item_protocol import ItemInt, ItemProtocol, Reply, Target
from telemetry.simulation.simulator.protocol.kept_items import KeptItem, keep

CAPACITY = 650


class MissionProtocol:
    """``peer`` names the way a message came and its answer goes. Times are the ground station's: seconds
    of any monotonic clock.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self._mission = MissionStore(autopilot)
        stores = (self._mission, FenceStore(autopilot), RallyStore(autopilot))
        self._lists = {store.mission_type: ItemProtocol(store, autopilot.say) for store in stores}

    @property
    def total(self) -> int:
        """Items without home, as MISSION_CURRENT counts."""
        return max(0, self._mission.count - 1)

    def on_message(self, message: Any, peer: Hashable, now_s: float) -> list[Reply]:
        mission_type = getattr(message, "mission_type", 0)
        if (listed := self._lists.get(mission_type)) is not None:
            return listed.on_message(message, peer, now_s)
        if message.get_type() == "MISSION_ACK":
            return []
        target = (message.get_srcSystem(), message.get_srcComponent())
        return [(peer, wire.MAVLink_mission_ack_message(*target, wire.MAV_MISSION_UNSUPPORTED, mission_type))]

    def on_tick(self, now_s: float) -> list[Reply]:
        return [reply for listed in self._lists.values() for reply in listed.on_tick(now_s)]


class MissionStore:
    """Replaces IN PLACE what was on board: a broken-off upload leaves a mixture."""

    mission_type = wire.MAV_MISSION_TYPE_MISSION
    received = "Flight plan received"
    in_parts = True

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self._kept: list[KeptItem] = []

    @property
    def capacity(self) -> int:
        return CAPACITY if self._autopilot.ready else 0

    @property
    def count(self) -> int:
        return len(self._kept)

    def begin(self, count: int) -> None:
        mission = self._autopilot.mission
        del self._kept[count:], mission.steps[count:]
        if mission.current >= max(count, 1):
            mission.restart()
        self._autopilot.parameters.set("MIS_TOTAL", len(self._kept))

    def put(self, seq: int, item: ItemInt) -> int:
        kept = keep(item)
        if isinstance(kept, int):
            return kept
        step = Step("home") if seq == 0 else kept.step()
        steps = self._autopilot.mission.steps
        if seq < len(self._kept):
            self._kept[seq], steps[seq] = kept, step
        else:
            self._kept.append(kept)
            steps.append(step)
        self._autopilot.parameters.set("MIS_TOTAL", len(self._kept))
        return wire.MAV_MISSION_ACCEPTED

    def finish(self) -> int:
        return wire.MAV_MISSION_ACCEPTED

    def message(self, seq: int, target: Target) -> ItemInt | None:
        if seq == 0:
            return self._home().message(seq, target)
        return self._kept[seq].message(seq, target) if seq < len(self._kept) else None

    def may_clear(self) -> bool:
        return not (self._autopilot.mode is self._autopilot.auto and self._autopilot.flying)

    def _home(self) -> KeptItem:
        lat, lon, alt_m = self._autopilot.frame.geodetic_from_neu(self._autopilot.home_neu)
        return KeptItem(16, 0, (0.0, 0.0, 0.0, 0.0), int(lat * 1e7), int(lon * 1e7), int(alt_m * 100))
