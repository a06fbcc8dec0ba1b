"""Bounded queues, latest-wins, notices that arrive, and stalled pages that hold up nobody (R13, R14)."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, cast

import pytest
from starlette.websockets import WebSocket, WebSocketState

from server.door import hub as hub_module
from server.door.hub import Hub, parse
from server.door.lease import Lease
from server.door.operators import Operators
from server.door.page import CLOSE_POLICY, CLOSE_SIGNED_OUT, CLOSE_SLOW, WAITING_MAX, Outgoing, Page
from server.schemas import (
    CursorMessage,
    ErrorDoc,
    HoverProfile,
    JobDoc,
    JobMessage,
    LeaseDoc,
    LeaseMessage,
    NoticeMessage,
    PlanMessage,
    SelectionDoc,
    SelectionMessage,
    SetSelection,
    Source,
    TextMessage,
    VehicleMessage,
)
from telemetry.topics.messages import VehicleText
from tests.server.fakes import notice, plan_state, snapshot


class FakeSocket:
    """A browser's end; while ``stalled`` it takes nothing."""

    def __init__(self) -> None:
        self.application_state = self.client_state = WebSocketState.CONNECTED
        self.sent: list[dict[str, Any]] = []
        self.flowing = asyncio.Event()
        self.flowing.set()
        self.incoming: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.close_code: int | None = None

    async def send_text(self, text: str) -> None:
        await self.flowing.wait()
        self.sent.append(json.loads(text))

    async def receive(self) -> dict[str, Any]:
        return await self.incoming.get()

    async def close(self, code: int) -> None:
        self.close_code = code
        await self.flowing.wait()

    def says(self, text: str) -> None:
        self.incoming.put_nowait({"type": "websocket.receive", "text": text})

    def leaves(self) -> None:
        self.incoming.put_nowait({"type": "websocket.disconnect", "code": 1001})

    def types(self) -> list[str]:
        return [message["type"] for message in self.sent]


class Bench:
    """A hub with fake browsers on it."""

    def __init__(self) -> None:
        self.hub = Hub()
        self.heard: list[tuple[str, object]] = []
        self._tasks: list[asyncio.Task[None]] = []

    async def join(self, *, session: str = "s", remaining_s: float = 1000.0, page_id: str | None = None) -> FakeSocket:
        socket = FakeSocket()

        async def on_message(page_id: str, message: object) -> None:
            self.heard.append((page_id, message))

        self._tasks.append(
            asyncio.create_task(
                self.hub.serve(
                    cast(WebSocket, socket),
                    session_key=session,
                    session_remaining_s=remaining_s,
                    page_id=page_id,
                    snapshot=snapshot,
                    on_message=on_message,
                )
            )
        )
        await settled()
        return socket

    async def end(self) -> None:
        self.hub.close()
        await asyncio.gather(*self._tasks)


async def settled() -> None:
    for _ in range(50):
        await asyncio.sleep(0)


def run(scenario: Callable[[Bench], Awaitable[None]]) -> None:
    async def whole() -> None:
        bench = Bench()
        try:
            async with asyncio.timeout(60):
                await scenario(bench)
        finally:
            await bench.end()

    asyncio.run(whole())


def test_a_page_starts_with_its_snapshot() -> None:
    async def scenario(bench: Bench) -> None:
        socket = await bench.join()
        assert socket.types() == ["snapshot"]
        assert bench.hub.page(socket.sent[0]["page_id"]) is not None
        socket.leaves()
        await settled()
        assert bench.hub.session_keys() == set()

    run(scenario)


