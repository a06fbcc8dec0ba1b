"""The simulated PX4 in virtual time with avoidance on board, before walls that perfect sensors see."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.flight.avoidance.avoiding import Avoiding
from telemetry.flight.guided.remaining_mission import RemainingMission, remaining_from
from telemetry.mavlink.modes import mode_name
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES
from telemetry.topics.onboard_lists import Item
from tests.telemetry.avoiding_bench import FLIGHT, Craft, Sense, Wall
from tests.telemetry.simulator_bench import Bench

SET_MODE, ARM, START, REPOSITION, INTERVAL = 176, 400, 300, 192, 511
UNHEARD = (31, 32, 36, 83, 85)
"""Come 50 times a second unless they are switched off."""


class Px4Craft(Craft):
    def __init__(self, items: tuple[Item, ...], walls: list[Wall], senses: list[Sense] | None = None) -> None:
        super().__init__(items, walls, senses)
        self.avoiding = Avoiding((1, 1), remaining=self._remaining, firmware="px4")
        for number in UNHEARD:
            self.bench.command(INTERVAL, number, -1)

    def made(self) -> Bench:
        parameters = PERSONALITIES["px4"].parameters(MPC_XY_CRUISE=self.speed_m_s)
        return Bench(make="px4", parameters=parameters)

    def start(self) -> None:
        self.bench.until(lambda: self.bench.vehicle.autopilot.position_ok)
        assert self._upload() == 0
        assert [self.bench.command(SET_MODE, 1, 4, 4), self.bench.command(ARM, 1), self.bench.command(START)] == [0] * 3
        self.until(lambda: self.state.mode == "MISSION" and self.state.landed == "in_air", 60)
        self.avoiding.enable(self.now_s)

    def _upload(self) -> int:
        answers = self.bench.send(wire.MAVLink_mission_count_message(1, 1, len(self.items)))
        while answers[0].get_type() == "MISSION_REQUEST_INT":
            seq = answers[0].seq
            item = self.items[seq]
            place = round(item.lat_deg * 1e7), round(item.lon_deg * 1e7), item.alt_m
            answers = self.bench.send(
                wire.MAVLink_mission_item_int_message(
                    1, 1, seq, item.frame, item.command, 0, 1, *(p or 0.0 for p in item.params), *place
                )
            )
        return answers[0].type

    def mode_names(self) -> list[str]:
        """Those that were commanded."""
        orders = [m for m in self.sent("COMMAND_LONG") if m.command == SET_MODE]
        return [mode_name("px4", 2, int(m.param2) << 16 | int(m.param3) << 24) for m in orders]

    def repositions(self) -> list[Any]:
        return [m for m in self.sent("COMMAND_INT") if m.command == REPOSITION]

    def pauses(self) -> list[Any]:
        return [m for m in self.sent("COMMAND_LONG") if m.command == REPOSITION]


def px4_craft(*walls: Wall, senses: list[Sense] | None = None, items: tuple[Item, ...] = FLIGHT) -> Px4Craft:
    made = Px4Craft(items, list(walls), senses)
    made.start()
    return made


def px4_remaining_at(it: Px4Craft, item: int) -> RemainingMission:
    remaining = remaining_from(it.onboard, item, "px4")
    assert remaining is not None
    return remaining
