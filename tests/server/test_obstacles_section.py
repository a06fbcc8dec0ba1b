"""Slices through the maps, and the radar's targets as pages get them."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.sensor_frames import packed
from server.obstacles.obstacle_watch import Watch
from server.obstacles.section import MOST_CELLS, Looking, level_axis, placed_status, sliced
from server.scene.layers.sights import Sights
from server.scene.mirror import MapMirror
from server.schemas import SectionAsked
from telemetry.topics.looks import RadarLook
from telemetry.topics.obstacles import MapOrigin
from tests.server.fakes import Told
from tests.server.obstacle_messages import ORIGIN, delta, status

NORTH = level_axis(0.0)
HERE = np.array([0.5, 0.5, 5.0])


class Slope(Sights):
    """Rises by 1 in 10 to the north; unknown beyond 30 m."""

    def __init__(self) -> None:
        """Nothing else is seen."""

    def ground_up_m(self, origin: MapOrigin, enu_m: np.ndarray) -> np.ndarray:
        assert origin == ORIGIN
        return np.where(np.abs(enu_m[:, 1]) < 30, enu_m[:, 1] / 10, np.nan)


def watching() -> Watch:
    return Watch("live", Told())


def mirror_of(keys: list[tuple[int, int, int]], explained: list[int] | None = None) -> MapMirror:
    mirror = MapMirror("radar")
    mirror.fold(delta(keys, explained=0 if explained is None else explained))
    return mirror


def test_a_slice_holds_what_lies_in_its_thickness_once() -> None:
    keys = [(0, 10, 4), (1, 10, 4), (3, 10, 4), (0, -8, 2), (0, 60, 4)]
    found = sliced(mirror_of(keys).voxels(), HERE, NORTH, thickness_m=4.0, reach_m=40.0)
    assert sorted(zip(found.s_m, found.up_m, strict=True)) == [(-8.0, 2.5), (10.0, 4.5)]
    wide = sliced(mirror_of([(3, 7, 4)]).voxels(), HERE, NORTH, thickness_m=6.0, reach_m=40.0)
    assert (wide.s_m, wide.left_out) == ([7.0], 0)


def test_across_the_heading_right_is_right() -> None:
    east = level_axis(math.pi / 2)
    found = sliced(mirror_of([(12, 0, 6)]).voxels(), HERE, east, thickness_m=2.0, reach_m=40.0)
    assert (found.s_m, found.up_m) == ([12.0], [6.5])


def test_a_cell_with_anything_unknown_is_no_known_ground() -> None:
    mirror = mirror_of([(0, 10, 4), (1, 10, 4), (0, 12, 4)], [1, 0, 1])
    found = sliced(mirror.voxels(), HERE, NORTH, thickness_m=4.0, reach_m=40.0)
    assert dict(zip(found.s_m, found.known_ground, strict=True)) == {10.0: False, 12.0: True}


def test_too_many_cells_are_counted_and_obstacles_come_before_known_ground() -> None:
    grid = [(0, n, up) for n in range(-100, 100) for up in range(30)]
    mirror = mirror_of(grid, [0 if up == 29 else 1 for _, _, up in grid])
    found = sliced(mirror.voxels(), HERE, NORTH, thickness_m=1.0, reach_m=200.0)
    assert len(found.s_m) == MOST_CELLS
    assert found.left_out == len(grid) - MOST_CELLS
    assert found.known_ground.count(False) == 200


def test_the_slice_is_where_the_vehicle_is_with_the_models_ground() -> None:
    watch = watching()
    watch.mirrors["radar"].fold(delta([(0, 10, 4)]))
    watch.mirrors["vision_flight"].fold(delta([(0, 11, 4)], sensor="vision_flight", resolution_m=0.5))
    looking = Looking({"live": watch}, Slope())
    nothing = asyncio.run(looking.section(SectionAsked()))
    assert (nothing.text, nothing.maps) == ("No sensor tells where the vehicle is.", [])
    watch.on_status(status())
    found = asyncio.run(looking.section(SectionAsked()))
    assert (found.vehicle_up_m, found.heading_deg, found.text) == (5.0, 0.0, "")
    assert {m.name: m.s_m for m in found.maps} == {"radar": [10.0], "vision_flight": [6.0]}
    ground = dict(zip(found.ground_s_m, found.ground_up_m, strict=True))
    assert ground[20.0] == pytest.approx(2.0)
    assert ground[40.0] is None


def test_the_place_is_the_radars_before_the_cameras_and_never_an_unplaced_one() -> None:
    radar, camera = status(), replace(status("vision"), t_mono_s=99.0)
    assert placed_status([camera, radar]) is radar
    assert placed_status([camera]) is camera
    assert placed_status([replace(camera, placed=False)]) is None


def test_the_radars_targets_come_with_their_gate() -> None:
    watch = watching()
    looking = Looking({"live": watch}, None)
    assert asyncio.run(looking.targets("live")).t_mono_s is None
    xyz = np.array([[1.0, 20.0, 2.0], [-30.0, 5.0, 0.0]])
    watch.on_radar_look(RadarLook(7.0, 1007.0, packed(xyz), bytes([1, 0]), math.radians(45), 0.0, 0.3, 1.5, 125.0))
    found = asyncio.run(looking.targets("live"))
    assert (found.right_m, found.ahead_m, found.kept) == ([1.0, -30.0], [20.0, 5.0], [True, False])
    assert found.azimuth_deg == pytest.approx(45.0)
    watch.forget()
    assert asyncio.run(looking.targets("live")).t_mono_s is None
