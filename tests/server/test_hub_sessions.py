"""What each session and each vehicle's pages are told, and when a page is over."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from server.door import hub as hub_module
from server.door.lease import Lease
from server.door.operators import Operators
from server.door.page import CLOSE_SIGNED_OUT, Outgoing, Page
from server.schemas import LeaseDoc, LeaseMessage
from tests.server.fakes import notice
from tests.server.hub_bench import Bench, run, settled


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
    assert (page._urgent, page._others) == ({}, {})


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
