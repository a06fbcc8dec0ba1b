"""A crew's checklist through the doors: written, ticked, demanded by the server, in the log of commands, in Review."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from server.schemas import ChecklistDoc, ChecklistText, FlyState
from tests.server.running import PASSWORD
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle
from tests.server.station import PATIENCE_S, Station, ok, station

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

LONG_S = 3 * PATIENCE_S
PROFILE = "Generic quadrotor"
LIST = "# Vehicle\nPropellers are whole\n# Place\nNobody is near\n"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with station(tmp_path_factory.mktemp("data"), flies=True, password=PASSWORD) as made:
        ok(made.http.post("/api/terrains/demo"))
        assert made.answer().state == "ready"
        yield made


@pytest.fixture(scope="module")
def observer(planned: Station) -> Iterator[httpx.Client]:
    accounts = planned.server.parts.auth.accounts
    accounts.add("Olga", "observer")
    with planned.server.stranger(headers={"Origin": planned.server.origin}) as client:
        client.get("/login", params={"token": accounts.invite("Olga")})
        yield client


def read(planned: Station, profile: str = PROFILE) -> ChecklistText:
    answer = planned.http.get("/api/checklist", params={"profile": profile})
    return ChecklistText.model_validate_json(ok(answer).text)


def body(planned: Station, text: str) -> dict[str, Any]:
    return {"profile": PROFILE, "text": text, "instead_of": read(planned).revision}


def write(planned: Station, text: str) -> ChecklistText:
    answer = planned.http.put("/api/checklist", json=body(planned, text))
    return ChecklistText.model_validate_json(ok(answer).text)


def refused(answer: httpx.Response) -> tuple[int, str]:
    return answer.status_code, answer.json()["code"]


def test_the_list_is_written_taken_back_and_guarded(planned: Station, observer: httpx.Client) -> None:
    assert (read(planned).text, read(planned).before) == ("", None)
    assert "Propellers" in read(planned).suggested
    write(planned, LIST)
    kept = write(planned, "")
    assert (kept.before, kept.changed_by) == (LIST, planned.server.name)
    write(planned, kept.before or "")
    assert read(planned).text == LIST
    assert ChecklistText.model_validate_json(observer.get("/api/checklist", params={"profile": PROFILE}).text).text
    assert refused(observer.put("/api/checklist", json=body(planned, "x"))) == (403, "observer")


@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [
        ({"text": "point\n" * 61}, 422, "61 points"),
        ({"text": "x" * 81}, 422, "Line 1 has 81 characters"),
        ({"text": "x" * 100_001}, 422, "at most 100000 characters"),
        ({"instead_of": "0" * 64}, 409, "has changed this checklist meanwhile"),
        ({"profile": "x" * 81}, 422, "at most 80 characters"),
        ({"more": 1}, 422, "Extra inputs"),
    ],
)
def test_what_is_no_list_is_refused_and_changes_nothing(
    planned: Station, changes: dict[str, Any], status: int, words: str
) -> None:
    before = read(planned)
    answer = planned.http.put("/api/checklist", json={**body(planned, LIST), **changes})
    assert answer.status_code == status, answer.text
    assert words in answer.json()["what"]
    assert read(planned) == before


@pytest.fixture(scope="module")
def vehicle(planned: Station) -> Iterator[None]:
    document, result = planned.state.document, planned.state.computation.result
    assert result is not None
    home = document.pois[0]
    place = f"{home.lat_deg:.9f},{home.lon_deg:.9f},{result.home_alt_dsm_m:.3f}"
    rtl = f"RTL_ALT={100 * document.profile.rtl_height_m:.0f}"
    with simulated_vehicle(place, "--speedup", 12, "--parameter", rtl, *QUICKLY_DOWN) as address:
        ok(planned.http.post("/api/link/connect", json={"address": address}))
        planned.until(lambda m: m.type == "vehicle" and _is_ready(m.state), LONG_S)
        yield


def _is_ready(state: Any) -> bool:
    return state is not None and bool(state.ready_to_arm and state.estimator_ok) and state.home_lat_deg is not None


def fly_state(answer: httpx.Response) -> FlyState:
    return FlyState.model_validate_json(ok(answer).text)


def checked(planned: Station) -> tuple[str, ChecklistDoc]:
    """The digest and the list of a mission that is on board and passes its check."""
    ok(planned.http.post("/api/flight/upload", json={"revision": planned.state.revision}))
    state = fly_state(planned.http.post("/api/flight/check"))
    assert state.checklist is not None
    assert state.onboard.digest is not None
    return state.onboard.digest, state.checklist


def test_a_start_is_refused_until_each_point_is_ticked_and_review_shows_who_did(
    planned: Station, observer: httpx.Client, vehicle: None
) -> None:
    write(planned, LIST)
    digest, asked = checked(planned)
    assert [(point.heading, point.text, point.ticked_by) for point in asked.points] == [
        ("Vehicle", "Propellers are whole", ""),
        ("Place", "Nobody is near", ""),
    ]
    start = {"digest": digest}
    answer = planned.http.post("/api/flight/start", json=start)
    assert refused(answer) == (409, "check_needed")
    assert "2 of 2 points of the checklist are open" in answer.json()["what"]

    tick = {"digest": digest, "revision": asked.revision, "number": 1}
    assert refused(observer.put("/api/flight/checklist", json=tick)) == (403, "observer")
    for wrong, code in (({"number": 0}, 422), ({"number": 3}, 422), ({"digest": "x"}, 409), ({"revision": "x"}, 409)):
        assert planned.http.put("/api/flight/checklist", json={**tick, **wrong}).status_code == code
    fly_state(planned.http.put("/api/flight/checklist", json=tick))
    assert "Nobody is near" in planned.http.post("/api/flight/start", json=start).json()["what"]

    # Another text asks for all of it again.
    write(planned, LIST + "Wind will do\n")
    again = planned.until(
        lambda m: m.type == "fly" and m.fly.checklist and len(m.fly.checklist.points) == 3
    ).fly.checklist
    assert (again.why_again, {point.ticked_by for point in again.points}) == (
        "The list was changed since it was ticked.",
        {""},
    )
    assert refused(planned.http.put("/api/flight/checklist", json=tick)) == (409, "check_needed")
    for number in (1, 2, 3):
        state = fly_state(
            planned.http.put("/api/flight/checklist", json={**tick, "revision": again.revision, "number": number})
        )
    assert state.checklist is not None
    assert {point.ticked_by for point in state.checklist.points} == {planned.server.name}
    ok(planned.http.post("/api/flight/start", json=start))
    recording = planned.until(lambda m: m.type == "recorder" and m.recorder.recording, LONG_S).recorder
    planned.until(lambda m: m.type == "flight" and m.flight.phase == "flying", LONG_S)
    ok(planned.http.post("/api/flight/land"))
    # Once it is disarmed: the next flight is ticked for itself. That may be told before the vehicle's own state is.
    over = planned.until(
        lambda m: m.type == "fly" and m.fly.checklist and m.fly.checklist.why_again, LONG_S
    ).fly.checklist
    assert "each flight is ticked for itself" in over.why_again
    assert {point.ticked_by for point in over.points} == {""}

    words = [entry["words"] for entry in ok(planned.http.get("/api/audit")).json()["newest"]]
    assert f"tick point 3 of 3 of the checklist of {PROFILE}: Wind will do" in words
    written = [line for line in words if f"ticks the checklist of {PROFILE}: " in line]
    assert len({line.partition(", written by ")[0] for line in written}) == 2
    assert all(f"written by {planned.server.name} at 20" in line for line in written)
    listed = planned.until(
        lambda m: m.type == "recordings" and any(r.name == recording.name and not r.fault for r in m.recordings), LONG_S
    ).recordings
    doc = next(each for each in listed if each.name == recording.name)
    ok(planned.http.post("/api/review/open", json={"recording_id": doc.id}))
    shown = planned.until(lambda m: m.type == "review" and m.review is not None).review.checklist
    assert (shown.profile, shown.mission_digest) == (PROFILE, digest)
    assert [(point.heading, point.text, point.ticked_by) for point in shown.points] == [
        ("Vehicle", "Propellers are whole", planned.server.name),
        ("Place", "Nobody is near", planned.server.name),
        ("Place", "Wind will do", planned.server.name),
    ]
    assert all(point.ticked_utc_s <= shown.started_utc_s for point in shown.points)
    ok(planned.http.post("/api/review/close"))


def test_a_vehicle_that_was_given_up_and_taken_again_is_asked_for_again(planned: Station, vehicle: None) -> None:
    write(planned, LIST)
    digest, asked = checked(planned)
    assert len(asked.points) == 2
    for number in range(1, len(asked.points) + 1):
        tick = {"digest": digest, "revision": asked.revision, "number": number}
        ok(planned.http.put("/api/flight/checklist", json=tick))
    candidate = planned.until(lambda m: m.type == "link" and m.link.adopted is not None).link.adopted.id
    ok(planned.http.post("/api/link/release"))
    # It is offered again once its next heartbeat is heard.
    planned.until(lambda m: m.type == "link" and any(c.id == candidate for c in m.link.candidates), LONG_S)
    ok(planned.http.post("/api/link/adopt", json={"candidate": candidate}))
    planned.until(lambda m: m.type == "vehicle" and _is_ready(m.state), LONG_S)
    ok(planned.http.post("/api/flight/upload", json={"revision": planned.state.revision}))
    state = fly_state(planned.http.post("/api/flight/check"))
    assert state.checklist is not None
    assert "disconnected" in state.checklist.why_again
    answer = planned.http.post("/api/flight/start", json={"digest": digest})
    assert "points of the checklist are open" in answer.json()["what"]
