"""The simulated ArduCopter against what was measured of a real one that Hedgehop flew: on the line, on the way home,
in its modes, before a start and after a landing.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.basics.plan_model import VehicleProfile
from telemetry.flight.preflight import checks
from telemetry.mavlink.codec import Parser
from telemetry.mavlink.reduce import reduce
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.simulation.simulator.autopilot.pilot import AS_REAL_BOOT_S
from telemetry.topics.messages import RawFrame, Topic
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.auto_flights import Flown, read_plan, recorded, simulated
from tests.telemetry.autopilot_bench import BRAKE, RTL, SET_MODE, hovering
from tests.telemetry.simulator_bench import Bench

ARMED = 128
RETURN_ALT_CM = 8000.0
"""The recorded vehicle's RTL_ALT."""


@pytest.fixture(scope="module")
def folder(shared_data: Path) -> Path:
    return shared_data / "logs" / "real_flights"


@pytest.fixture(scope="module")
def real(folder: Path) -> Flown:
    return recorded(folder / "arducopter-4.7_auto.mcap", read_plan(folder, "coro2"))


@pytest.fixture(scope="module")
def ours(folder: Path) -> Flown:
    return simulated(read_plan(folder, "coro2"), RTL_ALT=RETURN_ALT_CM)


@pytest.mark.fact("A3")
@pytest.mark.parametrize(
    "figure",
    [
        lambda flown: np.percentile(flown.beside_m, 95),
        lambda flown: flown.beside_m.max(),
        lambda flown: np.percentile(np.abs(flown.above_m), 95),
        lambda flown: flown.above_m.min(),
        lambda flown: flown.above_m.max(),
    ],
    ids=["beside, 95 %", "beside, most", "height, 95 %", "lowest", "highest"],
)
def test_in_auto_it_leaves_the_line_as_the_recorded_one_did(
    real: Flown, ours: Flown, figure: Callable[[Flown], float]
) -> None:
    assert figure(ours) == pytest.approx(figure(real), abs=0.08)
    assert ours.legs_s == pytest.approx(real.legs_s, rel=0.03)


@pytest.mark.fact("A4")
def test_in_wind_it_keeps_to_the_line_as_measured(folder: Path) -> None:
    flown = simulated(read_plan(folder, "coro2"), SIM_WIND_SPD=5.0)
    assert flown.beside_m.max() < 1.05
    assert -0.89 < flown.above_m.min() < -0.3


@pytest.mark.fact("A8")
def test_the_speed_of_the_mission_does_not_hold_on_the_way_home(real: Flown, ours: Flown) -> None:
    """Planned at 6 m/s; WPNAV_SPEED is 10 m/s."""
    for flown in (real, ours):
        assert 9.5 < flown.home_m_s < 10.1


@pytest.mark.fact("A9")
def test_its_mission_is_at_the_beginning_again_before_it_says_that_it_is_disarmed(real: Flown, ours: Flown) -> None:
    for flown in (real, ours):
        disarmed_s = next(t_s for (_, was), (t_s, now) in pairwise(_armed(flown.heard)) if was and not now)
        current = [(t_s, m.seq) for t_s, m in flown.heard if m.get_type() == "MISSION_CURRENT"]
        begun_s = [t_s for (_, before), (t_s, seq) in pairwise(current) if before and not seq][-1]
        assert 0.0 < disarmed_s - begun_s <= 1.0


def _armed(heard: list[tuple[float, Any]]) -> list[tuple[float, bool]]:
    beats = [(t_s, m) for t_s, m in heard if m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 1]
    return [(t_s, bool(m.base_mode & ARMED)) for t_s, m in beats]


@pytest.mark.fact("A21")
@pytest.mark.parametrize("name", ["arducopter-4.7_auto", "arducopter-4.7_console_a", "arducopter-4.7_console_b"])
def test_the_recorded_one_is_in_a_mode_as_soon_as_it_is_told_to(folder: Path, name: str) -> None:
    took_s = _mode_changes_s(folder / f"{name}.mcap")
    assert len(took_s) >= 2
    assert max(took_s) < 0.1


def _mode_changes_s(path: Path) -> list[float]:
    """From each order of a mode to the first heartbeat that shows it."""
    sent, came, asked, took_s = Parser(datagrams=True), Parser(datagrams=True), {}, []
    with open_recording(path) as recording:
        for entry in recording.entries({Topic.RAW}):
            assert isinstance(entry.message, RawFrame)
            for message in (sent if entry.message.sent else came).feed(entry.message.frame):
                if message.get_type() == "COMMAND_LONG" and message.command == SET_MODE:
                    asked[int(message.param2)] = entry.t_utc_s
                elif message.get_type() == "HEARTBEAT" and message.custom_mode in asked and not entry.message.sent:
                    took_s.append(entry.t_utc_s - asked.pop(message.custom_mode))
    return took_s


@pytest.mark.fact("A21")
@pytest.mark.parametrize("mode", [BRAKE, RTL])
def test_a_mode_shows_as_soon_as_it_is_ordered(mode: int) -> None:
    bench = hovering()
    bench.command(SET_MODE, 1, mode)
    bench.advance(0.1)
    assert bench.last("HEARTBEAT").custom_mode == mode


@pytest.mark.fact("A35")
def test_it_says_that_it_is_ready_before_it_knows_where_it_is() -> None:
    """Between its first fix and "EKF3 IMU0 is using GPS", 41 s after switching on."""
    bench = Bench(boot_s=AS_REAL_BOOT_S)
    for message_id in (1, 24, 33, 193):
        bench.stream(message_id, 2)
    bench.advance(30.0)
    state = _state(bench)
    assert state.ready_to_arm
    row = checks.gnss_row(state, VehicleProfile("quad", position_error_m=2.5))
    assert (row.state, row.text) == ("bad", "The autopilot's position estimate cannot be used yet.")
    bench.until(lambda: any("is using GPS" in text for text in bench.texts()))
    assert bench.now_s == pytest.approx(41.0, abs=1.0)
    bench.advance(1.0)
    assert checks.gnss_row(_state(bench), VehicleProfile("quad", position_error_m=2.5)).state == "good"


def _state(bench: Bench) -> VehicleState:
    state: VehicleState | None = None
    for one in bench.heard:
        state = reduce(state, one.message, t_mono_s=one.t_s, t_utc_s=one.t_s)
    assert state is not None
    return state
