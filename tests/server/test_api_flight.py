"""The doors to the vehicle: closed to strangers and observers, open to the one in charge; words for every refusal."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator

import httpx
import pytest

from server.schemas import LeaseDoc
from telemetry.errors import (
    AddressError,
    BusError,
    ConnectionFailedError,
    NoVehicleError,
    RecordingError,
    RecordingFullError,
    RefusedError,
    SilentError,
    TelemetryError,
    TransferError,
)
from telemetry.topics.requests import Arm, Land, Operator, Pause, ReturnHome, StopMotors
from tests.server.running import PASSWORD, Running

COMMANDS: list[tuple[str, dict[str, object]]] = [
    ("/api/link/connect", {"address": "udpin:0.0.0.0:14550"}),
    ("/api/link/disconnect", {"address": "udpin:0.0.0.0:14550"}),
    ("/api/link/adopt", {"candidate": "udpin:0.0.0.0:14550/10.0.0.9:14550/1/1"}),
    ("/api/link/signing", {"enabled": True}),
    ("/api/link/release", {}),
    ("/api/link/simulator", {}),
    ("/api/flight/upload", {"revision": 1}),
    ("/api/flight/check", {}),
    ("/api/flight/start", {"digest": "abc"}),
    ("/api/flight/arm", {}),
    ("/api/flight/disarm", {}),
    ("/api/flight/pause", {}),
    ("/api/flight/resume", {}),
    ("/api/flight/return", {}),
    ("/api/flight/land", {}),
    ("/api/parameters/write", {"changes": [{"name": "RTL_ALT", "value": 1500}]}),
    ("/api/flight/emergency", {}),
    ("/api/recorder/start", {}),
    ("/api/recorder/stop", {}),
]
"""Everything that reaches a vehicle, its link, or the recording of its flight."""


@pytest.fixture
def pilot(served: Running) -> Iterator[httpx.Client]:
    """The one in charge."""
    taken = LeaseDoc.model_validate_json(served.http.post("/api/lease/take").text)
    assert taken == LeaseDoc(holder=served.name, mine=True)
    served.flying.asked.clear()
    yield served.http
    served.http.post("/api/lease/release")


@pytest.fixture
def observer(served: Running) -> Iterator[httpx.Client]:
    """Signed in as well, by password."""
    with served.stranger(headers={"Origin": served.origin}) as client:
        assert client.post("/api/session", json={"password": PASSWORD}).status_code == 204
        yield client
        client.delete("/api/session")


@pytest.mark.fact("A26")
@pytest.mark.parametrize(("path", "body"), COMMANDS)
def test_only_the_one_in_charge_commands(
    served: Running, pilot: httpx.Client, observer: httpx.Client, path: str, body: dict[str, object]
) -> None:
    with served.stranger(headers={"Origin": served.origin}) as stranger:
        assert stranger.post(path, json=body).status_code == 401
    refused = observer.post(path, json=body)
    assert (refused.status_code, refused.json()["code"]) == (403, "not_in_charge")
    assert f"{served.name} is in charge" in refused.json()["what"]
    assert served.flying.asked == []
    assert pilot.post(path, json=body).is_success
    assert len(served.flying.asked) == 1


def test_a_foreign_page_cannot_command(served: Running, pilot: httpx.Client) -> None:
    response = pilot.post("/api/flight/arm", headers={"Origin": "http://evil.example"})
    assert (response.status_code, served.flying.asked) == (403, [])


def test_commands_carry_name_and_token(served: Running, pilot: httpx.Client) -> None:
    for path in ("arm", "pause", "return", "land", "emergency"):
        assert pilot.post(f"/api/flight/{path}").status_code == 204
    requests = [asked[1] for asked in served.flying.asked]
    assert [type(request) for request in requests] == [Arm, Pause, ReturnHome, Land, StopMotors]
    operators: list[Operator] = [request.operator for request in requests]
    assert {operator.name for operator in operators} == {served.name}
    assert len({operator.token for operator in operators}) == 1


def test_control_changes_hands_with_consent(pilot: httpx.Client, observer: httpx.Client) -> None:
    asked = observer.post("/api/lease/take").json()
    assert (asked["mine"], asked["waits"]) == (False, True)
    assert pilot.post("/api/lease/keep").json()["asks"] is None
    assert observer.post("/api/flight/arm").status_code == 403
    assert observer.post("/api/lease/take").json()["waits"]
    assert observer.post("/api/lease/hand_over").status_code == 403
    assert not pilot.post("/api/lease/hand_over").json()["mine"]
    assert pilot.post("/api/flight/arm").status_code == 403
    assert observer.post("/api/flight/arm").status_code == 204
    assert observer.post("/api/lease/release").json()["holder"] is None
    assert "Nobody is in charge" in pilot.post("/api/flight/arm").json()["what"]
    assert pilot.post("/api/lease/keep").status_code == 403


def test_signing_out_lets_go(served: Running, observer: httpx.Client) -> None:
    observer.post("/api/lease/take")
    assert served.flying.lease.holder is not None
    assert observer.delete("/api/session").status_code == 204
    assert served.flying.lease.holder is None


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (AddressError, 422),
        (ConnectionFailedError, 502),
        (NoVehicleError, 409),
        (RefusedError, 409),
        (SilentError, 504),
        (TransferError, 502),
        (RecordingError, 422),
        (RecordingFullError, 507),
        (BusError, 503),
        (TelemetryError, 502),
    ],
)
def test_what_the_vehicle_says_reaches_the_page(
    served: Running,
    pilot: httpx.Client,
    monkeypatch: pytest.MonkeyPatch,
    error: type[TelemetryError],
    status: int,
) -> None:
    async def fails(request: object) -> None:
        raise error("The vehicle said no: Arm: Need Position Estimate.", where="arm", advice="Wait for GNSS.")

    monkeypatch.setattr(served.flying, "desk", type("Desk", (), {"command": staticmethod(fails)}))
    answer = pilot.post("/api/flight/arm")
    assert answer.status_code == status
    assert json.loads(answer.text) == {
        "code": error.code,
        "what": "The vehicle said no: Arm: Need Position Estimate.",
        "where": "arm",
        "advice": "Wait for GNSS.",
    }


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/api/link/connect", {"address": ""}),
        ("/api/link/connect", {"address": "x" * 201}),
        ("/api/flight/start", {"digest": "a", "way": "upwards"}),
        ("/api/flight/start", {"digest": "a", "accept": ["clearance"]}),
        ("/api/flight/start", {"digest": "a", "from_item": 0}),
        ("/api/flight/upload", {}),
    ],
)
def test_bodies_that_make_no_sense(served: Running, pilot: httpx.Client, path: str, body: dict[str, object]) -> None:
    answer = pilot.post(path, json=body)
    assert (answer.status_code, answer.json()["code"], served.flying.asked) == (422, "invalid", [])


def test_a_command_that_waited_for_longer_than_it_is_good_for_is_not_done(served: Running, pilot: httpx.Client) -> None:
    late = pilot.post("/api/flight/return", headers={"Hedgehop-Good-Until": f"{time.monotonic() - 12:.3f}"})
    assert (late.status_code, late.json()["code"]) == (409, "late")
    assert "12 s too late and was not done" in late.json()["what"]
    wrong = pilot.post("/api/flight/return", headers={"Hedgehop-Good-Until": "noon"})
    assert wrong.status_code == 422
    assert "noon" in wrong.json()["what"]
    assert served.flying.asked == []
    for good_until in (f"{time.monotonic() + 60:.3f}", ""):
        assert pilot.post("/api/flight/return", headers={"Hedgehop-Good-Until": good_until}).status_code == 204
    assert len(served.flying.asked) == 2