def test_state_is_latest_wins_and_notices_all_arrive() -> None:
    async def scenario(bench: Bench) -> None:
        socket = await bench.join()
        socket.flowing.clear()
        bench.hub.publish(SelectionMessage(selection=SelectionDoc()))
        await settled()
        for revision in range(100):
            bench.hub.publish(PlanMessage(plan=plan_state(revision)))
            bench.hub.publish(CursorMessage(s_m=revision))
            bench.hub.publish(JobMessage(job=JobDoc(id=f"j{revision % 2}", label=str(revision), state="running")))
            if revision % 10 == 0:
                bench.hub.publish(notice(str(revision)))
        socket.flowing.set()
        await settled()
        assert sorted(socket.types()[2:]) == ["cursor", "job", "job", *["notice"] * 10, "plan"]
        by_type = {message["type"]: message for message in socket.sent}
        assert by_type["plan"]["plan"]["revision"] == 99
        assert by_type["cursor"]["s_m"] == 99
        jobs = {m["job"]["id"]: m["job"]["label"] for m in socket.sent if m["type"] == "job"}
        assert jobs == {"j0": "98", "j1": "99"}
        notices = [m["error"]["what"] for m in socket.sent if m["type"] == "notice"]
        assert notices == [str(10 * k) for k in range(10)]

    run(scenario)


def test_a_change_for_all_is_answered_behind_the_state_that_it_made() -> None:
    """Also where an older state still waits for a page that takes nothing."""

    async def scenario(bench: Bench) -> None:
        socket = await bench.join()
        socket.flowing.clear()
        bench.hub.publish(SelectionMessage(selection=SelectionDoc()))
        await settled()
        for change, tool in enumerate(("home", "polygon", "landing")):
            bench.hub.publish(SelectionMessage(selection=SelectionDoc(tool=tool)))
            socket.says(SetSelection(selection=SelectionDoc(tool=tool), change=change).model_dump_json())
            await settled()
        socket.flowing.set()
        await settled()
        assert socket.types() == ["snapshot", "selection", "selection", "answered", "answered", "answered"]
        assert socket.sent[2]["selection"]["tool"] == "landing"
        assert [m["change"] for m in socket.sent[3:]] == [0, 1, 2]

    run(scenario)


def test_a_stalled_page_is_dropped_and_the_others_notice_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hub_module, "SEND_TIMEOUT_S", 0.05)

    async def scenario(bench: Bench) -> None:
        stalled, *others = [await bench.join() for _ in range(50)]
        stalled.flowing.clear()
        for revision in range(20):
            bench.hub.publish(PlanMessage(plan=plan_state(revision)))
            await settled()
            assert all(socket.sent[-1]["plan"]["revision"] == revision for socket in others)
        while stalled.close_code is None:
            await asyncio.sleep(0.01)
        assert stalled.close_code == CLOSE_SLOW
        while len(bench.hub._pages) > 49:
            await asyncio.sleep(0.01)
        assert len(bench.hub._pages) == 49

    run(scenario)


def test_a_page_whose_notices_pile_up_is_cut_off() -> None:
    async def scenario(bench: Bench) -> None:
        socket = await bench.join()
        socket.flowing.clear()
        for index in range(WAITING_MAX + 2):
            bench.hub.publish(notice(str(index)))
        socket.flowing.set()
        await settled()
        assert socket.close_code == CLOSE_SLOW

    run(scenario)


def test_a_message_to_one_page_reaches_only_that_one() -> None:
    async def scenario(bench: Bench) -> None:
        one, two = await bench.join(), await bench.join()
        bench.hub.send(one.sent[0]["page_id"], notice("for one"))
        bench.hub.send("gone", notice("for nobody"))
        await settled()
        assert (one.types(), two.types()) == (["snapshot", "notice"], ["snapshot"])

    run(scenario)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "not a JSON object"),
        ("[1]", "not a JSON object"),
        ("null", "not a JSON object"),
        ('{"type": "launch_missile"}', "'launch_missile' are unknown"),
        ('{"type": {"a": 1}}', "are unknown"),
        ('{"type": "hover_profile", "s_m": "x"}', "'hover_profile' was faulty"),
        ('{"type": "hover_profile", "s_m": 1, "more": 2}', "'hover_profile' was faulty"),
        ("[" * 5000, "not a JSON object"),
        ("x" * 70_000, "at most"),
    ],
)
def test_unreadable_messages_are_told_and_the_stream_goes_on(text: str, words: str) -> None:
    async def scenario(bench: Bench) -> None:
        socket = await bench.join()
        socket.says(text)
        socket.says('{"type": "hover_profile", "s_m": 1.5}')
        await settled()
        assert socket.types() == ["snapshot", "notice"]
        assert socket.sent[1]["level"] == "error"
        assert words in socket.sent[1]["error"]["what"]
        assert [message for _, message in bench.heard] == [HoverProfile(s_m=1.5)]
        assert socket.close_code is None

    run(scenario)


