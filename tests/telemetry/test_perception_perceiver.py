"""One sensor's perception over bus messages, without bus: what is fed when, what is told, what begins afresh."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import chain, repeat
from typing import Any

import numpy as np
import pytest

from mapping.sensor_frames import RadarFrame, packed
from telemetry.perception.perceiver import BROKEN, Perceiver
from telemetry.perception.sensor_kinds import KINDS, RADAR, RANGES, VISION
from telemetry.perception.status import Outcome
from telemetry.topics.messages import FlightStatus
from telemetry.topics.obstacles import AvoidanceStatus, FlightMapStatus, PerceptionSettings
from tests.telemetry import perception_flights as flights

T0_MONO_S, T0_UTC_S = 1000.0, 1_700_000_000.0
MAKE = {"radar": flights.radar_frame, "vision": flights.cloud_frame, "ranges": flights.range_frame}


class Flight:
    """Feeds a perceiver as its node would."""

    def __init__(self, sensor: str) -> None:
        self.perceiver = Perceiver(KINDS[sensor], run="test", utc_minus_mono_s=T0_UTC_S - T0_MONO_S)
        self.sensor, self.number = sensor, 0
        self.outcomes: list[Outcome] = []

    def state(self, t_s: float, **changes: Any) -> None:
        self.perceiver.on_state(flights.state_at(t_s, T0_MONO_S, T0_UTC_S, **changes))

    def fly(self, from_s: float, to_s: float, **changes: Any) -> Outcome:
        for k in range(round(from_s * 20), round(to_s * 20)):
            t_s = k / 20
            self.state(t_s, **changes)
            if self.sensor == "vision":
                self.perceiver.on_camera(flights.slam_pose(t_s, T0_MONO_S))
            if k % 2 == 0:
                self.frame(t_s)
        return self.outcomes[-1]

    def frame(self, t_s: float, frame: Any = None) -> Outcome:
        self.number += 1
        frame = frame or MAKE[self.sensor](t_s, self.number, T0_MONO_S, T0_UTC_S)
        times = chain((T0_MONO_S + t_s + 0.02,), repeat(T0_MONO_S + t_s + 0.05))
        outcome = self.perceiver.work(frame, lambda: next(times))
        self.outcomes.append(outcome)
        return outcome

    @property
    def alerts(self) -> list[tuple[str, str]]:
        return [(alert.kind, alert.phase) for outcome in self.outcomes for alert in outcome.alerts]


@pytest.mark.parametrize("sensor", ["radar", "vision", "ranges"])
def test_a_wall_is_mapped_alerted_and_told_with_its_place_on_earth(sensor: str) -> None:
    flight = Flight(sensor)
    status = flight.fly(0.0, 11.0).status
    assert status.state == "running"
    assert status.frames == 110
    assert status.voxels_occupied > 0
    assert status.latency_s == pytest.approx(0.05, abs=1e-6)
    assert status.origin is not None
    assert status.origin.alt_amsl_m == 120.0
    assert status.region is not None
    assert status.region.occupied
    obstacle = status.obstacles[0]
    assert obstacle.distance_m == pytest.approx(flights.WALL_NORTH_M - 33.0, abs=1.5)
    assert obstacle.lat_deg is not None
    assert obstacle.lon_deg is not None
    assert obstacle.alt_amsl_m is not None
    place = flights.FRAME.to_enu(obstacle.lat_deg, obstacle.lon_deg, obstacle.alt_amsl_m)[0]
    assert place == pytest.approx(obstacle.enu_m, abs=0.01)
    assert flight.alerts[0] == ("obstacle", "begins")
    first = next(alert for outcome in flight.outcomes for alert in outcome.alerts)
    assert first.t_utc_s - first.t_mono_s == pytest.approx(T0_UTC_S - T0_MONO_S)
    assert first.id.startswith(f"{sensor}-test-")
    assert status.basis is not None
    assert status.basis.vehicle_t_utc_s == pytest.approx(T0_UTC_S + 10.9)


def test_a_new_flight_and_another_home_begin_the_map_afresh_and_say_so() -> None:
    flight = Flight("radar")
    assert "begins afresh" in flight.fly(0.0, 4.0).status.text
    before = flight.perceiver.perception
    flight.state(4.0, armed=False)
    after = flight.fly(4.05, 4.5, armed=True).status
    assert flight.perceiver.perception is not before
    assert after.frames < 10
    assert "new flight" in after.text
    moved = flight.fly(4.5, 5.0, home_lat_deg=flights.HOME[0] + 1e-4).status
    assert "another home" in moved.text
    assert moved.origin is not None
    assert moved.origin.lat_deg == flights.HOME[0] + 1e-4


def test_home_that_breathes_stays_where_it_was() -> None:
    flight = Flight("radar")
    origin = flight.fly(0.0, 1.0).status.origin
    status = flight.fly(1.0, 2.0, home_lat_deg=flights.HOME[0] + 1e-6, home_alt_amsl_m=120.2).status
    assert status.origin == origin
    assert status.frames == 20


def test_the_camera_tells_of_its_map_of_the_flight_and_of_a_new_part() -> None:
    flight = Flight("vision")
    told = flight.fly(0.0, 1.0).status.flight_map
    flight.perceiver.perception.accumulate()
    assert told == FlightMapStatus(0, told.map_bytes if told else 0)
    whole = flight.perceiver.perception.flight
    assert whole is not None
    whole.begin_part("The camera's path jumped by 3.0 m", T0_MONO_S + 1.0)
    status = flight.fly(1.0, 2.0).status
    assert status.flight_map is not None
    assert status.flight_map.part == 2
    assert "jumped by 3.0 m: the camera's map of the flight begins a new part (2)." in status.text
    assert "jumped" not in flight.fly(2.0, 25.0).status.text
    assert Flight("radar").fly(0.0, 1.0).status.flight_map is None


def test_emptied_when_asked_and_told_when_full() -> None:
    flight = Flight("radar")
    flight.fly(0.0, 11.0)
    assert ("obstacle", "ends") not in flight.alerts
    flight.perceiver.on_settings(PerceptionSettings(clear_count=1))
    assert flight.perceiver.perception.map.occupied_count == 0
    assert "emptied" in flight.frame(11.0).status.text
    assert ("obstacle", "ends") in flight.alerts
    assert flight.perceiver.settings.clear_count == 1


@pytest.mark.parametrize(
    "bad",
    [
        PerceptionSettings(vision_resolution_m=0.01),
        PerceptionSettings(vision_resolution_m=0.0),
        PerceptionSettings(memory_limit_bytes=10),
        PerceptionSettings(vision_depth_m=math.nan),
    ],
)
def test_settings_that_cannot_be_are_refused_with_the_number(bad: PerceptionSettings) -> None:
    flight = Flight("vision")
    flight.perceiver.on_settings(bad)
    assert "refused" in flight.fly(0.0, 0.5).status.text
    assert flight.perceiver.settings == PerceptionSettings()
    assert flight.perceiver.perception.map.resolution_m == 0.5
    flight.perceiver.on_settings(PerceptionSettings(vision_resolution_m=1.0))
    assert "refused" not in flight.fly(0.5, 1.0).status.text
    assert flight.perceiver.perception.map.resolution_m == 1.0


@pytest.mark.parametrize("other", [{"radar_resolution_m": 0.5}, {"memory_limit_bytes": 50_000_000}], ids=str)
def test_another_resolution_or_memory_limit_begins_the_map_anew_and_says_so(other: dict[str, Any]) -> None:
    flight = Flight("radar")
    flight.fly(0.0, 11.0)
    flight.perceiver.on_settings(PerceptionSettings(radar_depth_m=20.0))
    assert flight.perceiver.perception.map.occupied_count > 0
    flight.perceiver.on_settings(PerceptionSettings(radar_depth_m=20.0, **other))
    assert flight.perceiver.perception.map.occupied_count == 0
    assert "The map begins anew, with voxels of" in flight.frame(11.0).status.text
    assert ("obstacle", "ends") in flight.alerts


def test_a_region_that_cannot_be_leaves_the_map_as_it_was() -> None:
    flight = Flight("vision")
    flight.fly(0.0, 1.0)
    before = flight.perceiver.perception.map
    flight.perceiver.on_settings(
        PerceptionSettings(vision_depth_m=40, fov_deg=120, height_m=20, vision_resolution_m=0.1)
    )
    assert "refused: A region 40 m deep" in flight.frame(1.0).status.text
    assert flight.perceiver.perception.map is before
    assert flight.perceiver.perception.settings.depth_m == 7.0


def garbage(t_s: float, number: int) -> RadarFrame:
    return flights.radar_frame(t_s, number, T0_MONO_S, T0_UTC_S)


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (replace(garbage(2.0, 90), xyz_m=b"1234567"), BROKEN),
        (replace(garbage(2.0, 90), snr_db=b""), BROKEN),
        (replace(garbage(2.0, 90), t_mono_s=math.nan), "time not finite"),
        (replace(garbage(2.0, 90), t_mono_s=T0_MONO_S + 60.0), "from the future"),
        (replace(garbage(2.0, 90), t_mono_s=T0_MONO_S + 1.0), "out of order"),
        (replace(garbage(2.0, 90), xyz_m=packed(np.full((12, 3), np.nan))), "points: not finite"),
        (
            replace(garbage(2.0, 90), xyz_m=packed(np.full((12, 3), 1e6))),
            "points: absurd range, speed or strength",
        ),
    ],
)
def test_garbage_is_counted_and_changes_no_map(frame: RadarFrame, reason: str) -> None:
    flight = Flight("radar")
    flight.fly(0.0, 1.95)
    revision = flight.perceiver.perception.map.revision
    status = flight.frame(2.0, frame).status
    assert flight.perceiver.perception.map.revision == revision
    assert reason in {count.what for count in status.dropped}
    assert flight.fly(2.05, 3.0).status.state == "running"


def test_a_position_that_jumps_a_hundred_metres_is_quarantined() -> None:
    flight = Flight("radar")
    flight.fly(0.0, 2.0)
    jumped = flight.fly(2.0, 2.8, lat_deg=flights.HOME[0] + 1e-3)
    assert any("jumped" in count.what for count in jumped.status.dropped)
    assert jumped.status.state == "frozen"
    assert flight.fly(2.8, 4.0).status.state == "running"


def test_without_gnss_the_radar_map_stands_still() -> None:
    flight = Flight("radar")
    revision = flight.perceiver.perception.map.revision
    flight.fly(0.0, 2.0)
    revision = flight.perceiver.perception.map.revision
    status = flight.fly(2.0, 3.5, gnss_fix="no_fix").status
    assert status.state == "frozen"
    assert flight.perceiver.perception.map.revision == revision


def test_without_a_first_position_the_camera_s_obstacles_are_told_without_a_place() -> None:
    flight = Flight("vision")
    flying = {"lat_deg": None, "lon_deg": None, "home_lat_deg": None}
    outcomes = [flight.fly(0.1 * k, 0.1 * k + 0.1, **flying) for k in range(40)]
    status = outcomes[-1].status
    assert (status.state, status.placed, status.origin) == ("running", False, None)
    assert status.frames > 5
    assert "No position of the vehicle yet" in status.text
    assert status.region is not None
    placed = flight.fly(4.1, 5.0)
    assert placed.status.placed
    assert placed.status.origin is not None
    assert "No position" not in placed.status.text


def test_the_corridor_follows_the_mission_only_while_it_is_flown_and_as_high() -> None:
    flight = Flight("radar")
    flight.perceiver.on_plan(flights.mission())
    assert flight.fly(0.0, 2.0, mode="LOITER").status.corridor_m == 0.0
    assert flight.fly(2.0, 3.0, mode="AUTO").status.corridor_m > 10.0
    assert flight.fly(3.0, 4.0, mode="GUIDED").status.corridor_m == 0.0
    flight.perceiver.flown.flight = FlightStatus(way="guided", phase="flying")
    assert flight.fly(4.0, 5.0, mode="GUIDED").status.corridor_m > 10.0
    assert flight.perceiver.flown.points_enu is not None
    flat = flight.perceiver.flown.points_enu.copy()
    flight.perceiver.flown.avoidance = AvoidanceStatus(True, "offset", height_offset_m=6.2)
    flight.fly(5.0, 5.5, mode="GUIDED")
    np.testing.assert_allclose(flight.perceiver.flown.points_enu - flat, [[0.0, 0.0, 6.0]] * len(flat))


def test_states_count_in_the_order_of_their_times_whenever_they_come() -> None:
    one, other = Flight("radar"), Flight("radar")
    one.fly(0.0, 2.0)
    for k in range(40):
        if k % 2 == 0:
            for early in (k + 1, k):
                other.state(early / 20)
            other.frame(k / 20)
    assert set(map(tuple, one.perceiver.perception.map.occupied_keys())) == set(
        map(tuple, other.perceiver.perception.map.occupied_keys())
    )


def test_each_sensor_knows_its_topics() -> None:
    assert len({kind.frames for kind in (RADAR, VISION, RANGES)}) == 3
    assert len({kind.maps for kind in (RADAR, VISION, RANGES)}) == 3
