"""The sensor link: the one way in for a companion computer's radar frames and point clouds (docs/agent.md)."""

from __future__ import annotations

import asyncio
import logging
import time

from fastapi import APIRouter, WebSocket
from starlette.websockets import WebSocketDisconnect

from server.api.access import Need, needs, parts_of
from server.door.sensor_token import is_token, sensor_token
from server.errors import BusyError
from server.heard.agents import Agents
from server.work.task_group import until_first
from telemetry.agent.intake import Intake
from telemetry.agent.link_messages import PATH, SUBPROTOCOL, encode
from telemetry.errors import SensorLinkError

log = logging.getLogger("hedgehop.sensors")
router = APIRouter()

REPORT_EVERY_S = 1.0
SILENT_S = 10.0
"""An agent asks for the time every second."""
CLOSE_PROTOCOL, CLOSE_REFUSED, CLOSE_TRY_LATER = 1002, 1008, 1013


@router.websocket(PATH)
@needs(Need.NOTHING)
async def frames(websocket: WebSocket) -> None:
    """One agent, with a token of its own. The guard has refused foreign hosts and origins before this."""
    parts = parts_of(websocket)
    scheme, _, given = websocket.headers.get("authorization", "").partition(" ")
    secret = await asyncio.to_thread(sensor_token, parts.library.root)
    if scheme.lower() != "bearer" or not is_token(given.strip(), secret):
        log.warning("An agent was refused: its token is wrong.")
        await websocket.close(CLOSE_REFUSED)
        return
    offered = websocket.scope.get("subprotocols", [])
    await websocket.accept(SUBPROTOCOL if SUBPROTOCOL in offered else None)
    intake, agents = Intake(), parts.fleet.first.agents
    try:
        with agents.connected(intake):
            await until_first(_take(websocket, intake, agents), _report(websocket, intake))
    except BusyError as error:
        log.warning("An agent was sent away: %s", error)
        await websocket.close(CLOSE_TRY_LATER, error.what)
    except SensorLinkError as error:
        log.warning("Agent %r: %s", intake.name, error)
        await websocket.close(CLOSE_PROTOCOL, error.what[:100])
    except (WebSocketDisconnect, TimeoutError):
        log.info("Agent %r has gone: %d frames, %d lost.", intake.name, intake.received, intake.lost)


async def _take(websocket: WebSocket, intake: Intake, agents: Agents) -> None:
    while True:
        async with asyncio.timeout(SILENT_S):
            data = await _received(websocket)
        taken = intake.on_data(data, now_mono_s=time.monotonic(), now_utc_s=time.time())
        if taken.answer is not None:
            await websocket.send_bytes(encode(taken.answer))
        for told in (taken.frame, taken.notice):
            if told is not None:
                agents.publish(told)


async def _received(websocket: WebSocket) -> bytes:
    """Text is nothing that an agent sends: it is refused and counted as other bytes are."""
    message = await websocket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message["code"])
    return message.get("bytes") or (message.get("text") or "").encode()


async def _report(websocket: WebSocket, intake: Intake) -> None:
    while True:
        await asyncio.sleep(REPORT_EVERY_S)
        if intake.name:
            await websocket.send_bytes(encode(intake.report(time.monotonic())))
