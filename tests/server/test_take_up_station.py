"""A plan that is taken up in flight, through the doors: nodes, bus and simulated vehicle are real."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from server.schemas import FlyState, PlanDoc
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle
from tests.server.station import PATIENCE_S, Station, ok, station

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

LONG_S = 3 * PATIENCE_S
SPEEDUP = 12.0
PX4_QUICK = ("--parameter=MPC_LAND_SPEED=1.5", "--parameter=MPC_LAND_CRWL=1.0")
PX4 = {"firmware": "px4"}


@pytest.fixture(params=["ardupilot", "px4"])
def flying(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Station]:
    """The demo's plan is flown, and a third of it lies behind."""
    autopilot = request.param
    with station(tmp_path, flies=True) as page:
        ok(page.http.post("/api/terrains/demo"))
        document = page.state.document
        page.change(profile=document.profile.model_copy(update={"firmware": autopilot}).model_dump())
        answer = page.answer()
        assert answer.state == "ready"
        assert answer.result is not None
        home, height_m = document.pois[0], document.profile.rtl_height_m
        place = f"{home.lat_deg:.9f},{home.lon_deg:.9f},{answer.result.home_alt_dsm_m:.3f}"
        rtl = f"RTL_ALT={100 * height_m:.0f}" if autopilot == "ardupilot" else f"RTL_RETURN_ALT={height_m:.0f}"
        quick = QUICKLY_DOWN if autopilot == "ardupilot" else PX4_QUICK
        options = ("--autopilot", autopilot, "--speedup", SPEEDUP, "--parameter", rtl, *quick)
        with simulated_vehicle(place, *options) as address:
            ok(page.http.post("/api/link/connect", json={"address": address}))
            page.until(lambda m: m.type == "vehicle" and _is_ready(m.state), LONG_S)
            start(page)
            page.until(lambda m: m.type == "vehicle" and m.follow is not None and (m.follow.s_m or 0) > 60, LONG_S)
            yield page
            ok(page.http.post("/api/link/disconnect", json={"address": address}))


def _is_ready(state: Any) -> bool:
    return state is not None and bool(state.ready_to_arm and state.estimator_ok) and state.home_lat_deg is not None


def start(page: Station) -> None:
    ok(page.http.post("/api/flight/upload", json={"revision": page.state.revision}))
    checked = FlyState.model_validate_json(ok(page.http.post("/api/flight/check")).text)
    assert checked.preflight is not None
    assert [row.text for row in checked.preflight.rows if row.state in ("bad", "unknown")] == []
    accept = [row.code for row in checked.preflight.rows if row.state == "accept"]
    ok(page.http.post("/api/flight/start", json={"digest": checked.onboard.digest, "accept": accept}))


def take_up(page: Station, **more: Any) -> httpx.Response:
    return page.http.post("/api/flight/take_up", json={"revision": page.state.revision, **more})


def with_a_detour(document: PlanDoc) -> dict[str, Any]:
    """The last point is left out, and the one before it lies 12 m farther east."""
    pois = [poi.model_dump() for poi in document.pois[:-1]]
    pois[-1]["lon_deg"] += 12.0 / 85_000
    return {"pois": pois}


def test_the_new_plan_is_flown_from_where_the_vehicle_holds(flying: Station) -> None:
    page = flying
    ok(page.http.post("/api/flight/pause"))  # however long a busy machine plans, it is in the air then
    page.until(lambda m: m.type == "flight" and m.flight.phase == "paused", LONG_S)
    old = page.state.document
    page.change(**with_a_detour(old))
    assert page.answer().state == "ready"

    stale = page.http.post("/api/flight/take_up", json={"revision": page.state.revision - 1})
    assert (stale.status_code, stale.json()["code"]) == (409, "stale"), stale.text
    assert "mission before is still on board" in stale.json()["advice"]

    taken = FlyState.model_validate_json(ok(take_up(page)).text)
    assert taken.taken_up is not None
    assert taken.onboard.is_open_plan
    assert taken.onboard.taken_up
    assert taken.taken_up.clearance_m >= taken.taken_up.required_m > 1.0
    assert taken.taken_up.item > 2, "what was flown is not flown again"
    assert taken.taken_up.battery.state == "good"
    assert taken.taken_up.way_m < 60.0

    ok(page.http.post("/api/flight/resume"))
    page.until(lambda m: m.type == "flight" and m.flight.phase == "flying", LONG_S)
    on_line = page.until(lambda m: m.type == "vehicle" and m.follow is not None and (m.follow.s_m or 0) > 20, LONG_S)
    assert on_line.follow.distance_to_dsm_m > taken.taken_up.required_m - 1.0
    assert abs(on_line.follow.cross_track_m) < 3.0
    page.until(lambda m: m.type == "flight" and m.flight.phase == "returning", LONG_S)
    page.until(lambda m: m.type == "vehicle" and m.state is not None and not m.state.armed, LONG_S)
    refused = FlyState.model_validate_json(ok(page.http.post("/api/flight/check")).text)
    assert refused.preflight is not None
    assert not refused.preflight.ok, "it begins in the air: from the ground it is not certified"
