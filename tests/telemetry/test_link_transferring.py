"""Transfers of the link: a read-back that nobody asked for makes way, and the upload that follows is told of."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any, cast

import pytest

from telemetry.errors import NotAllowedError, TelemetryError
from telemetry.link.transferring import Transfers
from telemetry.mavlink.actions import Failed, Progress
from telemetry.topics.messages import Item, OnboardMission, TransferStatus, UploadReport
from telemetry.topics.requests import Operator, UploadPlaces

REPORT = UploadReport(True, OnboardMission((), None, None, None, ""), (), (), 0.1)
FENCE = UploadPlaces(Operator("test", 1), "fence", (Item(5003, 0, (50.0, 0.0, 0.0, 0.0), 47.0, 8.0, 0.0),))


class Exchanges:
    """Machines that end when the test says so, or when they are cancelled."""

    def __init__(self) -> None:
        self.ends: dict[Any, asyncio.Future[object]] = {}

    async def run(self, machine: Any, *, progress: Any) -> object:
        self.ends[machine] = asyncio.get_running_loop().create_future()
        progress(Progress("sending", 0, 1))
        return await self.ends[machine]

    def perform(self, machine: Any, actions: list[Any]) -> None:
        self.ends[machine].set_exception(next(a.error for a in actions if isinstance(a, Failed)))


def bench() -> tuple[Transfers, Exchanges, list[TransferStatus]]:
    exchanges, told = Exchanges(), []
    onboard = SimpleNamespace(transfer_begins=lambda replaces: None, transfer_ends=lambda mission, now_s: None)
    vehicle = SimpleNamespace(firmware="ardupilot", target=(1, 1), exchanges=exchanges, onboard=onboard)
    return Transfers(cast(Any, vehicle), told.append), exchanges, told


def test_an_upload_that_pushes_a_read_back_aside_is_told_of_and_is_not_pushed_aside_itself() -> None:
    asyncio.run(_pushed_aside())


async def _pushed_aside() -> None:
    transfers, exchanges, told = bench()
    reading = asyncio.create_task(transfers.read_back())
    await asyncio.sleep(0)
    assert transfers.is_busy
    assert told == []
    sending = asyncio.create_task(transfers.upload_places(FENCE))
    await asyncio.sleep(0)
    with pytest.raises(TelemetryError, match="cancelled"):
        await reading
    assert [(status.direction, status.phase) for status in told] == [("upload", "sending")]
    with pytest.raises(NotAllowedError, match="already"):
        await transfers.upload_places(FENCE)
    list(exchanges.ends.values())[-1].set_result(REPORT)
    assert await sending is REPORT
    assert [status.phase for status in told] == ["sending", "done"]
    assert not transfers.is_busy
