"""Prepared manoeuvres: on show while the obstacle is, with their clearance; flown as they are shown, or not at all."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from server.errors import NotFoundError, NotReadyError
from server.obstacles import manoeuvres
from server.obstacles.manoeuvre_situation import Prepared
from server.obstacles.manoeuvres import Manoeuvres
from server.obstacles.obstacle_watch import Watch
from server.schemas import ManoeuvreDoc
from telemetry.errors import NotAllowedError
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.requests import MayFlyManoeuvre, Operator
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.obstacle_messages import alert, approach

ANNA = Operator("Anna", 3)


def prepared(kind: Any = "over", *, possible: bool = True) -> Prepared:
    doc = ManoeuvreDoc(id=f"{kind}-radar-1", kind=kind, for_alert="radar-1", possible=possible, text="Climb.")
    targets = (GuidedTarget(4, 37.7, 15.0, 30.0, 3.0),)
    return Prepared(doc, targets, 4, 6.0, ((0.0, 0.0, 5.0), (0.0, 0.0, 30.0)))


class Desk:
    """A watch with manoeuvres whose worker answers at once."""

    def __init__(self, *answers: Any) -> None:
        self.told = Told()
        self.watch = Watch("live", self.told)
        self.live = SimpleNamespace(state=None)
        self.sees: Any = lambda standing, moving: standing or moving
        self.answers = list(answers)
        self.asked: list[Any] = []
        me: Any = self
        self.refusals: dict[str, str] = {}
        """Of the link, by the kind of manoeuvre."""
        self.questions: list[MayFlyManoeuvre] = []
        link: Any = SimpleNamespace(call=self._may_fly)
        self.manoeuvres = Manoeuvres(me, me, link)

    async def situation(self, standing: Any, moving: Any, *, at_once: bool) -> Any:
        assert at_once, "who stands before an obstacle waits for no map"
        return self.sees(standing, moving)

    async def _may_fly(self, request: MayFlyManoeuvre) -> str:
        self.questions.append(request)
        return self.refusals.get(request.kind, "")

    def request(self, manoeuvre_id: str) -> Any:
        return asyncio.run(self.manoeuvres.request(ANNA, manoeuvre_id))

    async def call(self, _prepare: Any, situation: Any) -> tuple[Prepared, ...]:
        self.asked.append(situation.id)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    async def until(self, done: Any) -> None:
        task = asyncio.ensure_future(self.manoeuvres.run())
        try:
            async with asyncio.timeout(60):
                while not done():
                    await asyncio.sleep(0.01)
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


@pytest.fixture(autouse=True)
def _prepared_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each worker's answer is used once, however slow the machine."""
    monkeypatch.setattr(manoeuvres, "AGAIN_AFTER_S", 600.0)


def test_a_way_that_begins_elsewhere_is_not_flown() -> None:
    desk = Desk((replace(prepared(), begins_lat_lon_deg=(37.7, 15.0)),))
    desk.manoeuvres.on_alert(alert())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    desk.live.state = VehicleState(1, 1, lat_deg=37.70005, lon_deg=15.0)
    assert desk.request("over-radar-1").kind == "over"
    desk.live.state = VehicleState(1, 1, lat_deg=37.7001, lon_deg=15.0)
    with pytest.raises(NotAllowedError, match="11 m from where"):
        desk.request("over-radar-1")


def test_they_come_with_the_alert_and_go_with_it() -> None:
    desk = Desk((prepared("over"), prepared("around", possible=False)))
    desk.manoeuvres.on_alert(alert())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    assert [doc.kind for doc in desk.watch.state.manoeuvres] == ["over", "around"]
    assert [route.words for route in desk.manoeuvres.routes] == ["Over", "Around"]
    assert desk.watch.state.busy == ""
    assert any(m.type == "obstacles" and m.obstacles.busy for m in desk.told)
    request = desk.request("over-radar-1")
    assert (request.operator, request.kind, request.rejoin_item, request.height_offset_m) == (ANNA, "over", 4, 6.0)
    with pytest.raises(NotAllowedError, match="cannot be flown"):
        desk.request("around-radar-1")
    desk.manoeuvres.on_alert(alert(phase="ends"))
    assert desk.watch.state.manoeuvres == []
    with pytest.raises(NotFoundError, match="out of date"):
        desk.request("over-radar-1")