def test_a_ping_is_answered_with_the_servers_clock_and_goes_no_further() -> None:
    async def scenario(bench: Bench) -> None:
        socket, before_s = await bench.join(), time.monotonic()
        socket.says('{"type": "ping", "page_ms": 1234.5}')
        await settled()
        assert socket.types() == ["snapshot", "clock"]
        assert socket.sent[1]["page_ms"] == 1234.5
        assert before_s <= socket.sent[1]["now_mono_s"] <= time.monotonic()
        assert bench.heard == []

    run(scenario)


def test_bytes_are_no_message() -> None:
    with pytest.raises(ValueError, match="must be text"):
        parse(None)


def test_a_flood_closes_the_stream() -> None:
    async def scenario(bench: Bench) -> None:
        socket, calm = await bench.join(), await bench.join()
        for _ in range(int(hub_module.BURST) + 5000):
            socket.says('{"type": "hover_profile", "s_m": 1}')
        while socket.close_code is None:
            await asyncio.sleep(0.01)
        assert (socket.close_code, calm.close_code) == (CLOSE_POLICY, None)

    run(scenario)


def test_signing_out_closes_the_pages_of_that_session_only() -> None:
    async def scenario(bench: Bench) -> None:
        mine, other = await bench.join(session="mine"), await bench.join(session="other")
        bench.hub.close_session("mine")
        await settled()
        assert (mine.close_code, other.close_code) == (CLOSE_SIGNED_OUT, None)

    run(scenario)


def test_a_page_that_comes_back_is_the_one_that_it_was_to_its_own_session_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def whole(bench: Bench) -> None:
        first = await bench.join()
        page_id = first.sent[0]["page_id"]
        page = bench.hub.page(page_id)
        assert page is not None
        first.leaves()
        await settled()
        assert bench.hub.page(page_id) is None
        _, ends = bench.hub._left[page_id]
        stranger = await bench.join(session="other", page_id=page_id)
        assert stranger.sent[0]["page_id"] != page_id
        again = await bench.join(page_id=page_id)
        assert again.sent[0]["page_id"] == page_id
        assert ends.cancelled(), "its view stays with it"
        assert not page.view_over.is_set()
        faster = await bench.join(page_id=page_id)
        assert faster.sent[0]["page_id"] == page_id, "the old stream's end was not seen yet"
        again.leaves()
        await settled()
        assert bench.hub.page(page_id) is not None
        monkeypatch.setattr(hub_module, "VIEW_KEPT_S", 0.05)
        faster.leaves()
        await page.view_over.wait()
        late = await bench.join(page_id=page_id)
        assert late.sent[0]["page_id"] != page_id

    run(whole)


def test_signing_out_ends_the_view_of_a_page_whose_stream_has_just_broken_off() -> None:
    async def whole(bench: Bench) -> None:
        left, stays = await bench.join(session="out"), await bench.join(session="in")
        pages = [bench.hub.page(socket.sent[0]["page_id"]) for socket in (left, stays)]
        left.leaves()
        stays.leaves()
        await settled()
        bench.hub.close_session("out")
        assert [page is not None and page.view_over.is_set() for page in pages] == [True, False]
        bench.hub.close()
        assert all(page is not None and page.view_over.is_set() for page in pages)

    run(whole)


def test_an_expired_session_ends_its_stream() -> None:
    async def scenario(bench: Bench) -> None:
        socket = await bench.join(remaining_s=0.02)
        while socket.close_code is None:
            await asyncio.sleep(0.01)
        assert socket.close_code == CLOSE_SIGNED_OUT

    run(scenario)


