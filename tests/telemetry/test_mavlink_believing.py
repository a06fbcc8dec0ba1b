"""Impossible changes wait until they are confirmed; nothing that real vehicles send is disbelieved for long."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.believing import ALONE_S, SAID_S, SETTLE_S, Believing
from telemetry.mavlink.reduce import reduce
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.frames import heard
from tests.telemetry.replayed_link import received

ON_GROUND, IN_AIR = 1, 2
REAL = [
    "arducopter-4.7_auto",
    "arducopter-4.7_console_a",
    "arducopter-4.7_console_b",
    "arducopter-4.7_guided_below_certified",
    "px4-1.17_auto_rtk",
    "px4-1.17_guided_rtk",
]


@dataclass
class Ear:
    """``lands``: the vehicle sends EXTENDED_SYS_STATE."""

    believing: Believing
    state: VehicleState
    lands: bool = True
    now_s: float = 0.0
    boot_ms: int = 60_000
    at_s: float = 0.0

    def hear(self, message: Any) -> int:
        believed = self.believing.hear(self.state, heard(message), self.now_s)
        for each in believed:
            new = reduce(self.state, each, t_mono_s=self.now_s, t_utc_s=self.now_s)
            assert new is not None
            self.state = new
        return len(believed)

    def fly(self, seconds: float, *, forged: Iterable[Any] = (), armed: bool = True, landed: int = IN_AIR) -> None:
        """As a vehicle does; ``forged`` comes after every message of its own."""
        for _ in range(round(seconds * 20)):
            self.now_s += 0.05
            self.boot_ms += 50
            genuine = [position(self.boot_ms)]
            tick = round(self.now_s * 20)
            genuine += [landed_state(landed)] if self.lands and tick % 5 == 0 else []
            genuine += [beat(armed=armed)] if tick % 20 == 0 else []
            for message in genuine:
                self.hear(message)
                for lie in forged:
                    self.hear(lie)


def beat(*, armed: bool, autopilot: int = 3) -> Any:
    return mavlink.MAVLink_heartbeat_message(2, autopilot, 1 | (128 if armed else 0), 3, 4, 3)


def landed_state(landed: int) -> Any:
    return mavlink.MAVLink_extended_sys_state_message(0, landed)


def position(boot_ms: int, *, north_m: float = 0.0, down_cm_s: int = 0, alt_m: float = 30.0) -> Any:
    lat = 470_000_000 + round(north_m / 0.0111195)
    return mavlink.MAVLink_global_position_int_message(
        boot_ms, lat, 80_000_000, 500_000, round(alt_m * 1000), 0, 0, down_cm_s, 0
    )


def flying(*, lands: bool = True) -> Ear:
    ear = Ear(Believing(), VehicleState(1, 1), lands)
    ear.fly(3.0)
    assert ear.state.armed
    return ear


@pytest.mark.parametrize("lands", [True, False])
@pytest.mark.parametrize("lies", [[beat(armed=False)], [beat(armed=False), landed_state(ON_GROUND)]])
def test_a_vehicle_that_goes_on_flying_is_never_taken_for_disarmed(lands: bool, lies: list[Any]) -> None:
    ear = flying(lands=lands)
    if not lands:
        lies = lies[:1]
    for lie in lies:  # one packet
        ear.hear(lie)
    assert ear.state.armed
    ear.fly(6.0)
    assert ear.believing.contradictions == len(lies)
    assert "Somebody else may be sending as this vehicle" in ear.believing.warnings(ear.now_s)[0]
    ear.fly(6.0, forged=lies)  # more of them than of its own
    assert ear.state.armed
    assert ear.state.landed == (IN_AIR_WORD if lands else None)
    ear.fly(SAID_S + 1)
    assert ear.believing.warnings(ear.now_s) == ()


IN_AIR_WORD = "in_air"


def test_motors_that_stop_in_the_air_are_told_at_once_and_believed_when_it_says_that_it_is_down() -> None:
    ear = flying()
    ear.hear(beat(armed=False))
    assert "Not confirmed" in ear.believing.warnings(ear.now_s)[0]
    assert (ear.state.armed, ear.state.landed) == (True, "in_air")
    ear.fly(2.6, armed=False, landed=ON_GROUND)
    assert (ear.state.armed, ear.state.landed) == (False, "on_ground")
    assert ear.believing.contradictions == 0
    assert ear.believing.warnings(ear.now_s) == ()


def test_while_it_falls_it_is_not_down() -> None:
    ear = flying()
    for _ in range(60):
        ear.now_s += 0.05
        ear.boot_ms += 50
        ear.hear(position(ear.boot_ms, down_cm_s=900))
        ear.hear(landed_state(ON_GROUND))
    assert ear.state.landed == "in_air"


def test_without_a_second_kind_of_message_it_is_believed_after_a_while_alone() -> None:
    ear = flying(lands=False)
    ear.fly(ALONE_S - 1, armed=False)
    assert ear.state.armed
    ear.fly(3.0, armed=False)
    assert not ear.state.armed


def test_a_landing_is_believed_within_a_second_and_what_is_not_in_the_air_at_once() -> None:
    ear = flying()
    ear.fly(SETTLE_S + 0.5, landed=ON_GROUND)
    assert (ear.state.armed, ear.state.landed) == (True, "on_ground")
    assert ear.hear(beat(armed=False)) == 1
    assert not ear.state.armed
    assert ear.hear(beat(armed=True)) == 1
    assert ear.hear(beat(armed=False)) == 1


def test_what_a_node_before_this_one_knew_to_fly_is_not_disarmed_by_the_first_heartbeat() -> None:
    ear = Ear(Believing(flies=True), VehicleState(1, 1))
    assert ear.hear(beat(armed=False)) == 0
    ear.fly(2.0)
    assert ear.state.armed


@pytest.mark.parametrize("lie", [position(60_000, north_m=5000.0), position(60_000, alt_m=400.0)])
def test_a_place_that_leaps_is_not_believed_while_the_old_one_is_heard(lie: Any) -> None:
    ear = flying()
    before = (ear.state.lat_deg, ear.state.alt_rel_home_m)
    assert ear.hear(lie) == 0
    ear.fly(4.0, forged=[lie])
    assert (ear.state.lat_deg, ear.state.alt_rel_home_m) == before
    assert ear.believing.contradictions > 3


def test_a_place_that_stays_another_is_believed_within_a_moment() -> None:
    ear = flying()
    for k in range(25):
        ear.now_s += 0.05
        ear.hear(position(ear.boot_ms + 50 * k, north_m=5000.0))
    assert ear.state.lat_deg == pytest.approx(47.045, abs=1e-3)


@pytest.mark.parametrize("lie_ms", [0, 4_000_000_000])
def test_a_clock_that_leaps_is_not_believed_but_a_restart_is(lie_ms: int) -> None:
    ear = flying()
    assert ear.hear(position(lie_ms)) == 0
    ear.fly(3.0, forged=[position(lie_ms)])
    assert ear.believing.contradictions > 3
    ear.boot_ms = lie_ms
    ear.fly(0.9)
    assert ear.hear(position(lie_ms + 1000)) == 0
    ear.fly(0.3)
    assert ear.hear(position(ear.boot_ms)) == 1


def test_another_kind_of_autopilot_is_not_believed() -> None:
    ear = flying()
    ear.fly(5.0, forged=[beat(armed=True, autopilot=12)])
    assert ear.state.autopilot == "ardupilot"


@pytest.mark.parametrize("name", REAL)
def test_nothing_that_a_real_vehicle_sent_is_disbelieved_for_more_than_a_moment(shared_data: Path, name: str) -> None:
    believing, state, truth = Believing(), VehicleState(1, 1), VehicleState(1, 1)
    apart_since_s: float | None = None
    longest_s, held, t_s = 0.0, 0, 0.0
    for t_s, message in received(shared_data / "logs" / "real_flights" / f"{name}.mcap"):
        if (message.get_srcSystem(), message.get_srcComponent()) != (1, 1):
            continue
        believed = believing.hear(state, message, t_s)
        held += not believed
        for each in believed:
            state = reduce(state, each, t_mono_s=t_s, t_utc_s=t_s) or state
        truth = reduce(truth, message, t_mono_s=t_s, t_utc_s=t_s) or truth
        if (state.armed, state.landed, state.lat_deg) == (truth.armed, truth.landed, truth.lat_deg):
            apart_since_s = None
        else:
            apart_since_s = t_s if apart_since_s is None else apart_since_s
            longest_s = max(longest_s, t_s - apart_since_s)
    assert t_s > 100
    assert believing.contradictions == 0
    assert longest_s <= 1.1
    assert held <= 10
    assert believing.warnings(t_s) == ()
