"""What is known of the mission on board: nothing, until a read-back has shown it, and not any longer than that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from telemetry.flight.avoidance.fence_aboard import FenceAboard
from telemetry.mavlink.actions import Message
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.requests import TakeUp
from telemetry.topics.vehicle import VehicleState

SETTLE_S = 2.0
"""After a transfer of ours late answers may come, and the vehicle's figures about its mission may be old ones."""
_OF_A_TRANSFER = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
_WRITES = ("MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL")
"""How a ground station begins to replace a mission."""
PLAN_RECEIVED = "Flight plan received"


@dataclass(frozen=True, slots=True)
class Started:
    """Which mission a flight goes on with, for this link node and the next."""

    digest: str | None = None
    """Of the mission that was started from here."""
    begins: TakeUp | None = None
    """Where a mission that was taken up in flight begins, until it is flown."""
    replaced_here: bool = False
    """Since then lists were sent from here in flight, and were not taken up."""


class OnBoard:
    """``state`` as in ``LinkStatus.mission_state``; ``mission`` and ``fence`` are what the last read-backs found."""

    def __init__(self) -> None:
        self.mission: OnboardMission | None = None
        self.fence = FenceAboard()
        self.is_written_by_others = False
        """Somebody else was seen to replace it since it was last sent from here."""
        self._transferring = False
        self._settled_s = self._counted_s = 0.0
        self._seen: tuple[int | None, int | None] | None = None

    @property
    def state(self) -> Literal["unknown", "none", "verified"]:
        if self.mission is None:
            return "unknown"
        return "verified" if self.mission.items else "none"

    @property
    def digest(self) -> str | None:
        return self.mission.digest if self.mission else None

    def transfer_begins(self, *, replaces: bool) -> None:
        self._transferring = True
        if replaces:
            self.mission, self.is_written_by_others = None, False

    def transfer_ends(self, mission: OnboardMission | None, now_s: float) -> None:
        """``mission`` None: it failed."""
        self._transferring, self._settled_s, self._seen = False, now_s + SETTLE_S, None
        if mission is not None:
            self.mission = mission

    def forget(self) -> None:
        """The vehicle restarted, or is another one."""
        self.mission, self._seen = None, None
        self.fence.forget("has not been read back since the vehicle was silent or restarted")

    def on_message(self, message: Message, now_s: float) -> bool:
        """True when this message shows that somebody else has replaced the mission: it is unknown from now on."""
        if self._transferring:
            return False
        kind = message.get_type()
        if kind == "MISSION_CURRENT":
            self._counted_s = now_s
        if kind == "STATUSTEXT":  # of an upload of ours it comes before the read-back
            return self._lose() if message.text.startswith(PLAN_RECEIVED) else False
        transfer = kind in _OF_A_TRANSFER and message.mission_type == 0
        return self._lose() if transfer and now_s >= self._settled_s else False

    def on_foreign(self, message: Message, system: int) -> bool:
        """The same, from what another ground station is heard to send to the vehicle with this system id."""
        is_write = message.get_type() in _WRITES and getattr(message, "mission_type", 0) == 0
        return self._lose() if is_write and message.target_system in (0, system) else False

    def on_state(self, state: VehicleState, now_s: float) -> bool:
        """The same, from the number of items and the mission's id."""
        if self._transferring or now_s < self._settled_s or state.mission_item is None:
            return False
        seen, self._seen = self._seen, (state.mission_items, state.mission_id)
        changed = seen is not None and seen != self._seen
        return self._lose() if changed or not self._fits(state) else False

    def _fits(self, state: VehicleState) -> bool:
        """Whether the vehicle counts as many items as were read back, where it counts them at all."""
        if self.mission is None or self._counted_s < self._settled_s:
            return True
        return state.mission_items in (None, len(self.mission.items))

    def _lose(self) -> bool:
        was_known, self.is_written_by_others = self.mission is not None, True
        self.mission = None
        return was_known
