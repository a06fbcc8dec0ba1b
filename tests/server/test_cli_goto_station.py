"""``hedgehop goto station`` against a station on a real socket whose desk is a stand-in: what it asks and hands on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest

from server.app import origin_file
from server.errors import CheckNeededError
from server.flying.apart.way_apart import Others
from server.schemas import GuidedState, LeaseDoc, ReasonDoc, WayDoc
from tests.server.cli_runs import Run, hedgehop
from tests.server.running import Running

IN_THE_WAY = ReasonDoc(code="clearance", text="A mast stands in the way.", mend="Choose another place.")


class Desk:
    """Judges as it is told to, and keeps what it was asked."""

    def __init__(self) -> None:
        self.problem: Any = None
        self.has_seen = True
        self.refuses: Exception | None = None
        self.asked: list[tuple[Any, ...]] = []

    async def judge(self, operator: Any, body: Any, others: Others) -> GuidedState:
        assert list(others()) == []
        place = None if body.place is None else (body.place.lat_deg, body.place.lon_deg)
        self.asked.append(("judge", body.action, place, body.height_m))
        way = WayDoc(
            id="judged", action=body.action, problem=self.problem, notes=["It passes beside the fence."],
            reasons=[] if self.problem is None else [IN_THE_WAY], clearance_m=4.25, required_m=2.0, length_m=30.0,
            seconds=12.0, lands=False, speed_m_s=3.0, most_m_s=6.0, terrain_name="Hill", has_seen=self.has_seen,
        )  # fmt: skip
        return GuidedState(way=way)

    async def fly(self, operator: Any, body: Any, others: Others) -> None:
        assert list(others()) == []
        self.asked.append(("fly", body.id, body.accept_return))
        if self.refuses is not None:
            raise self.refuses

    def drop(self) -> GuidedState:
        self.asked.append(("drop",))
        return GuidedState()


@pytest.fixture
def desk(served: Running) -> Iterator[Desk]:
    file = origin_file(served.settings)
    file.parent.mkdir(exist_ok=True)
    file.write_text(served.origin, encoding="ascii")
    made = cast(Any, served.flying).ways = Desk()
    yield made
    del cast(Any, served.flying).ways


def goto(served: Running, *arguments: object) -> Run:
    return hedgehop("goto", "station", *arguments, "--data-dir", served.settings.data_dir, "--json")


def test_the_station_judges_and_flies_it_and_nobody_stays_in_charge(served: Running, desk: Desk) -> None:
    run = goto(served, "to", "-37.5,175.25", "--height-m", 6)
    assert (run.code, run.json["ordered"], run.json["has_seen"]) == (0, True, True), run.err
    assert (run.json["clearance_m"], run.json["terrain"]) == (4.25, "Hill")
    assert goto(served, "take-off", "--vehicle", 1).code == 0
    assert desk.asked == [
        ("judge", "to", (-37.5, 175.25), 6.0), ("fly", "judged", False), ("judge", "take_off", None, 10.0),
        ("fly", "judged", False),
    ]  # fmt: skip
    assert LeaseDoc.model_validate_json(served.http.get("/api/lease").text).holder is None


def test_a_check_or_a_way_that_is_not_clear_is_put_away_and_not_flown(served: Running, desk: Desk) -> None:
    assert goto(served, "height", "--check").code == 0
    desk.problem = "return"
    refused = goto(served, "height")
    assert (refused.code, refused.json["ordered"], refused.json["reasons"]) == (1, False, ["A mast stands in the way."])
    assert "--accept-return" in refused.err
    desk.problem = "way"
    assert goto(served, "height", "--accept-return").code == 1
    desk.problem = "others"
    assert goto(served, "height", "--accept-return").code == 1
    run = hedgehop("goto", "station", "height", "--data-dir", served.settings.data_dir)
    assert run.out.startswith("VEHICLE IN THE WAY: 30 m")
    assert [each[0] for each in desk.asked] == ["judge", "drop"] * 5
    desk.problem, desk.asked[:] = "return", []
    assert goto(served, "height", "--accept-return").json["ordered"]
    assert desk.asked[-1] == ("fly", "judged", True)


def test_what_no_sensor_saw_is_said_and_what_the_station_refuses_is_in_its_words(served: Running, desk: Desk) -> None:
    desk.has_seen, desk.refuses = False, CheckNeededError("Sensors have seen more near the way.", advice="Ask again.")
    run = goto(served, "home")
    assert run.code == 1
    assert run.json["error"]["what"] == "Sensors have seen more near the way."
    assert desk.asked[-1] == ("fly", "judged", False), "what may be flown is not put away"
    assert "It may be flown: look at the console." in run.err
    desk.refuses = None
    assert "no sensor of the station has seen anything" in goto(served, "home").err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("to",), "to needs a place"),
        (("home", "--dsm", "x.tif"), "--dsm would not count"),
        (("home", "--home-on-ground", "--profile", "mapper-rtk"), "--home-on-ground, those of the vehicle"),
        (("height", "--height-m", 99999), "--height-m"),
    ],
)
def test_wrong_input_is_told_before_the_station_is_asked(
    served: Running, desk: Desk, arguments: tuple[object, ...], said: str
) -> None:
    run = hedgehop("goto", "station", *arguments, "--data-dir", served.settings.data_dir)
    assert run.code == 2
    assert said in run.err
    assert desk.asked == []


def test_without_a_station_the_command_says_so(tmp_path: Path) -> None:
    run = hedgehop("goto", "station", "height", "--data-dir", tmp_path)
    assert run.code == 2
    assert "No Hedgehop runs from this data directory." in run.err
    unmodelled = hedgehop("goto", "tcp:127.0.0.1:1", "height")
    assert (unmodelled.code, "A surface model is needed." in unmodelled.err) == (2, True)
