"""Two recorded flights of a real autopilot over real terrain, whose figures others have worked out."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pymavlink import mavutil

from planning.basics.plan_model import Mission, VehicleProfile
from planning.following.figures import judge
from planning.following.nearest import follow
from planning.following.reference import level_model, reference_line
from planning.following.surface_distance import SurfaceDistance
from planning.following.track import Track
from planning.formats.detect import read_mission
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm

RECORDED = VehicleProfile(
    "recorded", mean_speed_m_s=2.0, max_speed_m_s=3.0, max_climb_m_s=2.0, max_descent_m_s=1.5, rtl_height_m=70.0
)
LAST_TARGET = 30
MISSION_MODES = (3, 4)


@dataclass
class Log:
    """What the figures need of a log: (time, latitude, longitude, height) of the estimate and of the truth."""

    estimate: np.ndarray
    truth: np.ndarray
    reached: tuple[tuple[float, int], ...]
    spans: tuple[tuple[float, float], ...]


def read_log(path: Path) -> Log:
    estimate, truth, reached, modes = [], [], [], []
    log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    while (m := log.recv_match()) is not None:
        kind, t_s = m.get_type(), m._timestamp
        if kind == "GLOBAL_POSITION_INT" and m.lat:
            estimate.append((t_s, m.lat / 1e7, m.lon / 1e7, m.relative_alt / 1e3))
        elif kind == "SIM_STATE" and m.lat_int:
            truth.append((t_s, m.lat_int / 1e7, m.lon_int / 1e7, m.alt))
        elif kind == "MISSION_ITEM_REACHED":
            reached.append((t_s, m.seq - 1))
        elif kind == "HEARTBEAT" and m.get_srcSystem() == 1 and (not modes or modes[-1][1] != m.custom_mode):
            modes.append((t_s, m.custom_mode))
    log.close()
    ends = [t_s for t_s, _ in modes[1:]] + [np.inf]
    spans = tuple((t_s, end) for (t_s, mode), end in zip(modes, ends, strict=True) if mode in MISSION_MODES)
    return Log(np.array(estimate), np.array(truth), tuple(reached), spans)


@pytest.fixture(scope="module")
def folder(shared_data: Path) -> Path:
    return shared_data / "logs" / "arducopter"


@pytest.fixture(scope="module")
def surface(shared_data: Path) -> SurfaceDistance:
    return SurfaceDistance(read_dsm(shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif"))


@pytest.fixture(scope="module")
def mission(folder: Path) -> Mission:
    path = folder / "mission.waypoints"
    return read_mission(path.name, path.read_bytes())


@pytest.fixture(scope="module")
def auto(folder: Path) -> Log:
    return read_log(folder / "auto.tlog")


@pytest.fixture(scope="module")
def guided(folder: Path) -> Log:
    return read_log(folder / "guided.tlog")


def placed(rows: np.ndarray, dsm: Dsm, above_m: float) -> np.ndarray:
    return np.column_stack([dsm.xy_from_lat_lon(rows[:, 1:3]), rows[:, 3] + above_m])


AUTO = {
    "estimate": (2216, (0.08, 0.02, 0.05), (0.07, 0.01, 0.03), (-0.07, 0.07), (4.93, 4.92, 5.63)),
    "truth": (1108, (0.12, 0.03, 0.07), (0.16, 0.07, 0.13), (-0.05, 0.16), (4.99, 4.99, 5.71)),
}
GUIDED = {
    "estimate": (639, (0.16, 0.02, 0.03), (0.23, 0.09, 0.19), (-0.09, 0.23), (4.97, 4.97, 4.99)),
    "truth": (319, (0.17, 0.03, 0.05), (0.27, 0.12, 0.24), (-0.06, 0.27), (5.03, 5.03, 5.05)),
}


def check(figures, expected, *, exact_count: bool) -> None:
    count, cross_track, height, extremes, distances = expected
    assert figures is not None
    assert figures.positions == pytest.approx(count, abs=0 if exact_count else 20)
    spread = (figures.cross_track.max_m, figures.cross_track.mean_m, figures.cross_track.p95_m)
    assert spread == pytest.approx(cross_track, abs=0.05)
    above = (figures.height.max_m, figures.height.mean_m, figures.height.p95_m)
    assert above == pytest.approx(height, abs=0.05)
    assert (figures.height_lowest_m, figures.height_highest_m) == pytest.approx(extremes, abs=0.05)
    nearest = (figures.min_vertical_m, figures.nearest.distance_m, figures.nearest_on_way_home.distance_m)
    assert nearest == pytest.approx(distances, abs=0.05)


@pytest.mark.parametrize("kind", ["estimate", "truth"])
def test_auto(auto: Log, mission: Mission, surface: SurfaceDistance, kind: str) -> None:
    reference = reference_line(mission, surface.dsm, RECORDED, waypoint_radius_m=0.5)
    rows = auto.estimate if kind == "estimate" else auto.truth
    xyz_m = placed(rows, surface.dsm, reference.home_alt_dsm_m if kind == "estimate" else 0.0)
    figures = judge(reference, Track(rows[:, 0], xyz_m, auto.reached, auto.spans), surface).figures
    check(figures, AUTO[kind], exact_count=True)
    assert figures is not None
    assert figures.completed
    assert figures.flight_s == pytest.approx(221.6, abs=0.05)
    assert figures.predicted_s == pytest.approx(221.6, rel=0.1)
    assert figures.lag_s == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("kind", ["estimate", "truth"])
def test_guided(guided: Log, mission: Mission, surface: SurfaceDistance, kind: str) -> None:
    reference = reference_line(mission, surface.dsm, RECORDED).ending_at(LAST_TARGET)
    rows = guided.estimate if kind == "estimate" else guided.truth
    xyz_m = placed(rows, surface.dsm, reference.home_alt_dsm_m if kind == "estimate" else 0.0)
    figures = judge(reference, Track(rows[:, 0], xyz_m, (), guided.spans, one_by_one=True), surface).figures
    check(figures, GUIDED[kind], exact_count=False)
    assert figures is not None
    assert not figures.completed


def test_the_window_is_found_without_the_vehicles_word(auto: Log, mission: Mission, surface: SurfaceDistance) -> None:
    reference = reference_line(mission, surface.dsm, RECORDED)
    xyz_m = placed(auto.estimate, surface.dsm, reference.home_alt_dsm_m)
    figures = judge(reference, Track(auto.estimate[:, 0], xyz_m), surface).figures
    assert figures is not None
    assert figures.told_by == "geometry"
    assert figures.completed
    assert figures.flight_s == pytest.approx(221.6, abs=1.5)
    assert figures.cross_track.max_m == pytest.approx(0.08, abs=0.02)


def test_without_a_surface_model(auto: Log, mission: Mission) -> None:
    level = level_model(mission)
    reference = reference_line(mission, level, RECORDED)
    xyz_m = placed(auto.estimate, level, reference.home_alt_dsm_m)
    figures = judge(reference, Track(auto.estimate[:, 0], xyz_m, auto.reached, auto.spans), None).figures
    assert figures is not None
    assert figures.nearest is None
    assert figures.cross_track.max_m == pytest.approx(0.08, abs=0.02)
    assert figures.height.max_m == pytest.approx(0.07, abs=0.02)


def test_one_position_is_followed_in_no_time(mission: Mission, surface: SurfaceDistance) -> None:
    reference = reference_line(mission, surface.dsm, RECORDED)
    x, y, z = (float(v) for v in reference.points_m[40])
    follow(reference, (x, y, z))
    begin = time.perf_counter()
    for _ in range(500):
        follow(reference, (x, y, z), near_s_m=100.0)
    assert (time.perf_counter() - begin) / 500 < 0.02  # a hundredth of that when nothing else runs
