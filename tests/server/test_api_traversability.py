"""The doors to traversability: closed to strangers, open to whoever is signed in, exact about what they take."""

from __future__ import annotations

import math
from typing import Any

import httpx
import pytest

from mapping.uwb.uwb_params import UwbParams
from server.schemas import JobDoc, TraversabilityState
from tests.server.running import Running

PATH = "/api/traversability"
RAW = {"Content-Type": "application/octet-stream"}
ASKED: list[tuple[str, str, dict[str, Any]]] = [
    ("post", "", {"json": {}}),
    ("post", "/uwb", {"params": {"name": "a.npz"}, "content": b"PK", "headers": RAW}),
    ("post", "/sites", {"json": {"lat_deg": 1.0, "lon_deg": 2.0}}),
    ("get", "/map/before.tif", {}),
    ("delete", "", {}),
]


@pytest.mark.parametrize(("method", "path", "options"), ASKED, ids=[f"{m} {p}" for m, p, _ in ASKED])
def test_strangers_are_refused(served: Running, method: str, path: str, options: dict[str, Any]) -> None:
    with served.stranger(headers={"Origin": served.origin}) as other:
        assert other.request(method, PATH + path, **options).status_code == 401


@pytest.mark.parametrize(("method", "path", "options"), ASKED, ids=[f"{m} {p}" for m, p, _ in ASKED])
def test_nobody_needs_to_be_in_charge(served: Running, method: str, path: str, options: dict[str, Any]) -> None:
    assert served.http.request(method, PATH + path, **options).is_success


def test_it_is_worked_out_as_finely_as_was_asked_for(served: Running) -> None:
    answer = served.http.post(PATH, json={"resolution_m": 0.5})
    assert answer.status_code == 202
    assert JobDoc.model_validate_json(answer.text).label == "Traversability"
    assert served.workspace.calls[-1] == "work out 0.5"


def test_a_log_arrives_as_it_is_under_a_plain_name(served: Running) -> None:
    answer = served.http.post(f"{PATH}/uwb", params={"name": "../trial a.npz"}, content=b"PK\x03\x04", headers=RAW)
    assert (answer.status_code, answer.json()["label"]) == (202, "Reading trial a.npz")
    assert served.workspace.traversability.uploads["trial a.npz"] == b"PK\x03\x04"
    assert served.http.post(f"{PATH}/uwb", params={"name": "a.npz"}, content=b"", headers=RAW).status_code == 422
    assert served.http.post(f"{PATH}/uwb", content=b"PK", headers=RAW).status_code == 422


def test_how_a_log_is_fused_is_asked_with_it(served: Running) -> None:
    def sent(**query: object) -> httpx.Response:
        params = {"name": "a.npz", **{key: str(value) for key, value in query.items()}}
        return served.http.post(f"{PATH}/uwb", params=params, content=b"PK\x03\x04", headers=RAW)

    assert sent(rule="paper", p_o=0.7, p_c2=0.1).is_success
    fused = served.workspace.traversability.uwb_params
    assert fused == UwbParams(explained_apart_m=math.inf, most_occupied=0.7, free_before=0.1, free_behind=0.2)
    assert sent().is_success
    assert served.workspace.traversability.uwb_params == UwbParams()
    for query in ({"rule": "best"}, {"p_o": 0.2}, {"p_c2": 0.4, "p_c3": 0.1}, {"nearest_m": 12}, {"p_o": "nan"}):
        assert sent(**query).status_code == 422, query


def test_sites_are_answered_at_once(served: Running) -> None:
    answer = served.http.post(f"{PATH}/sites", json={"lat_deg": 37.7, "lon_deg": 15.0, "rotor_span_m": 1.2})
    assert TraversabilityState.model_validate_json(answer.text).sites_near == (37.7, 15.0)


def test_a_layer_is_a_file(served: Running) -> None:
    answer = served.http.get(f"{PATH}/map/cleared.tif")
    assert answer.headers["content-type"] == "image/tiff"
    assert 'filename="traversability-cleared.tif"' in answer.headers["content-disposition"]
    assert served.http.get(f"{PATH}/map/probability.tif").status_code == 409


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("", {"resolution_m": 0.01}),
        ("", {"resolution": 1}),
        ("/sites", {"lat_deg": 91, "lon_deg": 0}),
        ("/sites", {"lat_deg": 1, "lon_deg": 0, "rotor_span_m": 0}),
        ("/sites", {"lat_deg": 1}),
    ],
)
def test_what_makes_no_sense_is_refused(served: Running, path: str, body: dict[str, Any]) -> None:
    assert served.http.post(PATH + path, json=body).status_code == 422


def test_there_are_four_layers_and_no_others(served: Running) -> None:
    for path in ("/map/slope.tif", "/map/before.exe", "/map/"):
        assert served.http.get(PATH + path).status_code in (404, 422)
