"""Climb until clear: no higher than needed, never lower, and as the executive does it in flight."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from planning.evading.columns import standing
from planning.evading.keep_clear import Room
from planning.evading.manoeuvres import BEYOND_M, AvoidanceParams, Manoeuvre, NoWay, Seen
from tests.reference.box_distance import polyline_boxes_m
from tests.telemetry.avoiding_bench import Wall, craft, state

HERE = np.array([0.0, 0.0, 8.0])
NORTH, EAST = 0.0, math.pi / 2


def wall(ahead_m: float, top_m: float) -> Seen:
    """A sheet of voxels 11 m wide across the way north, from the ground up."""
    places = [(e + 0.5, ahead_m + 0.5, u + 0.5) for e in range(-5, 6) for u in range(round(top_m))]
    return Seen(np.array(places), 1.0)


def climb(
    position: F64, heading_rad: float, depth_m: float, seen: Sequence[Seen], *, params: AvoidanceParams | None = None
) -> Manoeuvre | NoWay:
    """Straight up until the level region ahead is clear, worked out from all that was seen (Bigazzi 2022)."""
    params = params or AvoidanceParams()
    here = np.vstack([position, position])
    room = Room(here, depth_m + params.keep_m + BEYOND_M, seen, None)
    here_m = room.seen_m(here)
    if here_m < params.radius_m + params.least_beside_m:
        return NoWay("over", f"The vehicle is only {here_m:.1f} m from what was seen.")
    keep_m = min(params.keep_m, here_m)
    ahead = depth_m * np.array([math.sin(heading_rad), math.cos(heading_rad), 0.0])
    for climb_m in np.arange(0.0, params.ceiling_m + 1e-9, params.step_m):
        top = position + np.array([0.0, 0.0, climb_m])
        region = np.vstack([position, top, top + ahead])
        if room.is_clear(region, keep_m):
            return Manoeuvre(
                kind="over",
                points_enu_m=region[:2],
                leg=0,
                height_offset_m=float(climb_m),
                seen_m=room.seen_m(region),
                surface_m=room.surface_m(region),
                length_m=float(climb_m),
                top_unseen=not room.with_open_tops().is_clear_of_seen(region, keep_m),
            )
    return NoWay("over", f"The region ahead is not clear up to {params.ceiling_m:g} m above the vehicle.")


def test_it_ends_where_the_region_is_clear() -> None:
    found = climb(HERE, NORTH, 10.0, [wall(7, 14)])
    assert isinstance(found, Manoeuvre)
    assert found.points_enu_m.tolist() == [[0.0, 0.0, 8.0], [0.0, 0.0, 16.0]]
    assert found.height_offset_m == found.length_m == 8.0
    assert found.seen_m == pytest.approx(2.0)
    assert not found.top_unseen


def test_what_is_beside_or_beyond_the_region_needs_no_climb() -> None:
    for heading_rad, depth_m in ((EAST, 10.0), (NORTH, 4.0)):
        found = climb(HERE, heading_rad, depth_m, [wall(7, 14)])
        assert isinstance(found, Manoeuvre)
        assert found.height_offset_m == 0.0


def test_of_what_only_a_radar_has_seen_the_top_is_not_known() -> None:
    found = climb(HERE, NORTH, 10.0, [standing(wall(7, 9), HERE)])
    assert isinstance(found, Manoeuvre)
    assert found.top_unseen
    assert found.height_offset_m > 8.0 - 7.0 + 2.0


def test_without_a_height_that_is_clear_it_says_why() -> None:
    high = climb(HERE, NORTH, 10.0, [wall(7, 60)])
    assert isinstance(high, NoWay)
    assert "up to 30 m" in high.reason
    near = climb(HERE, NORTH, 10.0, [wall(0.6, 14)])
    assert isinstance(near, NoWay)
    assert "only 0.6 m" in near.reason


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_it_keeps_clear_and_half_a_metre_lower_would_not(seed: int) -> None:
    rng, params = np.random.default_rng(seed), AvoidanceParams()
    heading_rad = float(rng.uniform(0, 2 * math.pi))
    voxels = np.floor(rng.uniform([-12, -12, 0], [12, 12, 20], (30, 3))) + 0.5
    voxels = voxels[np.hypot(voxels[:, 0], voxels[:, 1]) > 4.0]
    found = climb(HERE, heading_rad, 9.0, [Seen(voxels, 1.0)], params=params)
    if isinstance(found, NoWay):
        return
    ahead = 9.0 * np.array([math.sin(heading_rad), math.cos(heading_rad), 0.0])

    def apart_m(top: F64) -> float:
        return polyline_boxes_m(np.vstack([HERE, top, top + ahead]), voxels, 0.5)

    top = found.points_enu_m[1]
    assert apart_m(top) == pytest.approx(found.seen_m, abs=0.06)
    assert found.seen_m >= params.keep_m
    if found.height_offset_m > 0:
        assert apart_m(top - [0.0, 0.0, params.step_m]) < params.keep_m + 0.06


def test_the_executive_climbs_about_as_high_by_what_it_sees() -> None:
    """Its region reaches 1 m down; levelling off takes another metre or two."""
    it = craft(Wall(25, 14))
    it.until(lambda: it.avoiding.detour.phase == "climbing")
    north_m, _, up_m = it.truth
    worked_out = climb(np.array([0.0, north_m, up_m]), NORTH, 7.0, [wall(25, 14)])
    assert isinstance(worked_out, Manoeuvre)
    it.until(lambda: state(it) == "offset")
    assert up_m + worked_out.height_offset_m - 1.5 <= it.truth[2] <= up_m + worked_out.height_offset_m + 2.0
