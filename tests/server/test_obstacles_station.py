"""The demo's flight through the doors: it sees a building, climbs over it, and what was seen is planned and exported.

Everything is real but the pilot: nodes, bus, simulated vehicle, radar and camera.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from server.schemas import FlyState, ObstaclesState
from server.work import supervisor
from telemetry.bus.node_lock import running_node, running_nodes
from tests.server.running import PASSWORD
from tests.server.station import PATIENCE_S, Station, ok, station

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

LONG_S = 4 * PATIENCE_S


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    folder = tmp_path_factory.mktemp("data")
    try:
        with pytest.MonkeyPatch.context() as patched:
            # So long a link that hangs is asked what it answers.
            patched.setattr(supervisor, "LINK_HUNG_S", 6.0)
            with station(folder, demo=True, flies=True, demo_world=True, password=PASSWORD) as made:
                yield made
    finally:
        # With an armed vehicle they outlive their server on purpose.
        for facts in running_nodes(folder / "run"):
            os.kill(facts.pid, signal.SIGKILL)


def checked_with_eyes(demo: Station) -> FlyState:
    """Sensors start on their own: until they see, a start would want to be accepted without."""
    give_up_s = time.monotonic() + LONG_S
    while True:
        checked = FlyState.model_validate_json(ok(demo.http.post("/api/flight/check")).text)
        assert checked.preflight is not None
        row = next(row for row in checked.preflight.rows if row.code == "avoidance")
        if row.state == "good":
            return checked
        assert time.monotonic() < give_up_s, row
        time.sleep(1.0)


@pytest.fixture(scope="module")
def flying(demo: Station) -> Station:
    """In the air, with avoidance on, towards the building."""
    demo.until(
        lambda m: m.type == "vehicle" and m.state is not None and m.state.ready_to_arm and m.state.estimator_ok, LONG_S
    )
    assert demo.answer().state == "ready"
    ok(demo.http.post("/api/flight/upload", json={"revision": demo.state.revision}))
    checked = checked_with_eyes(demo)
    ok(demo.http.post("/api/flight/start", json={"digest": checked.onboard.digest}))
    return demo


def obstacles(page: Station, wanted: Callable[[ObstaclesState], bool], source: str = "live") -> ObstaclesState:
    found = page.until(lambda m: m.type == "obstacles" and m.source == source and wanted(m.obstacles), LONG_S)
    return found.obstacles


def test_the_demo_sees_alerts_climbs_plans_and_exports(flying: Station) -> None:
    begun = flying.until(lambda m: m.type == "alert" and m.alert.phase == "begins", LONG_S)
    assert begun.source == "live"
    engaged = obstacles(flying, lambda state: state.avoidance.state in ("climbing", "offset"))
    assert engaged.avoidance.enabled
    assert engaged.alerts
    higher = obstacles(flying, lambda state: state.avoidance.state == "offset")
    assert higher.avoidance.height_offset_m > 2.0
    drawn = obstacles(flying, lambda state: any(m.sensor == "radar" and m.drawn > 100 for m in state.maps))
    assert sum(each.drawn for each in drawn.maps) <= 200_000

    acknowledged = ObstaclesState.model_validate_json(ok(flying.http.post("/api/obstacles/acknowledge", json={})).text)
    assert all(doc.acknowledged for doc in acknowledged.alerts)

    settings = ok(flying.http.put("/api/obstacles/settings", json={"radar_depth_m": 12.0})).json()["settings"]
    assert settings["radar_depth_m"] == 12.0
    flying.until(
        lambda m: m.type == "perception" and m.sensor == "radar" and m.status.region.depth_m == pytest.approx(12.0),
        LONG_S,
    )
    for kind, magic in (("ply", b"ply"), ("bt", b"# Octomap"), ("tif", b"II"), ("geojson", b"{")):
        assert ok(flying.http.get(f"/api/obstacles/map/radar.{kind}")).content.startswith(magic), kind
    assert flying.http.get("/api/obstacles/map/ranges.ply").status_code == 409


def test_what_was_seen_is_planned_against_and_taken_out_again(flying: Station) -> None:
    plain = flying.answer().result
    assert plain is not None
    ok(flying.http.put("/api/obstacles/seen", json={"seen": True, "sensors": ["radar"]}))
    raised = flying.answer().result
    assert raised is not None
    assert raised.seen_columns > 20
    assert any("raised at" in warning for warning in raised.warnings)
    top_m = max(h for h in raised.chart.ground_rel_home_m[: len(raised.chart.s_m) // 3] if h is not None)
    assert top_m > 3.0 + max(h for h in plain.chart.ground_rel_home_m[:20] if h is not None)
    certificate = ok(flying.http.get("/api/plan/export/certificate.json")).json()
    assert any("raised at" in warning for warning in certificate["warnings"])
    assert flying.state.can_undo
    ok(flying.http.post("/api/plan/undo"))
    back = flying.answer().result
    assert back is not None
    assert back.seen_columns == 0
    assert back.min_distance_m == pytest.approx(plain.min_distance_m)


def test_a_killed_radar_leaves_the_camera_and_comes_back_and_what_it_saw_counts(flying: Station) -> None:
    run = _runtime(flying)
    facts = running_node(run, "radar")
    assert facts is not None
    os.kill(facts.pid, signal.SIGKILL)
    seen: dict[str, Any] = {}

    def both(m: Any) -> bool:
        if m.type == "perception" and m.sensor == "vision" and m.status.state != "stale":
            seen["vision"] = m.status
        if m.type == "nodes" and any(n.name == "radar" and n.restarts for n in m.nodes):
            seen["restarted"] = True
        return len(seen) == 2

    flying.until(both, LONG_S)
    told = obstacles(flying, lambda state: any(each.alert.id.startswith("kept-radar") for each in state.alerts))
    kept = next(each for each in told.alerts if each.alert.id.startswith("kept-radar"))
    assert "what it had seen counts for ways, returns and plans" in kept.alert.text
    again = running_node(run, "radar")
    assert again is not None
    assert again.pid != facts.pid


def test_another_resolution_begins_the_radars_map_anew(flying: Station) -> None:
    flying.until(lambda m: m.type == "perception" and m.sensor == "radar" and m.status.frames > 0, LONG_S)
    refused = flying.http.put("/api/obstacles/settings", json={"radar_resolution_m": 0.05})
    assert (refused.status_code, refused.json()["where"]) == (422, "radar map")
    ok(flying.http.put("/api/obstacles/settings", json={"radar_resolution_m": 0.5}))
    flying.until(
        lambda m: m.type == "perception" and m.sensor == "radar" and "voxels of 0.5 m" in m.status.text, LONG_S
    )


def test_a_link_that_hangs_takes_avoidance_with_it_and_gives_it_back(flying: Station) -> None:
    facts = running_node(_runtime(flying), "link")
    assert facts is not None
    os.kill(facts.pid, signal.SIGSTOP)
    lost = obstacles(flying, lambda state: state.avoidance.state == "lost")
    assert any("transmitter" in each.alert.text for each in lost.alerts)
    flying.until(lambda m: m.type == "text" and "no command reaches the vehicle" in m.text.text, LONG_S)
    refused = flying.http.post("/api/flight/pause")
    assert refused.status_code == 503
    assert "The link does not answer" in refused.json()["what"] or "not running" in refused.json()["what"]
    flying.until(lambda m: m.type == "nodes" and any(n.name == "link" and n.restarts for n in m.nodes), LONG_S)
    back = obstacles(flying, lambda state: state.avoidance.state not in ("lost", "off"))
    assert back.avoidance.enabled
    again = running_node(_runtime(flying), "link")
    assert again is not None
    assert again.pid != facts.pid


def _runtime(page: Station) -> Path:
    return page.server.settings.data_dir / "run"
