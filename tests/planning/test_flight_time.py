"""Predicted durations, against a recorded flight of the real ArduCopter."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from pymavlink import mavutil
from pyproj import CRS

from planning.basics.plan_model import Home, Mission, MissionItem, VehicleProfile
from planning.errors import MissionError
from planning.flight_time.predict import predict_duration
from planning.terrain.dsm import Dsm

# The parameters that the recorded flight set; the rest were the autopilot's defaults, and so are the profile's.
RECORDED = VehicleProfile(
    "recorded", mean_speed_m_s=2.0, max_speed_m_s=3.0, max_climb_m_s=2.0, max_descent_m_s=1.5, rtl_height_m=70.0
)
RECORDED_RADIUS_M = 0.5
LEVEL = Dsm(
    np.zeros((10, 10), dtype=np.float32), Affine(1, 0, 500_000, 0, -1, 5_000_010), CRS.from_epsg(32633), None, "0"
)
NEW_ZEALAND = Dsm(
    np.zeros((2, 2), dtype=np.float32), Affine(1, 0, 1_826_000, 0, -1, 5_888_000), CRS.from_epsg(2193), None, "0"
)


@pytest.fixture(scope="module")
def recorded_mission(shared_data: Path) -> Mission:
    lines = (shared_data / "logs" / "arducopter" / "mission.waypoints").read_text().splitlines()[1:]
    rows = [[float(field) for field in line.split("\t")] for line in lines]
    items = [
        MissionItem(int(r[3]), int(r[2]), (r[4], r[5], r[6], r[7]), r[8], r[9], r[10], bool(r[11])) for r in rows[1:]
    ]
    return Mission(Home(rows[0][8], rows[0][9], rows[0][10]), tuple(items))


@pytest.fixture(scope="module")
def reached_s(shared_data: Path) -> dict[int, float]:
    """Seconds at which the recorded vehicle reported each item reached."""
    log = mavutil.mavlink_connection(
        str(shared_data / "logs" / "arducopter" / "auto.tlog"), dialect="ardupilotmega", notimestamps=False
    )
    reached = {}
    while (message := log.recv_match(type="MISSION_ITEM_REACHED")) is not None:
        reached[message.seq] = message._timestamp
    log.close()
    return reached


def test_the_recorded_flight_is_predicted_within_a_percent(
    recorded_mission: Mission, reached_s: dict[int, float]
) -> None:
    predicted = predict_duration(recorded_mission, RECORDED, NEW_ZEALAND, waypoint_radius_m=RECORDED_RADIUS_M)
    flown_s = reached_s[86] - reached_s[2]
    assert flown_s == pytest.approx(221.6, abs=0.1)
    assert predicted.flight_s == pytest.approx(flown_s, rel=0.01)
    assert predicted.flight_s == pytest.approx(predicted.per_leg_s.sum())


def test_each_leg_of_the_recorded_flight_is_predicted(recorded_mission: Mission, reached_s: dict[int, float]) -> None:
    predicted = predict_duration(recorded_mission, RECORDED, NEW_ZEALAND, waypoint_radius_m=RECORDED_RADIUS_M)
    flown_s = np.diff([reached_s[seq] for seq in range(2, 87)])
    error_s = np.abs(predicted.per_leg_s - flown_s)
    assert np.median(error_s) < 0.03
    assert error_s.max() < 0.45
    assert np.median(predicted.per_leg_s) == pytest.approx(2.43, abs=0.05)


def test_the_recorded_way_home_is_predicted(recorded_mission: Mission, reached_s: dict[int, float]) -> None:
    predicted = predict_duration(recorded_mission, RECORDED, NEW_ZEALAND)
    assert predicted.return_s == pytest.approx(reached_s[87] - reached_s[86], rel=0.05)


def waypoints(points: list[tuple[float, float, float]], *, hold_s: float = 0.0, firmware: str = "ardupilot") -> Mission:
    """A mission over points in metres east, north and above home; home is the first one's place."""
    xyz = np.array(points)
    degrees = LEVEL.lat_lon_from_xy(xyz[:, :2] + [500_005, 5_000_005])
    items = [MissionItem(22, 3, lat_deg=degrees[0, 0], lon_deg=degrees[0, 1], alt_m=points[0][2])]
    items += [
        MissionItem(16, 3, (hold_s, 0, 0, 0), float(lat), float(lon), float(z))
        for (lat, lon), z in zip(degrees, xyz[:, 2], strict=True)
    ]
    home = Home(float(degrees[0, 0]), float(degrees[0, 1]), 0.0)
    return Mission(home, (*items, MissionItem(20, 2)), firmware=firmware)  # type: ignore[arg-type]


