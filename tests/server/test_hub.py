"""Bounded queues, latest-wins, notices that arrive, and stalled pages that hold up nobody (R13, R14)."""

from __future__ import annotations

import asyncio
import time

import pytest

from server.door import hub as hub_module
from server.door.hub import parse
from server.door.page import CLOSE_POLICY, CLOSE_SLOW, WAITING_MAX
from server.schemas import (
    CursorMessage,
    ErrorDoc,
    HoverProfile,
    JobDoc,
    JobMessage,
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
from tests.server.fakes import notice, plan_state
from tests.server.hub_bench import Bench, run, settled


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
