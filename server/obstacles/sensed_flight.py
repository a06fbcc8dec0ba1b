"""Which flight sensors see in: what was seen counts in it where a map begins anew, and no longer."""

from __future__ import annotations

from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.vehicle import VehicleState


def is_disarmed(state: VehicleState | None) -> bool:
    """By its own word: who has said nothing may fly."""
    return state is not None and state.heartbeat_t_mono_s is not None and not state.armed


class SensedFlight:
    """From when a vehicle is in the air until it is disarmed, or another one is heard.

    It is the same vehicle wherever it is heard from, as its numbers say. One that is out of reach flies on. Arming is
    none: home is set by it, maps begin anew around it, and who stands beside the vehicle then goes away.
    """

    def __init__(self) -> None:
        self._vehicle: tuple[int, int] | None = None
        """System and component."""
        self._flies: bool | None = None

    def on_state(self, state: VehicleState) -> list[bool]:
        """What has changed, in order: True where a flight begins, False where none is under way any more."""
        if not state.armed and state.heartbeat_t_mono_s is None:
            return []  # nobody knows yet whether it is disarmed
        vehicle, changes = (state.system_id, state.component_id), list[bool]()
        if self._vehicle not in (None, vehicle) and self._flies:
            changes.append(False)
            self._flies = False
        self._vehicle = vehicle
        flies = state.armed and (bool(self._flies) or is_in_the_air(state))
        if flies is not self._flies:
            changes.append(flies)
            self._flies = flies
        return changes
