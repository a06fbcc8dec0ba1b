"""Ways through a robot's transforms, held against scipy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from mapping.geometry.frames import attitude_of, attitude_rotation
from telemetry.errors import RecordingError
from telemetry.recording.ros.bag_types import TRANSFORM
from telemetry.recording.ros.transforms import Gap, Transform, tree_of

NAMES = ("odom", "base", "gimbal", "radar", "gps", "elsewhere")
S = 1_000_000_000
T0_NS = 1_700_000_000 * S
SECOND_NS = S // 2


def row(t_ns: int, parent: int, child: int, xyz: ArrayLike, turn: Rotation, *, static: bool = False) -> tuple:
    x, y, z, w = turn.as_quat()
    return t_ns, parent, child, xyz, (w, x, y, z), static


def matrix(xyz: ArrayLike, turn: Rotation) -> np.ndarray:
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn.as_matrix(), xyz
    return whole


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 1.0))
def test_a_moving_base_with_a_turning_gimbal_and_a_fixed_mount(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    base_s, gimbal_s = np.arange(6) * 0.1, np.arange(9) * 0.07
    places, arms = rng.uniform(-50, 50, (6, 3)), rng.uniform(-1, 1, (9, 3))
    turns, nods = Rotation.random(6, rng=rng), Rotation.random(9, rng=rng)
    mount_m, mount, gps_m = rng.uniform(-1, 1, 3), Rotation.random(rng=rng), rng.uniform(-1, 1, 3)
    rows = [row(T0_NS + round(t * S), 0, 1, places[k], turns[k]) for k, t in enumerate(base_s)]
    rows += [row(T0_NS + round(t * S), 1, 2, arms[k], nods[k]) for k, t in enumerate(gimbal_s)]
    rows.append(row(T0_NS, 2, 3, mount_m, mount, static=True))
    rows.append(row(T0_NS, 1, 4, gps_m, Rotation.identity(), static=True))
    tree = tree_of(np.array([rows[k] for k in rng.permutation(len(rows))], TRANSFORM), NAMES)

    t_s = 0.5 * share
    base = matrix([np.interp(t_s, base_s, places[:, k]) for k in range(3)], Slerp(base_s, turns)(t_s))
    arm = matrix([np.interp(t_s, gimbal_s, arms[:, k]) for k in range(3)], Slerp(gimbal_s, nods)(t_s))
    radar = base @ arm @ matrix(mount_m, mount)
    gps = base @ matrix(gps_m, Rotation.identity())
    for target, source, wanted in (
        ("odom", "radar", radar),
        ("radar", "odom", np.linalg.inv(radar)),
        ("gps", "radar", np.linalg.inv(gps) @ radar),
    ):
        way = tree.way(target, source)
        assert way is not None
        found = way.at(T0_NS + round(t_s * S), SECOND_NS)
        assert isinstance(found, Transform)
        points = rng.uniform(-30, 30, (5, 3))
        np.testing.assert_allclose(found(points), points @ wanted[:3, :3].T + wanted[:3, 3], atol=2e-5)


@settings(max_examples=100, deadline=None)
@given(
    heading=st.floats(0.0, 6.28), pitch=st.floats(-1.5707, 1.5707) | st.just(np.pi / 2), roll=st.floats(-3.1415, 3.1415)
)
def test_attitudes_and_rotations_are_each_others_inverse(heading: float, pitch: float, roll: float) -> None:
    R = attitude_rotation(heading, pitch, roll)
    np.testing.assert_allclose(attitude_rotation(*attitude_of(R)), R, atol=1e-6)


def tree() -> tuple[np.ndarray, list[tuple]]:
    still = Rotation.identity()
    rows = [row(T0_NS + k * S // 10, 0, 1, (k, 0, 0), still) for k in (0, 1, 2, 12, 13)]
    return np.array(rows, TRANSFORM), rows


def test_gaps_and_times_outside_are_told_with_their_ends() -> None:
    way = tree_of(tree()[0], NAMES).way("odom", "base")
    assert way is not None
    assert way.at(T0_NS + 5 * S // 10, SECOND_NS) == Gap("odom", "base", T0_NS + S // 5, T0_NS + 12 * S // 10)
    assert isinstance(way.at(T0_NS + 5 * S // 10, S), Transform)
    assert way.at(T0_NS - 1, SECOND_NS) == Gap("odom", "base", None, T0_NS)
    assert way.at(T0_NS + 2 * S, SECOND_NS) == Gap("odom", "base", T0_NS + 13 * S // 10, None)
    assert isinstance(way.at(T0_NS + 13 * S // 10, SECOND_NS), Transform)


def test_what_is_not_connected_has_no_way() -> None:
    still = Rotation.identity()
    rows = [*tree()[1], row(T0_NS, 5, 3, (0, 0, 0), still, static=True)]
    assert tree_of(np.array(rows, TRANSFORM), NAMES).way("odom", "radar") is None


def test_two_parents_and_circles_are_refused() -> None:
    still = Rotation.identity()
    for extra, words in (((T0_NS, 4, 1), "two parents"), ((T0_NS, 1, 0), "circle")):
        rows = [*tree()[1], row(*extra, (0, 0, 0), still, static=True)]
        with pytest.raises(RecordingError, match=words):
            tree_of(np.array(rows, TRANSFORM), NAMES)


def test_of_two_transforms_with_one_stamp_the_later_one_holds() -> None:
    still = Rotation.identity()
    for static in (True, False):
        rows = [row(T0_NS, 0, 1, (k, 0, 0), still, static=static) for k in (1, 2)]
        way = tree_of(np.array(rows, TRANSFORM), NAMES).way("odom", "base")
        assert way is not None
        found = way.at(T0_NS, SECOND_NS)
        assert isinstance(found, Transform)
        assert found.shift_m[0] == 2
