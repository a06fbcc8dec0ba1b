"""The camera that follows: behind and above, waiting for the hand, and going on from where that has left it."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.scene.cameras.cameras import Cameras
from server.scene.cameras.chase import ABOVE_M, BACK_M, SETTLE_S, Chase
from server.scene.cameras.projection import Pose
from server.scene.geometry.stage import Drawing
from server.scene.layers.flight_layers import flight_nodes
from server.scene.layers.vehicle_layers import VEHICLE_M, VehiclePose
from server.scene.layers.vehicles import Vehicles
from tests.server.scene_fixtures import hill, state_over

VEHICLE = np.array([10.0, -4.0, 30.0])
NO_GROUND = -math.inf


@given(heading_rad=st.floats(0, 2 * math.pi))
def test_it_stands_behind_and_above_and_looks_ahead(heading_rad: float) -> None:
    pose = Chase.behind(heading_rad, 0.0, aspect=1.6).pose(VEHICLE, ground=NO_GROUND)
    nose = np.array([math.sin(heading_rad), math.cos(heading_rad), 0.0])
    away = pose.position - VEHICLE
    assert away @ nose == pytest.approx(-BACK_M)
    assert away[2] == pytest.approx(ABOVE_M)
    assert (pose.look_at - VEHICLE) @ nose > 0


def test_a_narrow_picture_is_seen_from_farther_back() -> None:
    wide, narrow = (Chase.behind(0.0, 0.0, aspect=aspect).offset for aspect in (1.6, 0.6))
    assert narrow.back_m > 1.5 * wide.back_m


def test_it_turns_slowly_and_the_short_way_round() -> None:
    chase = Chase.behind(math.radians(350), 0.0, aspect=1.6).onward(math.radians(10), 0.1)
    assert math.radians(350) < chase.heading_rad < math.radians(353)
    for step in range(2, 100):
        chase = chase.onward(math.radians(10), step / 10)
    assert math.remainder(chase.heading_rad - math.radians(10), math.tau) == pytest.approx(0, abs=0.01)


def test_ground_behind_never_hides_it() -> None:
    chase = Chase.behind(0.0, 0.0, aspect=1.6)
    assert chase.pose(VEHICLE, ground=90.0).position[2] > 90.0


def test_it_goes_on_from_where_the_hand_has_left_it() -> None:
    chase = Chase.behind(0.0, 0.0, aspect=1.6).hold(1.0, held=True)
    assert chase.is_waiting(50.0)
    chase = chase.hold(60.0, held=False)
    assert chase.is_waiting(60.0 + SETTLE_S / 2)
    assert not chase.is_waiting(60.1 + SETTLE_S)
    assert chase.is_to_be_left
    left = Pose(np.array([3.0, -40.0, 55.0]), np.array([0.0, 0.0, 30.0]))
    chase = chase.left_at(left)
    assert not chase.is_to_be_left
    pose = chase.pose(VEHICLE, ground=NO_GROUND)
    assert pose.position - pose.look_at == pytest.approx(left.position - left.look_at)


class Camera:
    def __init__(self) -> None:
        self.position, self.look_at = np.zeros(3), np.zeros(3)
        self.aspect, self.near, self.far, self.max_orbit_distance, self.update_timestamp = 1.6, 1.0, 1.0, 1.0, 0.0


class Client:
    client_id = 3

    def __init__(self) -> None:
        self.camera, self.moves = Camera(), 0

    def atomic(self) -> Any:
        self.moves += 1
        return _Nothing()

    def flush(self) -> None: ...


class _Nothing:
    def __enter__(self) -> None: ...

    def __exit__(self, *_: object) -> None: ...


def test_a_page_follows_its_own_vehicle_until_it_wants_something_else() -> None:
    dsm = hill()
    drawing = Drawing.of(dsm, state_over(dsm))
    assert drawing is not None
    clients: dict[str, Any] = {"anna": Client()}
    vehicles = Vehicles(cast(Any, SimpleNamespace(draw=lambda layers: None)))
    vehicles.redraw(drawing)
    clock = SimpleNamespace(s=0.0)
    host: Any = SimpleNamespace(client=clients.get, page_ids=lambda: set(clients))
    cameras = Cameras(host, vehicles, now_mono_s=lambda: clock.s)
    assert not cameras.chase("anna", "live")

    place_m = np.array([500_040.0, 3_999_970.0, 140.0])
    vehicles.move("live", VehiclePose(place_m))
    assert cameras.chase("anna", "live")
    cameras.follow(drawing)
    first = clients["anna"].camera.position
    assert np.linalg.norm(np.array(first) - drawing.frame.scene_from_model(place_m)) < 30
    cameras.follow(drawing)
    assert clients["anna"].moves == 1, "what stands still sends nothing"

    vehicles.move("live", VehiclePose(place_m + np.array([0.0, 5.0, 1.0])))
    clock.s = 0.1
    cameras.follow(drawing)
    assert np.array(clients["anna"].camera.position) - first == pytest.approx(np.array([0.0, 5.0, 1.0]))
    cameras.hold("anna", held=True)
    vehicles.move("live", VehiclePose(place_m))
    cameras.follow(drawing)
    cameras.free("anna")
    cameras.follow(drawing)
    assert clients["anna"].moves == 2


def test_a_guided_way_is_drawn_until_it_is_over_or_the_model_is_another() -> None:
    dsm = hill()
    drawing = Drawing.of(dsm, state_over(dsm))
    assert drawing is not None
    drawn: dict[str, Any] = {}
    vehicles = Vehicles(cast(Any, SimpleNamespace(draw=drawn.update)))
    vehicles.redraw(drawing)
    way_m = np.array([[500_040.0, 3_999_970.0, 140.0], [500_060.0, 3_999_970.0, 145.0]])
    vehicles.lead("live", np.zeros((0, 3)))
    assert "way_live" not in drawn, "nothing has to be taken away"
    vehicles.lead("live", way_m, is_certified=False)
    line, end = drawn["way_live"]
    assert np.ptp(np.asarray(line.props["points"]).reshape(-1, 3)[:, 0]) == pytest.approx(20.0)
    refused = line.props["colors"]
    vehicles.lead("live", way_m)
    assert not np.array_equal(refused, drawn["way_live"][0].props["colors"])
    assert end.name.startswith(line.name)
    vehicles.redraw(drawing)
    assert len(drawn["way_live"]) == 2
    vehicles.redraw(None)
    assert drawn["way_live"] == []


def test_no_mark_on_the_way_is_larger_than_the_vehicle() -> None:
    dsm = hill()
    made = Drawing.of(dsm, state_over(dsm))
    assert made is not None
    far = replace(made, frame=replace(made.frame, half_diagonal_m=2000.0))
    sizes = {node.name: node.props["scale"] for node in flight_nodes(far) if node.name == "/worst"}
    assert sizes["/worst"] < VEHICLE_M
    assert {"/worst_dot", "/waypoints"} <= {node.name for node in flight_nodes(far)}