PROFILE = VehicleProfile("a", mean_speed_m_s=4.0, max_speed_m_s=6.0)


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_long_leg_takes_its_length_over_the_speed_and_a_little(firmware: str) -> None:
    predicted = predict_duration(waypoints([(0, 0, 10), (1200, 0, 10)], firmware=firmware), PROFILE, LEVEL)
    assert 200 < predicted.flight_s < 210
    assert predicted.total_s == pytest.approx(predicted.takeoff_s + predicted.flight_s + predicted.return_s)


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_dense_waypoints_slow_the_vehicle_and_holds_stop_it(firmware: str) -> None:
    sparse = [(x, 0.0, 10.0) for x in np.linspace(0, 300, 4)]
    dense = [(x, 0.0, 10.0) for x in np.linspace(0, 300, 121)]
    few = predict_duration(waypoints(sparse, firmware=firmware), PROFILE, LEVEL).flight_s
    many = predict_duration(waypoints(dense, firmware=firmware), PROFILE, LEVEL).flight_s
    held = predict_duration(waypoints(sparse, hold_s=2.0, firmware=firmware), PROFILE, LEVEL).flight_s
    assert many > 3 * few if firmware == "ardupilot" else many == pytest.approx(few, rel=0.05)
    assert held > few + 6


def test_a_set_speed_holds_for_what_follows_it() -> None:
    mission = waypoints([(0, 0, 10), (600, 0, 10), (1200, 0, 10)])
    slow = MissionItem(178, 2, (1.0, 2.0, -1.0, 0.0))
    items = mission.items
    changed = replace(mission, items=(*items[:3], slow, *items[3:]))
    first, second = predict_duration(changed, PROFILE, LEVEL).per_leg_s
    assert first == pytest.approx(100, abs=6)
    assert second == pytest.approx(300, abs=6)


def test_altitudes_above_sea_level_are_taken_from_home() -> None:
    mission = waypoints([(0, 0, 10), (100, 0, 20)])
    home = replace(mission.home, alt_dsm_m=400.0)
    absolute = tuple(replace(i, frame=0, alt_m=i.alt_m + 400.0) if i.frame == 3 else i for i in mission.items)
    relative = predict_duration(mission, PROFILE, LEVEL)
    assert predict_duration(replace(mission, home=home, items=absolute), PROFILE, LEVEL).total_s == pytest.approx(
        relative.total_s
    )


def test_a_landing_at_home_counts_as_the_return() -> None:
    mission = waypoints([(0, 0, 10), (100, 0, 10), (100, 0, 30), (0, 0, 30)])
    landing = replace(mission.items[0], command=21, alt_m=0.0)
    predicted = predict_duration(replace(mission, items=(*mission.items[:-1], landing)), PROFILE, LEVEL)
    assert len(predicted.per_leg_s) == 1
    assert predicted.return_s > 100 / 6 + 10 / 0.5


def test_what_cannot_be_predicted_is_refused() -> None:
    mission = waypoints([(0, 0, 10), (100, 0, 10)])
    terrain = tuple(replace(item, frame=10) for item in mission.items)
    with pytest.raises(MissionError, match="frame 10"):
        predict_duration(replace(mission, items=terrain), PROFILE, LEVEL)
    with pytest.raises(MissionError, match="no waypoint"):
        predict_duration(replace(mission, items=mission.items[-1:]), PROFILE, LEVEL)


def test_the_reserve_is_not_flown() -> None:
    assert replace(PROFILE, endurance_s=1000.0, reserve_share=0.25).usable_endurance_s == 750
