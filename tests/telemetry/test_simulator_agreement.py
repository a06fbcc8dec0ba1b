"""The simulated vehicle against recordings of the real ArduCopter: told the same, it does and answers the same."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.telemetry.simulator_bench import BOOTED_S, HOME, Bench, Heard, replayed

WORDS = (
    "Only", "Mission upload timeout", "Flight plan", "Arm: ", "Mission: ", "Reached", "GCS", "Arming", "Disarming",
    "ArduPilot Ready", "Field Elevation",
)  # fmt: skip
"""Texts that a ground station acts on; the others tell of sensors that are not simulated."""
PARAMETERS = (
    "WPNAV_SPEED", "WPNAV_SPEED_UP", "WPNAV_SPEED_DN", "WPNAV_RADIUS", "RTL_ALT", "RTL_CONE_SLOPE", "FS_GCS_ENABLE",
)  # fmt: skip


@dataclass
class Flight:
    real: list[Heard]
    simulated: Bench

    def both(self) -> tuple[list[Heard], list[Heard]]:
        return self.real, self.simulated.heard


@pytest.fixture(scope="module")
def flight_of(shared_data: Path) -> Callable[[str], Flight]:
    flown: dict[str, Flight] = {}

    def fly(name: str) -> Flight:
        if name not in flown:
            bench, recorded = replayed(shared_data / "logs" / "arducopter" / f"{name}.tlog")
            flown[name] = Flight(recorded, bench)
        return flown[name]

    return fly


def answer(heard: Heard, kind: str) -> Any:
    """What of a message must agree; None: nothing."""
    message = heard.message
    if kind == "STATUSTEXT":
        return message.text if message.text.startswith(WORDS) else None
    if kind == "PARAM_VALUE":
        return (message.param_id, message.param_value, message.param_type) if message.param_id in PARAMETERS else None
    if kind == "HOME_POSITION":
        return message.latitude, message.longitude
    return str(message)


def answers(heard: list[Heard], kind: str) -> list[Any]:
    found = [answer(one, kind) for one in heard if one.message.get_type() == kind]
    return [one for one in found if one is not None]


@pytest.mark.parametrize("log", ["rejects", "auto", "guided", "gcs_failsafe"])
@pytest.mark.parametrize(
    "kind",
    [
        "COMMAND_ACK", "MISSION_ACK", "MISSION_REQUEST", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM_REACHED",
        "PARAM_VALUE", "STATUSTEXT", "HOME_POSITION",
    ],
)  # fmt: skip
def test_every_answer_is_the_recorded_one(flight_of: Callable[[str], Flight], log: str, kind: str) -> None:
    real, simulated = flight_of(log).both()
    expected = answers(real, kind)
    assert answers(simulated, kind) == expected
    assert expected or kind.startswith(("MISSION", "PARAM"))


@pytest.mark.parametrize("log", ["rejects", "auto", "guided", "gcs_failsafe"])
def test_upload_answers_come_when_they_came(flight_of: Callable[[str], Flight], log: str) -> None:
    for kind in ("MISSION_ACK", "MISSION_REQUEST", "COMMAND_ACK"):
        real, simulated = (
            [one.t_s for one in heard if one.message.get_type() == kind] for heard in flight_of(log).both()
        )
        assert np.allclose(real, simulated, atol=0.2)


def states(heard: list[Heard]) -> list[tuple[float, tuple[int, int]]]:
    """(time, (mode, system status)) at each change from boot's end on."""
    found: list[tuple[float, tuple[int, int]]] = []
    for one in heard:
        if one.message.get_type() == "HEARTBEAT" and one.t_s > 3:
            state = (one.message.custom_mode, one.message.system_status)
            if not found or found[-1][1] != state:
                found.append((one.t_s, state))
    return found


def test_the_failsafe_takes_over_and_the_mission_goes_on_where_it_broke_off(flight_of: Callable[[str], Flight]) -> None:
    flight = flight_of("gcs_failsafe")
    real, simulated = (states(heard) for heard in flight.both())
    # On the way, heartbeats of a second apart decide what is seen of short-lived states; AUTO before take-off is one.
    flown = [[(t_s, state) for t_s, state in states if 45 < t_s < 205] for states in (real, simulated)]
    assert [state for _, state in flown[1]] == [state for _, state in flown[0]]
    assert [state for _, state in flown[1]] == [(3, 4), (6, 5), (6, 4), (3, 4), (6, 4)]
    assert np.allclose([t_s for t_s, _ in flown[1]], [t_s for t_s, _ in flown[0]], atol=0.3)
    last_heartbeat_s = 78.7 + BOOTED_S
    assert flown[1][1][0] - last_heartbeat_s == pytest.approx(5.1, abs=0.2)
    texts = flight.simulated.texts()
    again = texts[texts.index("GCS Failsafe Cleared") :]
    assert "Mission: 13 WP" in again


