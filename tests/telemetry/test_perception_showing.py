"""What of a newest frame is shown: all targets with their verdict, some points of a cloud where they lie."""

from __future__ import annotations

import math

import numpy as np

from mapping.perceiving.frame_result import Settings
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.vision_perception import VisionPerception
from mapping.sensor_frames import rows
from telemetry.perception.showing import MOST_POINTS, MOST_TARGETS, Showing, look_of
from telemetry.topics.looks import CloudLook, RadarLook, points_enu_m
from telemetry.topics.obstacles import MapOrigin
from tests.mapping.flights import Flight, radar_frame

ORIGIN = MapOrigin(45.0, 10.0, 120.0)


def test_all_targets_are_shown_with_what_the_gate_made_of_them() -> None:
    perception = RadarPerception(Settings(gate_azimuth_rad=math.radians(30)))
    flight = Flight(perception)
    assert look_of(perception, ORIGIN, utc_minus_mono_s=1000.0) is None
    flight.move()
    xyz = np.array([[0, 20, 1], [20, 20, 1], [0, 20, -5], [0, 1.0, 0.1], [math.nan, 5, 0], [0, 300, 10]], np.float64)
    perception.on_frame(radar_frame(flight.t_s, 1, xyz, np.zeros(6), np.full(6, 30.0)), flight.t_s)
    look = look_of(perception, None, utc_minus_mono_s=1000.0)
    assert isinstance(look, RadarLook)
    shown = rows(look.xyz_m, 3)
    assert np.isfinite(shown).all()
    np.testing.assert_allclose(shown, xyz[[0, 1, 2, 3, 5]], atol=1e-5)
    assert list(look.kept) == [1, 0, 0, 0, 0]
    assert (round(math.degrees(look.azimuth_rad)), round(math.degrees(look.high_rad))) == (30, 20)
    assert (round(look.t_utc_s - look.t_mono_s, 6), look.farthest_m) == (1000.0, 125.0)


def test_of_a_flood_of_targets_no_more_are_told() -> None:
    perception = RadarPerception(Settings())
    flight = Flight(perception)
    flight.move()
    flight.radar(flight.position + np.column_stack([np.zeros(1500), np.linspace(5, 90, 1500), np.full(1500, 1.0)]))
    look = look_of(perception, None, utc_minus_mono_s=0.0)
    assert isinstance(look, RadarLook)
    assert (len(rows(look.xyz_m, 3)), len(look.kept)) == (MOST_TARGETS, MOST_TARGETS)


def test_each_frame_is_shown_once_and_not_every_one() -> None:
    perception = RadarPerception(Settings())
    flight, showing, shown = Flight(perception), Showing(0.0), []
    for _ in range(40):
        flight.move(0.1)
        flight.radar(np.array([[0.0, 20.0, 1.0]]) + flight.position)
        shown += [look for _ in range(2) if (look := showing.due(perception, None, flight.t_s))]
    assert 7 <= len(shown) <= 8
    assert len({look.t_mono_s for look in shown}) == len(shown)


def test_of_a_cloud_every_part_is_shown_where_it_lies() -> None:
    perception = VisionPerception(Settings(resolution_m=0.5))
    flight = Flight(perception)
    flight.move()
    cloud = flight.position + np.column_stack(
        [np.linspace(-8, 8, 50_000), np.linspace(5, 30, 50_000), np.linspace(-4, 4, 50_000)]
    )
    flight.camera(cloud)
    assert look_of(perception, None, utc_minus_mono_s=0.0) is None
    look = look_of(perception, ORIGIN, utc_minus_mono_s=0.0)
    assert isinstance(look, CloudLook)
    shown = points_enu_m(look)
    assert 0.9 * MOST_POINTS < len(shown) <= MOST_POINTS
    assert len(look.points_cm) <= 6 * MOST_POINTS
    np.testing.assert_allclose(shown[0], cloud[0], atol=0.01)
    np.testing.assert_allclose(shown.max(axis=0), cloud.max(axis=0), atol=0.05)
