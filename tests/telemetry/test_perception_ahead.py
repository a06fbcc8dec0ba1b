"""The mission ahead against what was seen: a radar's layer on a slope, told from when it is met until it is clear."""

from __future__ import annotations

import numpy as np
import pytest

from telemetry.perception.ahead import Ahead, Flight
from telemetry.perception.mission_line import FlightLine
from telemetry.topics.obstacles import MapDelta, MapOrigin, Sensor, pack_keys

ORIGIN = MapOrigin(45.0, 10.0, 100.0)


def layer(sensor: Sensor) -> MapDelta:
    """A wall 40 m ahead, seen from 5 m above home."""
    keys = np.array([(east, 40, 5) for east in range(-5, 6)], np.int32)
    count = len(keys)
    return MapDelta(sensor, 0, 0, 1, True, 0, 1, ORIGIN, 1.0, pack_keys(keys), bytes([220] * count), bytes(count))


def flight(slope: float) -> Flight:
    line = FlightLine(np.array([[0.0, 0.0, 5.0], [0.0, 80.0, 5.0 + 80.0 * slope]]), (2,))
    return Flight(line, ORIGIN, (0.0, 0.0, 5.0), 3.0, 0.8)


@pytest.mark.parametrize("slope", [-0.25, -0.1, 0.0, 0.1, 0.25])
def test_what_a_radar_has_seen_is_met_on_any_slope(slope: float) -> None:
    ahead = Ahead("radar", run="r")
    found = ahead.look([layer("radar")], flight(slope))
    assert found is not None
    assert found.top_unseen
    (alert,) = ahead.alerts(found, 1.0, 1.0, 1.0)
    assert alert.phase == "begins"
    assert "an obstacle whose top is not seen, 4" in alert.text


def test_a_camera_tells_heights() -> None:
    assert Ahead("vision", run="r").look([layer("vision")], flight(0.25)) is None
    found = Ahead("vision", run="r").look([layer("vision")], flight(0.0))
    assert found is not None
    assert not found.top_unseen


def test_it_ends_once_the_vehicle_has_looked_over_it() -> None:
    ahead = Ahead("radar", run="r")
    ahead.alerts(ahead.look([layer("radar")], flight(0.0)), 1.0, 1.0, 1.0)
    higher = FlightLine(np.array([[0.0, 0.0, 9.0], [0.0, 80.0, 9.0]]), (2,))
    above = flight(0.0)._replace(line=higher, position_enu_m=(0.0, 0.0, 9.0))
    assert ahead.look([], above) is None
    assert ahead.alerts(None, 2.0, 2.0, 2.0) == []
    (alert,) = ahead.alerts(None, 3.0, 3.0, 3.0)
    assert (alert.phase, alert.text) == ("ends", "radar: the mission ahead is clear")
