"""The two ends of a conversation: which messages belong to it, and not to another ground station's."""

from __future__ import annotations

from dataclasses import dataclass

from telemetry.mavlink.actions import Message

GROUND_STATION = (255, 190)
"""System and component that ground stations use."""


@dataclass(frozen=True, slots=True)
class Ends:
    """System and component numbers of the vehicle and of this ground station."""

    vehicle: tuple[int, int]
    own: tuple[int, int] = GROUND_STATION

    def is_from_vehicle(self, message: Message) -> bool:
        return (message.get_srcSystem(), message.get_srcComponent()) == self.vehicle

    def is_for_us(self, message: Message) -> bool:
        """From the vehicle and addressed to us; 0 addresses everyone, as older autopilots do."""
        return (
            self.is_from_vehicle(message)
            and message.target_system in (self.own[0], 0)
            and message.target_component in (self.own[1], 0)
        )