def test_what_is_offered_over_half_a_map_says_so() -> None:
    desk = Desk((prepared("over"), prepared("around", possible=False)))
    desk.watch.mirrors["radar"].expect(10.0)
    desk.manoeuvres.on_alert(alert())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    assert [doc.text for doc in desk.watch.state.manoeuvres] == [f"Climb. {manoeuvres.PARTS_MISSING}", "Climb."]


def test_what_the_link_would_refuse_is_not_offered_and_its_words_are_the_reason() -> None:
    desk = Desk((prepared("over"), prepared("around"), prepared("sidestep", possible=False)))
    desk.refusals["over"] = "Beyond the fence. Fly another way, or return."
    desk.manoeuvres.on_alert(alert())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    assert [(doc.kind, doc.possible, doc.text) for doc in desk.watch.state.manoeuvres[:2]] == [
        ("over", False, "Beyond the fence. Fly another way, or return."),
        ("around", True, "Climb."),
    ]
    assert [route.words for route in desk.manoeuvres.routes if "Over" in route.words] == []
    assert [(asked.kind, asked.rejoin_item, asked.height_offset_m) for asked in desk.questions] == [
        ("over", 4, 6.0),
        ("around", 4, 6.0),
    ]
    with pytest.raises(NotAllowedError, match="Beyond the fence"):
        desk.request("over-radar-1")


def test_a_worker_that_fails_costs_this_manoeuvre_only() -> None:
    desk = Desk(RuntimeError("broken"), (prepared(),))
    desk.manoeuvres.on_alert(alert("a"))
    asyncio.run(desk.until(lambda: desk.watch.state.manoeuvres))
    none = desk.watch.state.manoeuvres
    assert [(doc.kind, doc.for_alert, doc.possible) for doc in none] == [("over", "a", False), ("around", "a", False)]
    assert all(doc.text for doc in none)
    assert desk.watch.state.busy == ""
    desk.manoeuvres.on_alert(alert("b"))
    asyncio.run(desk.until(lambda: any(each.doc.possible for each in desk.manoeuvres.prepared)))
    assert desk.asked == ["a", "b"]


@pytest.mark.parametrize(
    ("there", "kinds"),
    [
        ([alert("a")], ["over", "around"]),
        ([approach()], ["sidestep"]),
        ([alert("a"), approach()], ["over", "around", "sidestep"]),
    ],
)
def test_why_nothing_can_be_offered_is_told_of_each_way(there: list[Any], kinds: list[str]) -> None:
    desk = Desk()
    desk.sees = lambda standing, moving: None
    for each in there:
        desk.manoeuvres.on_alert(each)
    asyncio.run(desk.until(lambda: desk.watch.state.manoeuvres))
    none = desk.watch.state.manoeuvres
    assert [(doc.kind, doc.possible, doc.text) for doc in none] == [
        (kind, False, manoeuvres.NOTHING_KNOWN) for kind in kinds
    ]
    assert desk.asked == []


def test_a_sidestep_beside_an_obstacle_that_fails_when_it_is_flown_says_why_and_stays_on_show() -> None:
    desk = Desk((prepared(), prepared("around"), side(5.0)), NotReadyError("The surface model was deleted.", advice=""))
    desk.manoeuvres.on_alert(alert())
    desk.manoeuvres.on_alert(approach())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    with pytest.raises(NotAllowedError, match="model was deleted"):
        desk.request("sidestep-t7")
    assert [(doc.kind, doc.possible) for doc in desk.watch.state.manoeuvres] == [
        ("over", False),
        ("around", False),
        ("sidestep", False),
    ]


def test_of_a_vehicle_that_stands_disarmed_nothing_is_sought_and_no_flight_is_spoken_of() -> None:
    desk = Desk()
    desk.live.state = VehicleState(1, 1, heartbeat_t_mono_s=1.0)
    desk.manoeuvres.on_alert(alert("a"))
    asyncio.run(desk.until(lambda: desk.watch.state.manoeuvres))
    assert {(doc.possible, doc.text) for doc in desk.watch.state.manoeuvres} == {(False, manoeuvres.STANDS)}
    assert desk.asked == []


def test_when_the_newest_is_over_the_one_before_counts() -> None:
    desk = Desk((prepared(),), (prepared(),))
    desk.manoeuvres.on_alert(alert("a"))
    desk.manoeuvres.on_alert(alert("b"))
    desk.manoeuvres.on_alert(alert("b", "ends"))
    asyncio.run(desk.until(lambda: desk.asked))
    assert desk.asked == ["a"]


