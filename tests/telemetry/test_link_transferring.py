"""Transfers of the link: a read-back that nobody asked for makes way, and the upload that follows is told of."""

# pyright: reportPrivateUsage=false
from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError, TelemetryError, TransferError
from telemetry.link.exchanges import Exchanges as RealExchanges
from telemetry.link.log_reading import LogReading
from telemetry.link.onboard import OnBoard
from telemetry.link.transferring import Transfers
from telemetry.mavlink.actions import Failed, Progress
from telemetry.topics.messages import TransferStatus
from telemetry.topics.onboard_lists import Item, OnboardMission, UploadReport
from telemetry.topics.parameters import Outcome, ParameterChange, ParameterWritten
from telemetry.topics.requests import Operator, Upload, UploadPlaces
from telemetry.topics.vehicle import VehicleState

KNOWN = OnboardMission((), None, None, None, "known")
REPORT = UploadReport(True, OnboardMission((), None, None, None, ""), (), (), 0.1)
FENCE = UploadPlaces(Operator("test", 1), "fence", (Item(5003, 0, (50.0, 0.0, 0.0, 0.0), 47.0, 8.0, 0.0),))


class Exchanges:
    """Machines that end when the test says so, or when they are cancelled."""

    def __init__(self) -> None:
        self.ends: dict[Any, asyncio.Future[object]] = {}

    async def run(self, machine: Any, *, progress: Any = lambda _: None) -> object:
        self.ends[machine] = asyncio.get_running_loop().create_future()
        progress(Progress("sending", 0, 1))
        return await self.ends[machine]

    def perform(self, machine: Any, actions: list[Any]) -> None:
        self.ends[machine].set_exception(next(a.error for a in actions if isinstance(a, Failed)))


HERE = VehicleState(1, 1, lat_deg=47.0, lon_deg=8.0)


def bench() -> tuple[Transfers, Exchanges, list[TransferStatus]]:
    exchanges, told = Exchanges(), []
    vehicle = SimpleNamespace(firmware="ardupilot", target=(1, 1), exchanges=exchanges, onboard=OnBoard())
    files = SimpleNamespace(give_way=lambda: None)
    return Transfers(cast(Any, vehicle), told.append, cast(Any, files)), exchanges, told


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


def test_the_vehicles_answers_to_an_upload_that_pushed_a_read_back_aside_are_nobody_elses() -> None:
    asyncio.run(_answers())


async def _answers() -> None:
    transfers, exchanges, _ = bench()
    onboard = transfers._vehicle.onboard
    reading = asyncio.create_task(transfers.read_back())
    await asyncio.sleep(0)
    sending = asyncio.create_task(transfers.upload(Upload(Operator("test", 1), FENCE.items, 47.0, 8.0, 400.0)))
    await asyncio.sleep(0)
    await asyncio.gather(reading, return_exceptions=True)
    onboard.mission = KNOWN
    request = mavlink.MAVLink_mission_request_int_message(255, 190, 0)
    assert not onboard.on_message(cast(Any, request), math.inf)
    exchanges.ends[transfers._machine].set_result(REPORT)
    await sending
    assert onboard.mission == REPORT.onboard
    onboard.mission = KNOWN
    assert onboard.on_message(cast(Any, request), math.inf), "after it they are of another station's transfer"


def test_the_fence_on_board_is_known_from_its_read_back_and_unknown_while_another_is_sent() -> None:
    asyncio.run(_fence_known())


async def _fence_known() -> None:
    transfers, exchanges, _ = bench()
    fence = transfers._vehicle.onboard.fence
    assert fence.unknown
    reading = asyncio.create_task(transfers.download_places("fence"))
    await asyncio.sleep(0)
    exchanges.ends.popitem()[1].set_result(replace(KNOWN, items=FENCE.items))
    await reading
    assert fence.unknown == ""
    assert fence.why_not(HERE, ((47.0, 8.0),) * 3) == ""  # in the middle of its inclusion
    fence.margin_m = 60.0
    there = (47.0004, 8.0)
    assert "leave inclusion circle 1" in fence.why_not(HERE, ((47.0, 8.0), (47.0006, 8.0), (47.0006, 8.0)))
    assert "come within 5.2 m" in fence.why_not(HERE, ((47.0, 8.0), there, there))
    sending = asyncio.create_task(transfers.upload_places(replace(FENCE, items=())))
    await asyncio.sleep(0)
    assert "since it was sent" in fence.unknown
    exchanges.ends.popitem()[1].set_result(REPORT)
    await sending
    assert fence.unknown == ""
    assert fence.why_not(HERE, ((47.0, 8.0), there, there)) == ""


def test_a_file_of_parameters_that_gives_way_to_an_upload_is_not_replaced_by_another_reading() -> None:
    asyncio.run(_file_gives_way())


async def _file_gives_way() -> None:
    sent: list[str] = []
    told: list[str] = []
    vehicle = SimpleNamespace(
        firmware="ardupilot",
        target=(1, 1),
        exchanges=RealExchanges(lambda message: sent.append(message.get_type()), lambda: 0.0),
        onboard=OnBoard(),
        state=VehicleState(1, 1, autopilot="ardupilot", heartbeat_t_mono_s=1.0),
        capabilities=mavlink.MAV_PROTOCOL_CAPABILITY_FTP,
        wait_until=AsyncMock(),
        tell=lambda _, text: told.append(text),
    )
    transfers = Transfers(cast(Any, vehicle), lambda _: None, LogReading(cast(Any, vehicle)))
    for _ in range(2):
        reading = asyncio.create_task(transfers.list_parameters())
        while sent[-1:] != ["FILE_TRANSFER_PROTOCOL"]:
            await asyncio.sleep(0)
        sending = asyncio.create_task(transfers.upload_places(FENCE))
        with pytest.raises(TransferError, match="a mission is being transferred"):
            await reading
        assert sent[-1] == "MISSION_COUNT"
        assert "PARAM_REQUEST_LIST" not in sent
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
    assert told == []


@pytest.mark.parametrize(("outcome", "is_known"), [("not sent", True), ("unknown", False)])
def test_a_change_of_the_fence_that_was_not_sent_takes_nothing_from_what_is_known(
    outcome: Outcome, is_known: bool
) -> None:
    asyncio.run(_written(outcome, is_known))


async def _written(outcome: Outcome, is_known: bool) -> None:
    transfers, exchanges, _ = bench()
    fence = transfers._vehicle.onboard.fence
    fence.take({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 1.0, "FENCE_ALT_MAX": 60.0, "FENCE_ALT_MAX_TP": None})
    cast(Any, transfers._vehicle).sends_integers_bytewise = False
    writing = asyncio.create_task(
        transfers.write_parameters((ParameterChange("FENCE_ALT_MAX", 90.0),), even_armed=False)
    )
    await asyncio.sleep(0)
    exchanges.ends.popitem()[1].set_result((ParameterWritten("FENCE_ALT_MAX", 90.0, None, None, outcome),))
    await writing
    assert (fence.highest_m == 60.0) is is_known
    assert (fence.unread(None) == "") is is_known
