"""In which order a page is told what waits for it."""

from __future__ import annotations

import asyncio
import json

from server import schemas
from server.door.page import IN_A_ROW, Outgoing, Page
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import notice, plan_state


def put(page: Page, *messages: schemas.ServerMessage) -> None:
    for message in messages:
        page.put(message, Outgoing(message))


def told(page: Page, count: int) -> list[str]:
    return [json.loads(asyncio.run(page.next_text()))["type"] for _ in range(count)]


def vehicle(source: schemas.Source = "live") -> schemas.VehicleMessage:
    return schemas.VehicleMessage(source=source, now_mono_s=1.0, state=VehicleState(1, 1), follow=None)


PLAN = schemas.PlanMessage(plan=plan_state(1))
CURSOR = schemas.CursorMessage(s_m=1)


def test_what_a_flight_is_commanded_by_and_what_warns_goes_first() -> None:
    page = Page("s")
    put(page, PLAN, CURSOR, vehicle(), notice("low"))
    assert told(page, 4) == ["vehicle", "notice", "plan", "cursor"]


def test_a_recording_s_words_are_not_urgent() -> None:
    page = Page("s")
    put(page, CURSOR, vehicle("replay"), vehicle())
    assert told(page, 3) == ["vehicle", "cursor", "vehicle"]


def test_what_is_not_urgent_does_not_wait_for_ever() -> None:
    """On a line over which the vehicle's next state is there before the last one has gone."""
    page = Page("s")
    put(page, PLAN, CURSOR)
    types = []
    for _ in range(2 * IN_A_ROW + 2):
        put(page, vehicle())
        types += told(page, 1)
    in_a_row = ["vehicle"] * IN_A_ROW
    assert types == [*in_a_row, "plan", *in_a_row, "cursor"]


def test_nothing_overtakes_what_it_counts_from() -> None:
    page = Page("s")
    put(page, CURSOR, *(notice(str(number)) for number in range(IN_A_ROW + 3)))
    put(page, schemas.ActiveMessage(vehicle=2), vehicle())
    assert told(page, IN_A_ROW + 6) == [*["notice"] * (IN_A_ROW + 3), "active", "cursor", "vehicle"]
