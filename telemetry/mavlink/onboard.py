"""What is known of the mission on board: nothing, until a read-back has shown it, and not any longer than that."""

from __future__ import annotations

from typing import Literal

from telemetry.mavlink.actions import Message
from telemetry.messages import OnboardMission
from telemetry.vehicle import VehicleState

SETTLE_S = 2.0
"""After a transfer of ours late answers may come, and the vehicle's figures about its mission may be old ones."""
_OF_A_TRANSFER = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
PLAN_RECEIVED = "Flight plan received"


class OnBoard:
    """``state`` as in ``LinkStatus.mission_state``; ``mission`` is what the last read-back found."""

    def __init__(self) -> None:
        self.mission: OnboardMission | None = None
        self._transferring = False
        self._settled_s = 0.0
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
            self.mission = None

    def transfer_ends(self, mission: OnboardMission | None, now_s: float) -> None:
        """``mission`` None: it failed."""
        self._transferring, self._settled_s, self._seen = False, now_s + SETTLE_S, None
        if mission is not None:
            self.mission = mission

    def forget(self) -> None:
        """The vehicle restarted, or is another one."""
        self.mission, self._seen = None, None

    def on_message(self, message: Message, now_s: float) -> bool:
        """True when this message shows that somebody else has replaced the mission: it is unknown from now on."""
        if self._transferring:
            return False
        kind = message.get_type()
        if kind == "STATUSTEXT":  # of an upload of ours it comes before the read-back
            return self._lose() if message.text.startswith(PLAN_RECEIVED) else False
        transfer = kind in _OF_A_TRANSFER and message.mission_type == 0
        return self._lose() if transfer and now_s >= self._settled_s else False

    def on_state(self, state: VehicleState, now_s: float) -> bool:
        """The same, from the number of items and the mission's id."""
        if self._transferring or now_s < self._settled_s or state.mission_item is None:
            return False
        seen, self._seen = self._seen, (state.mission_items, state.mission_id)
        return self._lose() if seen is not None and seen != self._seen else False

    def _lose(self) -> bool:
        was_known = self.mission is not None
        self.mission = None
        return was_known
