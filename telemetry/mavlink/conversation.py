"""A conversation with a vehicle: its two ends, what it is about, a restart meanwhile, and how long to wait before
asking again."""

from __future__ import annotations

from dataclasses import dataclass

from planning.basics.plan_model import Firmware
from telemetry.mavlink.actions import Message
from telemetry.topics.onboard_lists import PlaceList

GROUND_STATION = (255, 190)
"""System and component that ground stations use."""
BACKWARDS_MS = 5000
"""More than messages can be late."""
FACTOR, MARGIN_S = 1.5, 0.03


@dataclass(frozen=True, slots=True)
class Endpoints:
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


@dataclass(frozen=True, slots=True)
class ItemList:
    """One of the lists that a vehicle keeps; the same protocol transfers each."""

    mission_type: int
    """MAV_MISSION_TYPE"""
    name: str
    """As people are told."""

    @property
    def unknown(self) -> str:
        """What to do when nobody knows any more what is on board."""
        return f"The {self.name} on board is now unknown: upload again before the start."

    @property
    def mixture(self) -> str:
        """What to do when an upload ended in the middle: vehicles replace items in place."""
        return f"The {self.name} on board may now be a mixture: upload again before the start."

    def has_home_row(self, firmware: Firmware) -> bool:
        """Whether the vehicle keeps its home before the first item."""
        return self.mission_type == MISSION.mission_type and firmware == "ardupilot"


MISSION, FENCE, RALLY = ItemList(0, "mission"), ItemList(1, "fence"), ItemList(2, "list of rally points")
PLACE_LISTS: dict[PlaceList, ItemList] = {"fence": FENCE, "rally": RALLY}


class BootClock:
    """Notices that a vehicle has started anew: its clock of milliseconds since boot runs backwards."""

    def __init__(self) -> None:
        self._newest_ms: int | None = None

    def has_restarted(self, message: Message) -> bool:
        """Whether this message of the vehicle is younger than an earlier one."""
        t_boot_ms = getattr(message, "time_boot_ms", None)
        if t_boot_ms is None:
            return False
        if self._newest_ms is not None and t_boot_ms < self._newest_ms - BACKWARDS_MS:
            return True
        self._newest_ms = max(t_boot_ms, self._newest_ms or 0)
        return False


class RoundTrip:
    """Learnt from the answers that came. Exponential average; only messages that were sent once may be measured (Karn).

    Until one was, it waits twice as long after each repetition: a slow radio is not filled with them, and soon there
    is an answer to measure.
    """

    def __init__(self, *, unknown_s: float = 0.25, shortest_s: float = 0.125, longest_s: float = 1.0) -> None:
        self._unknown_s, self._shortest_s, self._longest_s = unknown_s, shortest_s, longest_s
        self._mean_s: float | None = None

    def measure(self, round_trip_s: float) -> None:
        before_s = round_trip_s if self._mean_s is None else self._mean_s
        self._mean_s = 0.8 * before_s + 0.2 * round_trip_s

    @property
    def mean_s(self) -> float | None:
        return self._mean_s

    def repeats(self) -> None:
        """Something is sent again."""
        self._unknown_s = min(2 * self._unknown_s, self._longest_s)

    @property
    def patience_s(self) -> float:
        if self._mean_s is None:
            return self._unknown_s
        return min(max(FACTOR * self._mean_s + MARGIN_S, self._shortest_s), self._longest_s)
