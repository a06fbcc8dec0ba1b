"""``hedgehop home`` against a station on a real socket whose desk is a stand-in: what it asks, and what is refused."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.app import origin_file
from server.cli.flights import station_session
from server.cli.flights.station_session import StationSession
from server.door import lease
from server.errors import CheckNeededError, StationError
from server.schemas import HomeAskedDoc, HomeState, LeaseDoc, ReasonDoc, ReturnDoc
from tests.free_ports import free_port
from tests.server.cli_runs import Run, hedgehop
from tests.server.running import Running

IN_THE_WAY = ReasonDoc(code="clearance", text="A mast stands in the way.", mend="Choose another place.")
NOT_CERTIFIED = ReturnDoc(state="not_certified", reasons=[IN_THE_WAY], judged_mono_s=0.0)
CERTIFIED = ReturnDoc(state="certified", reasons=[], clearance_m=4.25, judged_mono_s=0.0)


class Desk:
    """Judges as it is told to, and keeps what it was asked."""

    def __init__(self) -> None:
        self.ret: ReturnDoc | None = CERTIFIED
        self.refuses: Exception | None = None
        self.asked: list[tuple[Any, ...]] = []

    async def judge(self, operator: Any, body: Any) -> HomeState:
        place = None if body.place is None else (body.place.lat_deg, body.place.lon_deg)
        self.asked.append(("judge", place))
        lat_deg, lon_deg = place or (-37.0, 175.0)
        doc = HomeAskedDoc(
            id="judged",
            is_here=place is None,
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            alt_amsl_m=100.0,
            moves_m=30.0,
            rises_m=-2.0,
            changes=["Return leads there."],
            ret=self.ret,
        )
        return HomeState(asked=doc)

    async def set(self, operator: Any, body: Any) -> None:
        self.asked.append(("set", body.id))
        if self.refuses is not None:
            raise self.refuses

    def drop(self) -> HomeState:
        self.asked.append(("drop",))
        return HomeState()


@pytest.fixture
def desk(served: Running) -> Iterator[Desk]:
    file = origin_file(served.settings)
    file.parent.mkdir(exist_ok=True)
    file.write_text(served.origin, encoding="ascii")
    made = cast(Any, served.flying).home = Desk()
    yield made
    del cast(Any, served.flying).home


def home(served: Running, *arguments: object) -> Run:
    return hedgehop("home", *arguments, "--data-dir", served.settings.data_dir, "--json")


def in_charge(served: Running) -> str | None:
    return LeaseDoc.model_validate_json(served.http.get("/api/lease").text).holder


def test_home_is_judged_then_set_and_nobody_stays_signed_in(served: Running, desk: Desk) -> None:
    before = len(served.http.get("/api/sessions").json())
    there = home(served, "-37.5,175.25")
    assert (there.code, there.json["set"], there.json["here"]) == (0, True, False), there.err
    assert (there.json["lat_deg"], there.json["return"]["state"]) == (-37.5, "certified")
    here = home(served, "here", "--vehicle", 1)
    assert (here.code, here.json["here"]) == (0, True), here.err
    assert desk.asked == [("judge", (-37.5, 175.25)), ("set", "judged"), ("judge", None), ("set", "judged")]
    assert in_charge(served) is None
    assert len(served.http.get("/api/sessions").json()) == before


def test_without_a_certified_return_it_is_set_only_where_that_is_accepted(served: Running, desk: Desk) -> None:
    desk.ret = NOT_CERTIFIED
    refused = home(served, "here")
    assert (refused.code, refused.json["set"]) == (1, False)
    assert refused.json["return"]["reasons"] == ["A mast stands in the way."]
    assert "--accept-return" in refused.err
    assert desk.asked == [("judge", None), ("drop",)]
    assert home(served, "here", "--check").code == 1
    assert ("set", "judged") not in desk.asked
    assert home(served, "here", "--accept-return").json["set"]
    assert desk.asked[-1] == ("set", "judged")


def test_a_check_sets_nothing_and_people_read_what_it_came_to(served: Running, desk: Desk) -> None:
    run = hedgehop("home", "here", "--check", "--data-dir", served.settings.data_dir)
    assert run.code == 0, run.err
    assert desk.asked == [("judge", None), ("drop",)]
    assert run.out.splitlines() == [
        "HOME NOT SET: -37.0000000,175.0000000, 30 m from home before, 2.0 m lower",
        "  Return leads there.",
        "  Return: CERTIFIED, clear by 4.2 m",
    ]


def test_what_the_station_refuses_ends_the_command_in_its_words(served: Running, desk: Desk) -> None:
    desk.refuses = CheckNeededError("Sensors have seen more near the return.", advice="Ask for home again.")
    run = home(served, "here")
    assert run.code == 1
    assert run.json["error"]["code"] == "check_needed"
    assert run.json["error"]["what"] == "Sensors have seen more near the return."
    assert desk.asked == [("judge", None), ("set", "judged"), ("drop",)]
    assert in_charge(served) is None


@pytest.mark.parametrize(("answer", "code"), [("hand_over", 0), ("keep", 1)])
def test_who_is_in_charge_is_asked(
    served: Running, desk: Desk, answer: str, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(station_session, "LOOK_EVERY_S", 0.05)
    monkeypatch.setattr(lease, "SILENT_S", 600.0)  # who is in charge has no page here
    served.http.post("/api/lease/take")
    answering = threading.Thread(target=lambda: answered(served, answer))
    answering.start()
    run = home(served, "here")
    answering.join(30)
    assert run.code == code, run.err
    if code:
        assert "has not handed control over" in run.json["error"]["what"]
        assert desk.asked == []
        assert in_charge(served) == served.name
        served.http.post("/api/lease/release")
    assert in_charge(served) is None


def answered(served: Running, answer: str) -> None:
    asks = threading.Event()
    for _ in range(1_000):
        if asks.wait(0.02):
            break
        if served.http.get("/api/lease").json()["asks"]:
            asks.set()
    served.http.post(f"/api/lease/{answer}")


def test_where_no_station_runs_that_is_said(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        run = hedgehop("home", "here", "--data-dir", folder, "--json")
        assert (run.code, run.json["error"]["what"]) == (2, "No Hedgehop runs from this data directory.")
    assert not (tmp_path / "accounts.json").exists(), "nobody was invited"


@pytest.mark.parametrize("place", ["there", "-37;175", "95,10", "nan,10"])
def test_what_is_no_place_is_refused_before_anything_is_asked(served: Running, desk: Desk, place: str) -> None:
    run = home(served, place)
    assert (run.code, desk.asked) == (2, [])
    assert run.json["error"]["where"] == "here|LAT,LON"


@pytest.mark.parametrize(
    "vehicle", ["", " ", "0", "01", "Bee", "-1", "Bravo 1", "Bravo/", "/1", "1\n", "1\r\nX: y", "\u0661"]
)
def test_what_names_no_vehicle_is_refused_before_anything_is_sent(served: Running, desk: Desk, vehicle: str) -> None:
    done = home(served, "here", f"--vehicle={vehicle}")
    assert done.code == 2, done.err
    assert "names no vehicle: nothing was sent." in done.err
    assert "--vehicle Alpha/2" in done.err
    assert desk.asked == []


def test_a_station_that_cannot_be_reached_or_answers_nonsense(served: Running, desk: Desk) -> None:
    gone = StationSession(f"http://127.0.0.1:{free_port()}", None)
    with pytest.raises(StationError, match="cannot be reached"):
        gone.sign_in("token")
    with pytest.raises(StationError, match="did not let this command in"):
        StationSession(served.origin, None).sign_in("a-token-of-nobody")
    with pytest.raises(StationError, match="another version"):
        StationSession(served.origin, None).told(HomeState, b'{"asked": 1}')
    cast(Any, served.flying).home = SimpleNamespace(judge=None)
    run = home(served, "here")
    assert (run.code, run.json["error"]["code"]) == (1, "internal")


def test_two_who_never_answer_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    session, now_s = StationSession("http://127.0.0.1:1", None), [0.0]
    waits = LeaseDoc(holder="Anna", mine=False, waits=True).model_dump_json().encode()
    monkeypatch.setattr(session, "ask", lambda *_, **__: waits)

    def wait(seconds: float) -> None:
        now_s[0] += seconds

    with pytest.raises(StationError, match="Anna is in charge"):
        session.take_control(clock_s=lambda: now_s[0], wait=wait)
    assert station_session.ANSWER_S < now_s[0] < station_session.ANSWER_S + 5.0
