"""Flight logs made by hand, for tests of what is made of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import Home, Mission, MissionItem
from planning.terrain.dsm import Dsm
from telemetry.recording.recorded_flight import FlightLog, HomePosition, track_of
from telemetry.topics.messages import VehicleText
from telemetry.topics.vehicle import VehicleState

START_UTC_S = 1_800_000_000.0


def plain(*, home_alt_m: float = 100.0, sha256: str = "a" * 64) -> Dsm:
    """300 x 300 m of level ground with one tower of 8 m."""
    cells = np.full((300, 300), home_alt_m, dtype=np.float32)
    cells[148:152, 198:202] += 8.0
    return Dsm(cells, Affine(1.0, 0.0, 500_000.0, 0.0, -1.0, 4_500_300.0), CRS.from_epsg(32633), None, sha256)


PLAIN = plain()
CORNER_M = np.array([500_000.0, 4_500_000.0])


def degrees(points_m: list[tuple[float, float]]) -> np.ndarray:
    """(N, 2) latitude and longitude of metres from the model's south-west corner."""
    return PLAIN.lat_lon_from_xy(np.reshape(points_m, (-1, 2)) + CORNER_M)


def mission(points: list[tuple[float, float, float]], *, home: tuple[float, float] = (50.0, 150.0)) -> Mission:
    """Take-off, waypoints (metres east and north of the corner, metres above home) and return."""
    at = degrees([home, *((x, y) for x, y, _ in points)])
    up = MissionItem(22, 3, lat_deg=float(at[0, 0]), lon_deg=float(at[0, 1]), alt_m=points[0][2])
    legs = [
        MissionItem(16, 3, lat_deg=float(lat), lon_deg=float(lon), alt_m=alt)
        for (lat, lon), (_, _, alt) in zip(at[1:], points, strict=True)
    ]
    return Mission(Home(float(at[0, 0]), float(at[0, 1]), 100.0), (up, *legs, MissionItem(20, 2)))


ROUTE = [(50.0, 150.0, 20.0), (150.0, 150.0, 20.0), (250.0, 150.0, 20.0)]


def positions(speed_m_s: float = 4.0, *, rate_hz: float = 5.0) -> list[tuple[float, float, float]]:
    """Up over home, along ``ROUTE``, back at 30 m and down."""
    step = speed_m_s / rate_hz
    up = [(50.0, 150.0, float(z)) for z in np.arange(0.0, 20.0, 0.4)]
    along = [(float(x), 150.0, 20.0) for x in np.arange(50.0, 250.0 + step, step)]
    climb = [(250.0, 150.0, float(z)) for z in np.arange(20.4, 30.0, 0.4)]
    back = [(float(x), 150.0, 30.0) for x in np.arange(250.0, 50.0, -step)]
    down = [(50.0, 150.0, float(z)) for z in np.arange(30.0, 0.0, -0.4)]
    return [*up, *along, *climb, *back, *down]


def log_of(
    places: list[tuple[float, float, float]],
    *,
    flown: Mission | None = None,
    rate_hz: float = 5.0,
    home: tuple[float, float] = (50.0, 150.0),
) -> FlightLog:
    """A log of positions (metres east and north of the corner, metres above home), armed and in AUTO throughout."""
    home_lat, home_lon = (float(v) for v in degrees([home])[0])
    at = degrees([(x, y) for x, y, _ in places])
    base = VehicleState(
        1, 1, autopilot="ardupilot", mode="AUTO", armed=True, home_lat_deg=home_lat, home_lon_deg=home_lon
    )
    states = tuple(
        (START_UTC_S + k / rate_hz, replace(base, lat_deg=float(lat), lon_deg=float(lon), alt_rel_home_m=z))
        for k, ((lat, lon), (_, _, z)) in enumerate(zip(at, places, strict=True))
    )
    return FlightLog(
        kind="hedgehop",
        name="made.mcap",
        start_utc_s=START_UTC_S,
        end_utc_s=START_UTC_S + len(places) / rate_hz,
        states=states,
        track=track_of(states),
        truth=None,
        texts=(VehicleText(START_UTC_S + 1.0, 4, "Wind is strong"),),
        modes=((START_UTC_S, "AUTO"),),
        armed=((START_UTC_S, True),),
        reached=(),
        targets=(),
        commands=(),
        vehicle=states[-1][1] if states else base,
        home=HomePosition(home_lat, home_lon, math.nan),
        mission=flown,
        plan=None,
        faults=(),
    )
