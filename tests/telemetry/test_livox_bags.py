"""Livox's CustomMsg in bags: every point at its own time, whatever moves meanwhile."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mapping.geometry.arrays import F64
from telemetry.recording.ros.bag import list_bag, read_bag
from telemetry.recording.ros.livox_messages import SLICE_NS, slices_of
from telemetry.recording.ros.placing import PlacedBag, placed
from telemetry.recording.ros.point_messages import MalformedMessageError
from tests.telemetry.bags import KINDS, T0_NS, Entry, Messages, write_bag

SPEED_M_S, TURN_RAD_S = 10.0, 0.8
SWEEP_NS, SWEEPS = 100_000_000, 5
POST_M = np.array([25.0, 3.0, 2.0])
"""In the frame of the poses."""


def pose(t_s: float) -> tuple[F64, Rotation]:
    return np.array([SPEED_M_S * t_s, 0.0, 1.0]), Rotation.from_euler("z", TURN_RAD_S * t_s)


def seen(t_s: float) -> F64:
    place, turn = pose(t_s)
    return turn.inv().apply(POST_M - place)


def entries(kind: str, **changes: Any) -> list[Entry]:
    """A post that is seen every 2 ms of each sweep by a robot that flies past it and turns."""
    m, found = Messages(kind), list[Entry]()
    for number in range(61):
        place, turn = pose(number * 0.01)
        t_ns = T0_NS + number * 10_000_000
        found.append(("/odom", t_ns, m.odometry(t_ns, "odom", "base_link", place, np.roll(turn.as_quat(), 1))))
    offsets_ns = np.arange(0, SWEEP_NS, 2_000_000)
    for number in range(SWEEPS):
        t_ns = T0_NS + number * SWEEP_NS
        xyz = [seen((t_ns - T0_NS + ns) / 1e9) for ns in offsets_ns.tolist()]
        found.append(("/livox/lidar", t_ns + SWEEP_NS, m.livox(t_ns, "base_link", xyz, offsets_ns, **changes)))
    return sorted(found, key=lambda entry: entry[1])


def read(bag: Path) -> PlacedBag:
    return placed(read_bag(bag, list_bag(bag), points="/livox/lidar", pose="/odom"))


@pytest.mark.parametrize(("kind", "defined"), [*((kind, True) for kind in KINDS), ("db3", False)])
def test_a_sweep_of_a_robot_that_moves_is_one_post(tmp_path: Path, kind: str, defined: bool) -> None:
    path = write_bag(tmp_path, kind, entries(kind))
    if not defined:  # as ROS 2 wrote bags until Humble
        (store,) = path.glob("*.db3")
        with closing(sqlite3.connect(store)) as database, database:
            database.execute("DELETE FROM message_definitions")
    bag = read(path)
    slices = SWEEP_NS // SLICE_NS
    assert len(bag.clouds) == slices * SWEEPS
    found = [cloud.pose.p_enu_m + cloud.xyz_m @ cloud.pose.R_enu_body.T for cloud in bag.clouds]
    off_m = np.linalg.norm(np.concatenate(found) - (POST_M - [0.0, 0.0, 1.0]), axis=1)
    # Half a slice, at the robot's speed and as it turns a post 25 m away; a whole sweep as one would be 3 m off.
    assert off_m.max() < (SPEED_M_S + 25 * TURN_RAD_S) * 0.5 * SLICE_NS / 1e9
    assert len(off_m) == SWEEPS * SWEEP_NS // 2_000_000
    assert not any("timebase" in note for note in bag.notes)


def test_another_clock_of_the_sensor_is_said(tmp_path: Path) -> None:
    bag = read(write_bag(tmp_path, "db3", entries("db3", timebase=5_000_000_000)))
    assert any(note.startswith(f"{SWEEPS} messages have a sensor's clock (timebase)") for note in bag.notes)


def test_what_contradicts_itself_is_left_out_and_counted(tmp_path: Path) -> None:
    whole, broken = entries("db3"), entries("db3", said=7)
    mixed = [b if b[0] == "/livox/lidar" and number % 2 else w for number, (w, b) in enumerate(zip(whole, broken,
             strict=True))]  # fmt: skip
    bag = read(write_bag(tmp_path, "db3", mixed))
    assert 0 < len(bag.clouds) < SWEEP_NS // SLICE_NS * SWEEPS
    assert any("it says 7 points and has 50" in note for note in bag.notes)


def test_points_without_an_echo_or_a_place_are_no_points() -> None:
    m = Messages("db3")
    nan = float("nan")
    slices, without_place = slices_of(m.livox(T0_NS, "a", [[0, 0, 0], [nan, 1, 1], [1, 2, 3]], [0, 1, 30_000_000]))
    assert without_place == 1
    assert [(after_ns, found["xyz_m"].tolist()) for after_ns, found in slices] == [(30_000_000, [[1.0, 2.0, 3.0]])]
    assert [len(found) for _, found in slices_of(m.livox(T0_NS, "a", np.empty((0, 3)), []))[0]] == [0]
    with pytest.raises(MalformedMessageError, match=r"measured 4\.000 s after it"):
        slices_of(m.livox(T0_NS, "a", [[1, 2, 3]], [4_000_000_000]))
