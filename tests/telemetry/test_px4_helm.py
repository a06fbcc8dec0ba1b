"""A PX4 is stopped: by HOLD, and where it may fly to a place in HOLD already, by a change of place without a place."""

from __future__ import annotations

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.flight.guided.helm import Helm, here_of
from telemetry.mavlink.actions import Action, Send
from telemetry.mavlink.commands import TIMEOUT_S, UNSUPPORTED
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.fake_vehicle import ack
from tests.telemetry.frames import heard

SET_MODE, REPOSITION = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_DO_REPOSITION


def shown(mode: str, t_s: float, *, speed_m_s: float = 0.0) -> VehicleState:
    told: dict[str, Any] = {"lat_deg": 46.0, "lon_deg": 7.0, "alt_rel_home_m": 10.0, "alt_amsl_m": 510.0}
    times: dict[str, Any] = {"heartbeat_t_mono_s": t_s, "position_t_mono_s": t_s}
    return VehicleState(1, 1, autopilot="px4", armed=True, mode=mode, ground_speed_m_s=speed_m_s, **told, **times)


def orders(actions: list[Action]) -> list[int]:
    return [action.message.command for action in actions if isinstance(action, Send)]


class Steered:
    """A helm whose vehicle shows a mode."""

    def __init__(self, mode: str) -> None:
        self.asked: list[str] = []
        self.helm = Helm((1, 1), lambda name, _: self.asked.append(name), firmware="px4")
        self.helm.on_state(shown(mode, 0.0), 0.0)

    def answers(self, command: int, result: int, t_s: float) -> list[int]:
        return orders(self.helm.on_message(heard(ack(command, result)), t_s))


def test_unsupported_is_what_px4_answers_to_a_stop_that_it_carries_out() -> None:
    it = Steered("HOLD")
    assert orders(it.helm.stop(1.0)) == [REPOSITION]
    assert not it.helm.has_stopped(shown("HOLD", 1.1), 1.1), "the order is under way"
    it.answers(REPOSITION, UNSUPPORTED, 1.2)
    ticks = [it.helm.on_tick(1.2 + k / 2) for k in range(int(2 * TIMEOUT_S) + 4)]
    assert orders([action for tick in ticks for action in tick]) == [], "it is not ordered again"
    assert it.helm.failed == ""
    assert not it.helm.has_stopped(shown("HOLD", 15.0, speed_m_s=2.0), 15.0)
    assert it.helm.has_stopped(shown("HOLD", 16.0), 16.0)
    assert orders(it.helm.stop(16.0)) == [], "it stops already"


def test_a_stop_while_the_order_of_the_mode_is_under_way_orders_the_mode_again_and_then_the_stop() -> None:
    it = Steered("MISSION")
    assert orders(it.helm.change_mode("HOLD", 1.0)) == [SET_MODE]
    assert orders(it.helm.stop(1.1)) == [SET_MODE]
    assert orders(it.helm.stop(1.2)) == [], "that is under way"
    assert it.answers(SET_MODE, 0, 1.3) == [REPOSITION]
    assert it.asked == ["HOLD", "HOLD"]


@pytest.mark.parametrize("shows", ["HOLD", "MISSION"])
def test_a_stop_after_another_mode_was_commanded_brings_it_back_into_hold(shows: str) -> None:
    it = Steered(shows)
    it.helm.change_mode("RTL", 1.0)
    assert orders(it.helm.stop(1.1)) == [SET_MODE]
    assert it.asked[-1] == "HOLD"
    assert it.answers(SET_MODE, 0, 1.2) == [REPOSITION]


def test_from_its_mission_hold_alone_stops_it() -> None:
    it = Steered("MISSION")
    assert orders(it.helm.stop(1.0)) == [SET_MODE]
    assert it.answers(SET_MODE, 0, 1.2) == []
    assert it.helm.has_stopped(shown("HOLD", 2.0), 2.0)


def test_on_its_way_in_hold_it_is_stopped_without_another_mode() -> None:
    it = Steered("HOLD")
    assert orders(it.helm.go_to(here_of(shown("HOLD", 0.5)), 0.5, radius_m=1.0)) == [REPOSITION]
    assert orders(it.helm.stop(1.0)) == [REPOSITION]
    assert it.asked == []