def track(heard: list[Heard], from_s: float, to_s: float) -> np.ndarray:
    """(N, 7): time, north, east, height above home; velocity north, east, up."""
    rows = []
    for one in heard:
        message = one.message
        if message.get_type() == "GLOBAL_POSITION_INT" and from_s <= one.t_s <= to_s:
            n, e, _ = HOME.neu_from_geodetic(message.lat / 1e7, message.lon / 1e7, 0)
            velocity = message.vx / 100, message.vy / 100, -message.vz / 100
            rows.append((one.t_s, n, e, message.relative_alt / 1000, *velocity))
    return np.array(rows)


def distances(points: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Across and up from a line (K, 3) to points (N, 3), at the nearest place seen from above."""
    start, step = line[:-1], np.diff(line, axis=0)
    square = np.maximum((step[:, :2] ** 2).sum(axis=1), 1e-12)
    along = np.einsum("nkd,kd->nk", points[:, None, :2] - start[None, :, :2], step[:, :2]) / square
    foot = start[None] + np.clip(along, 0, 1)[..., None] * step[None]
    across = np.linalg.norm(points[:, None, :2] - foot[..., :2], axis=2)
    best = across.argmin(axis=1)
    rows = np.arange(len(points))
    return across[rows, best], points[:, 2] - foot[rows, best, 2]


def reached(heard: list[Heard]) -> dict[int, float]:
    return {one.message.seq: one.t_s for one in heard if one.message.get_type() == "MISSION_ITEM_REACHED"}


def assert_same_flight(real: np.ndarray, simulated: np.ndarray) -> None:
    across, up = distances(simulated[:, 1:4], real[:, 1:4])
    assert np.percentile(across, 95) < 0.1
    assert np.percentile(np.abs(up), 95) < 0.15
    assert max(across.max(), np.abs(up).max()) < 0.3
    speeds = [np.hypot(flown[:, 4], flown[:, 5]) for flown in (real, simulated)]
    assert speeds[1].mean() == pytest.approx(speeds[0].mean(), rel=0.1)
    assert speeds[1].max() == pytest.approx(speeds[0].max(), rel=0.1)
    assert simulated[:, 6].max() == pytest.approx(real[:, 6].max(), rel=0.1)
    assert simulated[:, 6].min() == pytest.approx(real[:, 6].min(), abs=0.05)


def test_auto_flies_the_recorded_path_at_the_recorded_speed(flight_of: Callable[[str], Flight]) -> None:
    flight = flight_of("auto")
    times = [reached(heard) for heard in flight.both()]
    real_s, simulated_s = (t_s[86] - t_s[2] for t_s in times)
    assert real_s == pytest.approx(221.6, abs=0.1)
    assert simulated_s == pytest.approx(real_s, rel=0.02)
    legs = [np.diff([t_s[seq] for seq in range(3, 87)]) for t_s in times]
    assert np.abs(legs[1] - legs[0]).max() < 0.3
    flown = [track(heard, t_s[2], t_s[86]) for heard, t_s in zip(flight.both(), times, strict=True)]
    assert_same_flight(*flown)


def test_guided_flies_the_recorded_path_at_the_recorded_speed(flight_of: Callable[[str], Flight]) -> None:
    flight = flight_of("guided")
    real, simulated = (track(heard, 56.5 + BOOTED_S, 120.1 + BOOTED_S) for heard in flight.both())
    assert_same_flight(real, simulated)
    same_time = np.column_stack([np.interp(simulated[:, 0], real[:, 0], real[:, axis]) for axis in (1, 2, 3)])
    assert np.percentile(np.linalg.norm(simulated[:, 1:4] - same_time, axis=1), 95) < 0.2


@pytest.mark.parametrize("log", ["auto", "guided", "gcs_failsafe"])
def test_take_off_return_and_landing_take_as_long(flight_of: Callable[[str], Flight], log: str) -> None:
    real, simulated = (
        {one.message.text.split(" at ")[0]: one.t_s for one in heard if one.message.get_type() == "STATUSTEXT"}
        for heard in flight_of(log).both()
    )
    for words in ("Arming motors", "SIM Hit ground", "Disarming motors"):
        assert simulated[words] == pytest.approx(real[words], abs=3.0)
    seen = []
    for heard in flight_of(log).both():
        landed = [one for one in heard if one.message.get_type() == "EXTENDED_SYS_STATE"]
        seen.append(list(dict.fromkeys(one.message.landed_state for one in landed)))
    assert seen[1] == seen[0]


def test_the_battery_drains_as_fast(flight_of: Callable[[str], Flight]) -> None:
    flight = flight_of("auto")
    used = [
        [one.message.current_consumed for one in heard if one.message.get_type() == "BATTERY_STATUS"][-1]
        for heard in flight.both()
    ]
    assert used[1] == pytest.approx(used[0], rel=0.05)


def test_the_mission_is_over_at_the_end(flight_of: Callable[[str], Flight]) -> None:
    real, simulated = flight_of("auto").both()
    last = [
        [one.message for one in heard if one.message.get_type() == "MISSION_CURRENT"][-1] for heard in (real, simulated)
    ]
    assert (last[1].seq, last[1].total, last[1].mission_state) == (last[0].seq, last[0].total, last[0].mission_state)
