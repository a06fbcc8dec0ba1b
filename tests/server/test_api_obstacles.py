"""The doors to obstacles: closed to strangers and observers, open to the one in charge, exact about what they take."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from server.schemas import PerceptionSettingsBody, PlanWithSeen, SectionAsked, SetAvoidanceBody
from tests.server.running import PASSWORD, Running

CHANGES: list[tuple[str, str, dict[str, Any]]] = [
    ("post", "/api/obstacles/acknowledge", {}),
    ("put", "/api/obstacles/avoidance", {"enabled": True}),
    ("put", "/api/obstacles/settings", {"radar_depth_m": 20.0}),
    ("post", "/api/obstacles/clear", {}),
    ("post", "/api/obstacles/manoeuvre/over-radar-1/fly", {}),
    ("put", "/api/obstacles/seen", {"seen": True}),
]


@pytest.fixture
def pilot(served: Running) -> Iterator[httpx.Client]:
    served.http.post("/api/lease/take")
    served.flying.asked.clear()
    yield served.http
    served.http.post("/api/lease/release")


def ask(client: httpx.Client, change: tuple[str, str, dict[str, Any]]) -> httpx.Response:
    method, path, body = change
    return client.request(method, path, json=body)


@pytest.mark.parametrize("change", CHANGES, ids=[path for _, path, _ in CHANGES])
def test_strangers_and_observers_change_nothing(
    served: Running, pilot: httpx.Client, change: tuple[str, str, dict[str, Any]]
) -> None:
    del pilot
    with served.stranger(headers={"Origin": served.origin}) as other:
        assert ask(other, change).status_code == 401
        assert other.post("/api/session", json={"password": PASSWORD}).status_code == 204
        refused = ask(other, change)
        assert (refused.status_code, refused.json()["code"]) == (403, "not_in_charge")
    assert served.flying.asked == []


@pytest.mark.parametrize("change", CHANGES, ids=[path for _, path, _ in CHANGES])
def test_the_one_in_charge_is_heard(
    served: Running, pilot: httpx.Client, change: tuple[str, str, dict[str, Any]]
) -> None:
    assert ask(pilot, change).is_success
    name, *arguments = served.flying.asked[0]
    bodies = {
        "acknowledge": None,
        "set_avoidance": SetAvoidanceBody(enabled=True),
        "change_settings": PerceptionSettingsBody(radar_depth_m=20.0),
        "plan_with_seen": PlanWithSeen(seen=True),
        "fly": "over-radar-1",
    }
    assert name == "clear" or arguments[-1] == bodies[name]


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("settings", {"radar_depth_m": 1.0}),
        ("settings", {"fov_deg": 500}),
        ("settings", {"memory_limit_bytes": 999_999}),
        ("settings", {"radar_resolution_m": 0.01}),
        ("settings", {"vision_resolution_m": 6}),
        ("settings", {"vehicle_radius_m": 0}),
        ("settings", {"position_error_m": -0.1}),
        ("settings", {"brake_m_s2": 2.5}),
        ("settings", {"radar_variant": "upside_down"}),
        ("settings", {"radar_azimuth_deg": 90}),
        ("settings", {"radar_high_deg": 60}),
        ("settings", {"climb_m_s": 0}),
        ("settings", {"cloud_voxel_m": 3}),
        ("settings", {"climb_ceiling_m": 500}),
        ("avoidance", {}),
        ("seen", {"seen": True, "sensors": ["sonar"]}),
    ],
)
def test_what_makes_no_sense_is_refused(served: Running, pilot: httpx.Client, path: str, body: dict[str, Any]) -> None:
    assert pilot.put(f"/api/obstacles/{path}", json=body).status_code == 422
    assert served.flying.asked == []


@pytest.mark.parametrize(
    "body",
    [
        {"memory_limit_bytes": 20_000_000},
        {"radar_resolution_m": 0.5, "vision_resolution_m": 0.25},
        {"vehicle_radius_m": 1.2, "position_error_m": 0.0},
        {"radar_azimuth_deg": 30, "radar_low_deg": -5, "radar_high_deg": 25},
        {"climb_m_s": 2.5, "climb_ceiling_m": 15},
        {"cloud_voxel_m": 0.25},
    ],
)
def test_the_maps_the_gate_and_the_climb_can_be_set(served: Running, pilot: httpx.Client, body: dict[str, Any]) -> None:
    assert pilot.put("/api/obstacles/settings", json=body).is_success
    assert served.flying.asked == [("change_settings", PerceptionSettingsBody(**body))]


def test_slices_and_targets_are_for_everybody_who_is_signed_in(served: Running) -> None:
    served.flying.asked.clear()
    asked = {"source": "replay", "across": True, "thickness_m": 2, "reach_m": 30}
    answer = served.http.get("/api/obstacles/section", params=asked)
    assert answer.json()["text"] == "No sensor tells where the vehicle is."
    assert served.http.get("/api/obstacles/targets").json()["t_mono_s"] is None
    assert served.flying.asked == [("section", SectionAsked.model_validate(asked)), ("targets", "live")]
    for wrong in ({"thickness_m": 0}, {"reach_m": 1e9}, {"thickness_m": "nan"}, {"source": "dream"}):
        assert served.http.get("/api/obstacles/section", params=wrong).status_code == 422
    with served.stranger() as other:
        assert other.get("/api/obstacles/section").status_code == 401
        assert other.get("/api/obstacles/targets").status_code == 401


def test_a_map_is_a_file_by_its_sensor_and_kind(served: Running) -> None:
    answer = served.http.get("/api/obstacles/map/radar.geojson", params={"source": "replay"})
    assert answer.headers["content-type"] == "application/geo+json"
    assert 'filename="radar-map.geojson"' in answer.headers["content-disposition"]
    assert served.flying.asked[-1] == ("exported", "replay", "radar", "geojson")
    whole = served.http.get("/api/obstacles/map/vision_flight.ply")
    assert 'filename="vision-flight-map.ply"' in whole.headers["content-disposition"]
    for path in ("sonar.ply", "radar.exe", "radar"):
        assert served.http.get(f"/api/obstacles/map/{path}").status_code in (404, 422)
    with served.stranger() as other:
        assert other.get("/api/obstacles/map/radar.ply").status_code == 401