def test_what_was_set_aside_is_told_to_every_page() -> None:
    async def scenario(bench: Bench) -> None:
        told = NoticeMessage(level="warning", error=ErrorDoc(code="storage", what="A plan could not be read."))
        bench.hub.greet_with([told])
        for socket in (await bench.join(), await bench.join()):
            assert socket.types() == ["snapshot", "notice"]

    run(scenario)


def test_live_and_replayed_vehicles_do_not_replace_each_other_and_words_all_arrive() -> None:
    def vehicle(source: Source) -> VehicleMessage:
        return VehicleMessage(source=source, now_mono_s=0.0, state=None, follow=None)

    async def scenario(bench: Bench) -> None:
        socket = await bench.join()
        socket.flowing.clear()
        bench.hub.publish(notice("taken out of the queue and stuck"))
        await settled()
        for number in range(5):
            bench.hub.publish(vehicle("live"))
            bench.hub.publish(vehicle("replay"))
            bench.hub.publish(TextMessage(source="live", text=VehicleText(0.0, 6, str(number))))
        socket.flowing.set()
        await settled()
        later = socket.sent[2:]
        assert [m["source"] for m in later if m["type"] == "vehicle"] == ["live", "replay"]
        assert [m["text"]["text"] for m in later if m["type"] == "text"] == ["0", "1", "2", "3", "4"]

    run(scenario)


def test_each_session_is_told_what_is_its_own() -> None:
    async def scenario(bench: Bench) -> None:
        anna, ben = await bench.join(session="anna"), await bench.join(session="ben")
        bench.hub.of_vehicle(1).publish_each(
            lambda session: LeaseMessage(lease=LeaseDoc(holder="Anna", mine=session == "anna"))
        )
        bench.hub.publish_to("ben", notice("for Ben"))
        await settled()
        assert [m["lease"]["mine"] for s in (anna, ben) for m in s.sent if m["type"] == "lease"] == [True, False]
        assert (anna.types().count("notice"), ben.types().count("notice")) == (0, 1)

    run(scenario)


def test_what_waits_about_a_vehicle_is_dropped_when_the_page_shows_another() -> None:
    page = Page("s")
    first, second = (LeaseMessage(lease=LeaseDoc(holder=name, mine=False)) for name in ("Anna", "Ben"))
    page.put(first, Outgoing(first), of_vehicle=True)
    page.put(notice("for all"), Outgoing(notice("for all")))
    page.turn_to(2)
    page.put(second, Outgoing(second), of_vehicle=True)
    waiting = [asyncio.run(page.next_text()) for _ in range(2)]
    assert ["for all" in waiting[0], "Ben" in waiting[1]] == [True, True]
    assert not page._waiting


def test_a_vehicle_s_words_go_only_to_pages_that_show_it() -> None:
    async def scenario(bench: Bench) -> None:
        told, other = await bench.join(), await bench.join()
        page = bench.hub.page(other.sent[0]["page_id"])
        assert page is not None
        page.turn_to(2)
        bench.hub.of_vehicle(1).publish(notice("of the first"))
        bench.hub.of_vehicle(2).publish(notice("of the second"))
        await settled()
        assert [told.sent[1]["error"]["what"], other.sent[1]["error"]["what"]] == ["of the first", "of the second"]
        assert (len(told.sent), len(other.sent)) == (2, 2)

    run(scenario)


def test_who_is_in_charge_of_a_vehicle_that_none_of_their_pages_shows_hears_that_it_is_asked_for(
    tmp_path: Path,
) -> None:
    async def scenario(bench: Bench) -> None:
        anna, ben = await bench.join(session="anna"), await bench.join(session="ben")
        for number, told in ((1, 0), (2, 1)):
            lease = Lease(tmp_path / f"{number}.json")
            operators = Operators(lease, bench.hub, number, f"Vehicle {number}")
            await operators.take("anna", "Anna")
            await operators.take("ben", "Ben")
            await settled()
            notices = [message["error"]["what"] for message in anna.sent if message["type"] == "notice"]
            assert len(notices) == told
        assert "Ben asks for control of Vehicle 2" in notices[0]
        assert "notice" not in ben.types()

    run(scenario)
