"""The live vehicle against what its plan requires: the smallest distance of a flight stays in sight."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planning.basics.mav_cmd import MavCmd
from planning.following.below import Demanded
from planning.following.reference import reference_line
from planning.missions.vehicle_profile import load_profile
from server.heard.plan_follower import Followed, Follower
from server.schemas import FollowDoc
from telemetry.topics.messages import FlightStatus
from telemetry.topics.vehicle import VehicleState
from tests.server.flight_logs import PLAIN, ROUTE, degrees, mission

ROOT = Path(__file__).resolve().parents[2]
FLYING = FlightStatus(phase="flying")
FLOWN = mission(ROUTE)


def at(x_m: float, z_m: float, *, t_s: float) -> VehicleState:
    home_lat, home_lon = (float(v) for v in degrees([(50.0, 150.0)])[0])
    lat, lon = (float(v) for v in degrees([(x_m, 150.0)])[0])
    return VehicleState(
        1,
        1,
        autopilot="ardupilot",
        mode="AUTO",
        armed=True,
        lat_deg=lat,
        lon_deg=lon,
        alt_rel_home_m=z_m,
        home_lat_deg=home_lat,
        home_lon_deg=home_lon,
        t_utc_s=t_s,
    )


def follower() -> Follower:
    followed = Followed.over(reference_line(FLOWN, PLAIN, load_profile("generic-quad")), PLAIN)
    return Follower(replace(followed, demanded=Demanded(6.0, 1.1)))


def told(doc: FollowDoc | None) -> tuple[float | None, float | None]:
    assert doc is not None
    return doc.required_distance_m, None if doc.least_distance_m is None else round(doc.least_distance_m, 2)


def test_the_smallest_distance_of_a_flight_stays_until_the_next() -> None:
    live = follower()
    assert told(live.follow(at(50.0, 0.0, t_s=0.0), FlightStatus(phase="taking_off"))) == (6.0, None)
    places = [(50.0, 20.0), (100.0, 20.0), (200.0, 13.0), (240.0, 20.0)]
    docs = [live.follow(at(x_m, z_m, t_s=10.0 + 10 * k), FLYING) for k, (x_m, z_m) in enumerate(places)]
    assert [told(doc)[1] for doc in docs] == [20.0, 20.0, 5.0, 5.0]
    # On the way down it is near the ground as it must be.
    assert told(live.follow(at(50.0, 0.2, t_s=90.0), FlightStatus(phase="returning"))) == (6.0, 5.0)
    assert told(live.follow(at(50.0, 0.0, t_s=99.0), FlightStatus(phase="landed"))) == (6.0, 5.0)
    live.begin_again()
    assert told(live.follow(at(50.0, 0.0, t_s=200.0), FlightStatus(phase="idle"))) == (6.0, None)


def test_what_is_left_of_the_plan_is_told_in_time_and_only_while_it_is_flown() -> None:
    live = follower()
    assert live.ahead(FLYING) is None
    left_s = []
    for k, x_m in enumerate((50.0, 100.0, 200.0)):
        live.follow(at(x_m, 20.0, t_s=10.0 * k), FLYING)
        ahead = live.ahead(FLYING)
        assert ahead is not None
        assert len(ahead.lat_lon_deg) == len(ahead.alt_rel_home_m) == len(ahead.t_s)
        assert ahead.t_s[0] >= 0.0
        assert (np.diff(ahead.t_s) >= 0.0).all()
        left_s.append(float(ahead.t_s[-1]))
    assert left_s == sorted(left_s, reverse=True)
    assert left_s[0] > left_s[-1]
    assert live.ahead(FlightStatus(phase="returning")) is None


def test_the_whole_way_leads_up_along_the_line_and_home_at_the_return_height() -> None:
    profile = load_profile("generic-quad")
    reference = reference_line(FLOWN, PLAIN, profile)
    followed = replace(Followed.over(reference, PLAIN), profile=profile)
    whole = Follower(followed).whole()
    assert whole is not None
    up_m, count = whole.alt_rel_home_m, len(reference.points_m)
    assert up_m[0] == up_m[-1] == 0.0
    assert list(whole.lat_lon_deg[0]) == list(whole.lat_lon_deg[-1])
    np.testing.assert_allclose(up_m[1 : 2 * count : 2], reference.points_m[:, 2] - reference.home_alt_dsm_m)
    np.testing.assert_allclose(up_m[-3:-1], max(profile.rtl_height_m, up_m[-4]))
    np.testing.assert_allclose(whole.lat_lon_deg[-3], whole.lat_lon_deg[-4])
    assert whole.t_s is not None
    assert len(whole.t_s) == len(up_m) - 3
    assert whole.t_s[0] == 0.0
    assert (np.diff(whole.t_s) >= 0.0).all()
    assert whole.t_s[-1] == max(reference.leave_s)
    assert Follower(replace(followed, profile=None)).whole() is None
    assert Follower(over=PLAIN).whole() is None


def test_one_that_was_taken_up_in_flight_begins_where_it_holds_and_now() -> None:
    profile = load_profile("generic-quad")
    items = tuple(item for item in FLOWN.items if item.command != MavCmd.NAV_TAKEOFF)
    reference = reference_line(replace(FLOWN, items=items), PLAIN, profile, begins_in_air=True)
    followed = replace(Followed.over(reference, PLAIN), profile=profile, begins_in_air=True)
    whole = Follower(followed).whole()
    assert whole is not None
    assert whole.t_s is not None
    count = len(reference.points_m)
    assert (len(whole.t_s), len(whole.alt_rel_home_m), whole.takeoff_s) == (2 * count, 2 * count + 3, 0.0)
    assert whole.alt_rel_home_m[0] == reference.points_m[0, 2] - reference.home_alt_dsm_m
    assert whole.t_s[0] == 0.0
    assert whole.t_s[-1] == pytest.approx(reference.flight_s)


_FIRST_POSITIONS = """
from numba.core.dispatcher import Dispatcher
from planning.certificate import nearest as certificate
from planning.following import nearest as following
from tests.server.test_flying_following import FLYING, at, follower

def loaded():
    kernels = [each for module in (certificate, following) for each in vars(module).values()]
    return sum(len(each.signatures) for each in kernels if isinstance(each, Dispatcher))

live = follower()
before = loaded()
for k in range(4):
    live.follow(at(50.0 + 40 * k, 20.0, t_s=10.0 * k), FLYING)
print(before, loaded())
"""


def test_the_first_positions_load_no_kernel_on_the_event_loop() -> None:
    """In a process of its own: kernels that another test has loaded stay."""
    ran = subprocess.run(
        [sys.executable, "-c", _FIRST_POSITIONS], capture_output=True, text=True, check=True, cwd=ROOT, timeout=120
    )
    before, after = map(int, ran.stdout.split())
    assert before == after > 0