def side(east_m: float, text: str = "Turn.", *, possible: bool = True) -> Prepared:
    doc = ManoeuvreDoc(id="sidestep-t7", kind="sidestep", for_alert="t7", possible=possible, text=text)
    way = ((0.0, 0.0, 5.0), (east_m, 20.0, 5.0)) if possible else ()
    return Prepared(doc, (GuidedTarget(4, 37.7, 15.0, 5.0, 3.0),), None, 0.0, way)


def shown_with(*answers: Any) -> Desk:
    """The first answer is on show, the others come when it is flown."""
    desk = Desk(*answers)
    desk.manoeuvres.on_alert(approach())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    return desk


def test_a_sidestep_is_made_anew_at_the_moment_it_is_flown() -> None:
    desk = shown_with((side(5.0),), (side(9.0, "Turn more."),))
    assert desk.manoeuvres.routes[0].kind == "sidestep"
    request = desk.request("sidestep-t7")
    assert (request.kind, request.rejoin_item) == ("sidestep", None)
    assert desk.asked == ["t7", "t7"]
    assert desk.watch.state.manoeuvres[0].text == "Turn more."


def test_a_sidestep_to_the_other_side_is_looked_at_first() -> None:
    desk = shown_with((side(25.0),), (side(-25.0, "Turn left."),))
    with pytest.raises(NotAllowedError, match=r"another one now: Turn left\."):
        desk.request("sidestep-t7")
    assert desk.watch.state.manoeuvres[0].text == "Turn left."


def test_a_sidestep_that_is_not_possible_any_more_is_not_flown() -> None:
    desk = shown_with((side(5.0),), (side(5.0, "The present velocity leads into nothing.", possible=False),))
    with pytest.raises(NotAllowedError, match="leads into nothing"):
        desk.request("sidestep-t7")
    failing = shown_with((side(5.0),), NotReadyError("The surface model was deleted.", advice=""))
    with pytest.raises(NotAllowedError, match="model was deleted"):
        failing.request("sidestep-t7")


def test_what_stands_and_what_moves_are_served_together() -> None:
    pairs: list[tuple[Any, Any]] = []
    desk = Desk((prepared(), side(5.0)), (prepared(), side(5.0)))
    desk.sees = lambda *both: pairs.append(both) or both[0]
    desk.manoeuvres.on_alert(approach())
    desk.manoeuvres.on_alert(alert("wall"))
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    assert [each.id for each in pairs[0]] == ["wall", "t7"]
    assert [doc.kind for doc in desk.watch.state.manoeuvres] == ["over", "sidestep"]


@pytest.mark.parametrize("kind", ["sensor", "divergence"])
def test_what_stands_nowhere_is_not_avoided(kind: str) -> None:
    desk = Desk()
    desk.manoeuvres.on_alert(alert(kind=kind))
    assert desk.manoeuvres.routes == []
    assert desk.asked == []


def test_while_the_vehicle_climbs_by_itself_nothing_is_prepared() -> None:
    desk = Desk()
    desk.watch.on_avoidance(AvoidanceStatus(enabled=True, state="climbing"))
    asked: list[str] = []
    desk.sees = lambda standing, moving: asked.append(standing.id) or standing
    desk.manoeuvres.on_alert(alert())
    asyncio.run(desk.until(lambda: asked))
    assert desk.asked == []


@pytest.mark.parametrize("state", ["holding", "ceiling"])
def test_where_avoidance_stands_and_waits_ways_out_are_offered(state: str) -> None:
    desk = Desk((prepared(),))
    desk.watch.on_avoidance(AvoidanceStatus(enabled=True, state=state))  # pyright: ignore[reportArgumentType]
    desk.manoeuvres.on_alert(alert())
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    assert len(desk.watch.state.manoeuvres) == 1


def test_those_on_show_go_when_the_vehicle_begins_to_climb_by_itself() -> None:
    desk = Desk((prepared(),), (prepared(),))
    desk.manoeuvres.on_alert(alert("a"))
    asyncio.run(desk.until(lambda: desk.manoeuvres.prepared))
    desk.watch.on_avoidance(AvoidanceStatus(enabled=True, state="climbing"))
    desk.manoeuvres.on_alert(alert("b"))
    asyncio.run(desk.until(lambda: not desk.manoeuvres.prepared))
    assert desk.watch.state.manoeuvres == []
