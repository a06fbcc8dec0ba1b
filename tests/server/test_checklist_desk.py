"""For what ticks hold: these words, this vehicle, this mission, until it is disarmed, gone or not heard."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from server.errors import BadRequestError, CheckNeededError, ConflictError, StorageError
from server.flying.checklist_desk import ChecklistDesk
from server.flying.checklists import FILE, Checklists
from server.heard.onboard import Aboard, onboard
from server.schemas import ChecklistDoc, TickBody
from telemetry.errors import RecordingFullError
from telemetry.topics.checklist import ChecklistRecord
from telemetry.topics.messages import Candidate, LinkStatus, PlanRecord, Topic
from telemetry.topics.requests import NoteChecklist, Operator, TickPoint

ANNA, BEN = Operator("Anna", 7), Operator("Ben", 8)
QUAD = Candidate("udp/1/1", "udpin:127.0.0.1:14550", "127.0.0.1:9", 1, 1, "ardupilot", 2)
OTHER = replace(QUAD, id="udp/2/1", system_id=2)
LIST = "# Vehicle\nPropellers\nBattery\n# Place\nNo people\n"


def record(digest: str = "mission", profile: str = "Quad") -> PlanRecord:
    toml = f'name = "{profile}"\n'
    return PlanRecord(0.0, "Orchard", "", digest, "ardupilot", "", "", "", None, None, toml, "")


def status(**changes: Any) -> LinkStatus:
    known = LinkStatus(1e12, adopted=QUAD, state="live", mission_state="verified", mission_digest="mission")
    return replace(known, **changes)


class Desk:
    """A desk whose link writes down what it is asked, and whose bus remembers what was published."""

    def __init__(self, root: Path) -> None:
        self.lists, self.aboard = Checklists(root), Aboard(root / "onboard.json")
        self.asked: list[TickPoint] = []
        self.noted: list[NoteChecklist] = []
        self.changes: list[NoteChecklist] = []
        self.published: list[ChecklistRecord] = []
        self.refusal: Exception | None = None
        self.meanwhile: Callable[[], object] = lambda: None
        me: Any = self
        self.desk = ChecklistDesk(me, self.lists, self.aboard, me)
        self.aboard.read_back(onboard(record(), 5, ()))
        self.hear(status())

    async def call(self, request: Any) -> None:
        if self.refusal is not None:
            raise self.refusal
        if isinstance(request, NoteChecklist) and request.changed:
            self.changes.append(request)
            return
        if isinstance(request, NoteChecklist):
            self.noted.append(request)
            return
        self.asked.append(request)
        self.meanwhile()

    def publish(self, topic: str, message: ChecklistRecord) -> None:
        assert topic == Topic.CHECKLIST
        self.published.append(message)

    def hear(self, link: LinkStatus, *, armed: bool = False) -> None:
        self.aboard.on_link(link)
        self.desk.on_link(link, armed=armed)

    def write(self, text: str, profile: str = "Quad") -> None:
        self.lists.write(profile, text, instead_of=self.lists.of(profile).revision, by="Anna")

    @property
    def doc(self) -> ChecklistDoc:
        doc = self.desk.doc
        assert doc is not None
        return doc

    def tick(self, number: int, who: Operator = ANNA, **changes: Any) -> None:
        known = {"digest": "mission", "revision": self.doc.revision, "number": number}
        asyncio.run(self.desk.tick(who, TickBody(**{**known, **changes})))

    def tick_all(self) -> None:
        for number in range(1, len(self.doc.points) + 1):
            self.tick(number)

    @property
    def ticked_by(self) -> list[str]:
        return [point.ticked_by for point in self.doc.points]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    made = Desk(tmp_path)
    made.write(LIST)
    return made


def test_without_a_list_nothing_is_demanded_or_recorded(tmp_path: Path) -> None:
    desk = Desk(tmp_path)
    assert (desk.doc.profile, desk.doc.points) == ("Quad", [])
    desk.desk.check("mission")
    desk.desk.started()
    assert desk.published == []
    with pytest.raises(BadRequestError, match="has 0 points"):
        desk.tick(1)


def test_each_point_is_ticked_by_name_and_written_down_before_a_start(desk: Desk) -> None:
    with pytest.raises(CheckNeededError, match='3 of 3 points of the checklist are open, first "Propellers"'):
        desk.desk.check("mission")
    desk.tick(1)
    desk.tick(3, BEN)
    with pytest.raises(CheckNeededError, match='1 of 3 points of the checklist is open, first "Battery"'):
        desk.desk.check("mission")
    desk.tick(2)
    desk.desk.check("mission")
    assert desk.ticked_by == ["Anna", "Anna", "Ben"]
    assert desk.asked[1] == TickPoint(BEN, 3, 3, "No people", "Quad", ticked=True)
    assert desk.published[-1].started_utc_s is None
    desk.desk.started()
    last = desk.published[-1]
    assert (last.profile, last.vehicle, last.mission_digest) == ("Quad", "udp/1/1", "mission")
    assert [(point.heading, point.ticked_by) for point in last.points][2] == ("Place", "Ben")
    assert last.started_utc_s is not None
    assert all(point.ticked_utc_s and point.ticked_utc_s <= last.started_utc_s for point in last.points)


def test_a_tick_is_taken_back_and_one_that_stands_keeps_its_name(desk: Desk) -> None:
    desk.tick_all()
    desk.tick(2, BEN)
    assert desk.ticked_by == ["Anna", "Anna", "Anna"]
    desk.tick(2, BEN, ticked=False)
    assert desk.ticked_by == ["Anna", "", "Anna"]
    assert [(each.number, each.ticked) for each in desk.asked] == [(1, True), (2, True), (3, True), (2, False)]
    with pytest.raises(CheckNeededError, match="Battery"):
        desk.desk.check("mission")


def test_whose_text_is_ticked_is_noted_before_the_first_tick_of_each(desk: Desk) -> None:
    desk.refusal = RecordingFullError("No space is left for the audit log.")
    with pytest.raises(RecordingFullError):
        desk.tick(1)
    desk.refusal = None
    desk.tick_all()
    first = desk.lists.of("Quad")
    desk.lists.write("Quad", "Propellers\n", instead_of=first.revision, by="Eve")
    desk.tick(1, BEN)
    second = desk.lists.of("Quad")
    assert desk.noted == [
        NoteChecklist(ANNA, "Quad", 3, first.revision, "Anna", first.changed_utc),
        NoteChecklist(BEN, "Quad", 1, second.revision, "Eve", second.changed_utc),
    ]


def test_what_cannot_be_written_down_is_not_ticked(desk: Desk) -> None:
    desk.refusal = RecordingFullError("No space is left for the audit log.")
    with pytest.raises(RecordingFullError):
        desk.tick(1)
    assert desk.ticked_by == ["", "", ""]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"digest": "another"}, "Another mission is on board"),
        ({"revision": "0" * 64}, "The checklist was changed"),
    ],
)
def test_a_tick_of_something_else_than_is_asked_is_refused(desk: Desk, changes: dict[str, Any], why: str) -> None:
    with pytest.raises(CheckNeededError, match=why):
        desk.tick(1, **changes)
    assert desk.asked == []


def test_a_point_that_is_none_is_refused(desk: Desk) -> None:
    with pytest.raises(BadRequestError, match="has 3 points, and no point 4"):
        desk.tick(4)


def _another_mission(desk: Desk) -> None:
    desk.aboard.read_back(onboard(record("another"), 5, ()))


@pytest.mark.parametrize(
    ("change", "why", "digest"),
    [
        (lambda desk: desk.write(LIST + "Wind\n"), "The list was changed", "mission"),
        (lambda desk: desk.hear(status(adopted=OTHER)), "Another vehicle is connected", "mission"),
        (_another_mission, "Another mission is on board", "another"),
        (lambda desk: desk.hear(status(state="lost")), "was not heard for a while", "mission"),
        (lambda desk: desk.desk.forget("The vehicle was disarmed."), "The vehicle was disarmed", "mission"),
    ],
)
def test_what_was_ticked_is_asked_again_and_why_is_said(
    desk: Desk, change: Callable[[Desk], object], why: str, digest: str
) -> None:
    desk.tick_all()
    desk.desk.check("mission")
    change(desk)
    with pytest.raises(CheckNeededError, match=why):
        desk.desk.check(digest)
    assert why in desk.doc.why_again
    assert set(desk.ticked_by) == {""}


def test_a_vehicle_that_comes_back_is_asked_for_again(desk: Desk) -> None:
    desk.tick_all()
    desk.hear(status(adopted=None, state="none"))
    assert desk.desk.doc is None
    desk.hear(status())
    assert set(desk.ticked_by) == {""}
    assert "disconnected" in desk.doc.why_again


def test_a_radio_that_fades_in_flight_opens_nothing(desk: Desk) -> None:
    desk.tick_all()
    desk.hear(status(state="lost"), armed=True)
    desk.hear(status(), armed=True)
    assert desk.ticked_by == ["Anna", "Anna", "Anna"]


def test_a_mission_that_comes_back_is_asked_for_again(desk: Desk) -> None:
    desk.tick_all()
    _another_mission(desk)
    assert set(desk.ticked_by) == {""}
    desk.aboard.read_back(onboard(record(), 5, ()))
    assert set(desk.ticked_by) == {""}


def test_the_mission_that_is_started_is_the_one_that_was_ticked(desk: Desk) -> None:
    desk.tick_all()
    with pytest.raises(CheckNeededError, match="Another mission"):
        desk.desk.check("another")


def test_what_changes_while_a_tick_is_written_down_leaves_it_open(desk: Desk) -> None:
    desk.meanwhile = lambda: desk.write(LIST + "Wind\n")
    with pytest.raises(CheckNeededError, match="changed just now"):
        desk.tick(1)
    assert set(desk.ticked_by) == {""}


def test_the_list_is_that_of_the_profile_that_was_planned_with(desk: Desk) -> None:
    desk.write("One\n", "Wing")
    desk.aboard.read_back(onboard(record("another", "Wing"), 5, ()))
    assert (desk.doc.profile, [point.text for point in desk.doc.points]) == ("Wing", ["One"])


def test_a_new_server_asks_again(desk: Desk, tmp_path: Path) -> None:
    desk.tick_all()
    desk.aboard.save()
    after = Desk(tmp_path)
    assert set(after.ticked_by) == {""}
    with pytest.raises(CheckNeededError, match="3 of 3"):
        after.desk.check("mission")


def test_while_the_lists_cannot_be_read_nothing_is_started(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("{")
    desk = Desk(tmp_path)
    assert "nobody knows what a start demands" in desk.doc.fault
    with pytest.raises(StorageError, match="cannot be read"):
        desk.desk.check("mission")


def test_each_vehicle_of_a_station_is_ticked_for_itself_by_the_one_list(tmp_path: Path) -> None:
    (tmp_path / "2").mkdir()
    first, second = Desk(tmp_path), Desk(tmp_path / "2")
    second.lists = first.lists
    me: Any = second
    second.desk = ChecklistDesk(me, first.lists, second.aboard, me)
    first.write(LIST)
    first.tick_all()
    assert first.ticked_by == ["Anna", "Anna", "Anna"]
    assert second.ticked_by == ["", "", ""]
    with pytest.raises(CheckNeededError, match="3 of 3"):
        second.desk.check("mission")
    second.tick_all()
    first.write(LIST + "Wind\n")
    for desk in (first, second):
        assert "The list was changed" in desk.doc.why_again
        assert set(desk.ticked_by) == {""}


def test_a_text_that_is_changed_and_never_ticked_is_in_the_log_once_the_link_is_there(tmp_path: Path) -> None:
    first = Desk(tmp_path)
    first.write(LIST)
    first.refusal = RecordingFullError("No space is left.")
    with pytest.raises(RecordingFullError):
        asyncio.run(first.desk.log_changes(BEN))
    first.write("")
    again = Desk(tmp_path)  # a server that is started anew
    asyncio.run(again.desk.log_changes(BEN))
    assert [(each.profile, each.points, each.written_by) for each in again.changes] == [
        ("Quad", 3, "Anna"),
        ("Quad", 0, "Anna"),
    ]
    assert again.changes[0].digest != again.changes[1].digest == again.lists.of("Quad").revision
    assert again.asked == again.noted == []
    asyncio.run(again.desk.log_changes(BEN))
    asyncio.run(Desk(tmp_path).desk.log_changes(BEN))
    assert len(again.changes) == 2, "each once"


def test_a_change_that_cannot_be_kept_as_logged_is_logged_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(tmp_path)
    desk.write(LIST)

    def is_full(file: Path, data: bytes) -> None:
        raise StorageError("No space is left.")

    with monkeypatch.context() as full:
        full.setattr("server.flying.checklists.write_atomically", is_full)
        with pytest.raises(StorageError, match="No space"):
            asyncio.run(desk.desk.log_changes(BEN))
        for _ in range(3):
            asyncio.run(desk.desk.log_changes(BEN))
    assert len(desk.changes) == 1


def test_so_many_changes_without_a_log_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.flying.checklists.MOST_UNLOGGED", 2)
    desk = Desk(tmp_path)
    desk.write("One\n")
    desk.write("Two\n")
    with pytest.raises(ConflictError, match="2 changes wait for the log of commands"):
        desk.write("Three\n")
    assert desk.lists.of("Quad").text == "Two\n"
    asyncio.run(desk.desk.log_changes(BEN))
    desk.write("Three\n")
