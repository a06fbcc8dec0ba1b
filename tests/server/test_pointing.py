"""A click with a tool that asks where: it edits nothing."""

from __future__ import annotations

import asyncio
from typing import Any, Literal, cast

import pytest

from server.plan.plan_desk import PlanDesk, Proposal
from server.plan.pointing import Pointing
from server.schemas import NoticeMessage, PlaceDoc, PlanDoc, SelectionDoc


class _Desk:
    """Notes what it is asked to change."""

    def __init__(self) -> None:
        self.document = PlanDoc()
        self.proposals: list[Proposal] = []

    async def propose(self, proposal: Proposal) -> None:
        self.proposals.append(proposal)


class _Hand:
    """A tool in hand, over a plan without anything."""

    is_review = False

    def __init__(self, tool: SelectionDoc) -> None:
        self.desk, self.selection = _Desk(), tool
        self.notices: list[NoticeMessage] = []
        me: Any = self
        self._pointing = Pointing(cast(PlanDesk, self.desk), me, me)

    def select(self, selection: SelectionDoc) -> None:
        self.selection = selection

    def publish(self, message: NoticeMessage) -> None:
        self.notices.append(message)

    def click(self, *, known: bool = True) -> None:
        asyncio.run(self._pointing.on_terrain(37.73, 14.99, known=known))


@pytest.mark.parametrize("tool", ["landing", "there"])
def test_the_place_is_told_with_the_tool_put_down_and_the_plan_stays(tool: Literal["landing", "there"]) -> None:
    hand = _Hand(SelectionDoc(tool=tool))
    hand.click()
    assert hand.selection == SelectionDoc(tool="select", place=PlaceDoc(lat_deg=37.73, lon_deg=14.99))
    assert hand.desk.proposals == []


def test_on_unknown_ground_the_tool_stays_in_hand_and_that_is_said() -> None:
    hand = _Hand(SelectionDoc(tool="landing"))
    hand.click(known=False)
    assert hand.selection.tool == "landing"
    assert [notice.level for notice in hand.notices] == ["warning"]


def test_without_a_tool_a_click_does_nothing() -> None:
    hand = _Hand(SelectionDoc())
    hand.click()
    assert hand.selection == SelectionDoc()
    assert (hand.desk.proposals, hand.notices) == ([], [])


def test_other_tools_propose_an_edit() -> None:
    hand = _Hand(SelectionDoc(tool="home"))
    hand.click()
    assert len(hand.desk.proposals) == 1
    assert hand.selection.tool == "home"
