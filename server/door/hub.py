"""The ``/ws`` streams to the browsers: one bounded queue per page, so that a stalled page holds up no other.

State (plan, library, view, selection, cursor, each job, each vehicle, each sensor) is latest-wins: a newer message
takes the place of the one still waiting. Notices, alerts and the vehicle's own words must arrive: each waits on its
own, and a page that lets the queue fill up is cut off, as is one that takes nothing for five seconds. It reconnects,
starts from a fresh snapshot and goes on with the 3D view that it had. What a page changes for all is answered behind
the new state, so that it can tell older states from its own.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping

from pydantic import TypeAdapter, ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from server import schemas
from server.door.page import CLOSE_GOING_AWAY, CLOSE_POLICY, CLOSE_SIGNED_OUT, CLOSE_SLOW, Outgoing, Page
from server.errors import ASK_OPERATOR, BusyError, NotFoundError, ObserverError, error_doc
from server.schemas.station_docs import FIRST_VEHICLE
from server.work.bucket import Bucket
from server.work.task_group import until_first

log = logging.getLogger("hedgehop.hub")

PAGES_MAX = 200
SEND_TIMEOUT_S, CLOSE_TIMEOUT_S = 120.0, 5.0
"""A large message over a slow line takes long; a line that takes nothing is cut much sooner (``slow_lines``)."""
VIEW_KEPT_S = 15.0
"""Of a page whose stream has ended and may come back. To draw it anew costs most where the line is bad already."""
MESSAGE_LIMIT_CHARS = 64 * 1024
RATE_PER_S, BURST = 120.0, 600.0

_CLIENT_MESSAGE: TypeAdapter[schemas.ClientMessage] = TypeAdapter(schemas.ClientMessage)
OBSERVERS_MAY = (schemas.FrameView, schemas.HoldCamera, schemas.ChooseVehicle, schemas.Ping)
"""What moves nothing but this page's own camera, or chooses what it shows."""
_CLIENT_TYPES = (
    "hover_profile",
    "hover_view",
    "set_view",
    "set_selection",
    "frame_view",
    "hold_camera",
    "choose_vehicle",
    "ping",
)

OfVehicle = Callable[[int], Iterable[schemas.ServerMessage]]
"""All that is known of the vehicle of this number; raises NotFoundError."""
OnMessage = Callable[[str, schemas.ClientMessage], Awaitable[None]]


class Hub:
    """All pages. Every method belongs to the event loop's thread."""

    def __init__(self) -> None:
        self._pages: dict[str, Page] = {}
        self._left: dict[str, tuple[Page, asyncio.TimerHandle]] = {}
        self._is_closed = False
        self._greetings: list[schemas.NoticeMessage] = []

    def greet_with(self, notices: list[schemas.NoticeMessage]) -> None:
        """Notices that every page gets after its first snapshot."""
        self._greetings = list(notices)

    def page(self, page_id: str) -> Page | None:
        return self._pages.get(page_id)

    def session_keys(self, *, heard_within_s: float = float("inf")) -> set[str]:
        """Of the pages that are open, and say so: each does every second."""
        since = time.monotonic() - heard_within_s
        return {page.session_key for page in self._pages.values() if page.heard_mono_s >= since}

    def publish(self, message: schemas.ServerMessage) -> None:
        """To every page; never waits."""
        outgoing = Outgoing(message)
        for page in list(self._pages.values()):
            page.put(message, outgoing)

    def of_vehicle(self, number: int) -> VehiclePages:
        return VehiclePages(self._pages, number)

    def publish_to(self, session_key: str, message: schemas.ServerMessage) -> None:
        """To every page of one session."""
        outgoing = Outgoing(message)
        for page in list(self._pages.values()):
            if page.session_key == session_key:
                page.put(message, outgoing)

    def send(self, page_id: str, message: schemas.ServerMessage) -> None:
        """To one page; nothing happens when it has gone."""
        if page := self._pages.get(page_id):
            page.put(message, Outgoing(message))

    def notify(self, page_id: str, error: Exception) -> None:
        """Tells one page why what it asked for did not happen."""
        self.send(page_id, schemas.NoticeMessage(level="error", error=error_doc(error)))

    def close_session(self, session_key: str) -> None:
        """Cuts off the pages of a session that was signed out, and the views of those whose stream had just ended."""
        for page in list(self._pages.values()):
            if page.session_key == session_key:
                page.cut_off(CLOSE_SIGNED_OUT)
        for page, _ in list(self._left.values()):
            if page.session_key == session_key:
                self._end_view(page)

    def close(self) -> None:
        self._is_closed = True
        for page in list(self._pages.values()):
            page.cut_off(CLOSE_GOING_AWAY)
        for page, _ in list(self._left.values()):
            self._end_view(page)

    def _comes(self, session_key: str, page_id: str | None, *, may_change: bool) -> Page:
        """The page that it was a moment ago, if its session says so: its 3D view has stayed."""
        known = self._left[page_id][0] if page_id in self._left else self._pages.get(page_id or "")
        is_known = known is not None and (known.session_key, known.may_change) == (session_key, may_change)
        before = known if is_known else None
        if before is not None:
            before.cut_off(CLOSE_SLOW)
            self._stays(before)
        page = Page(session_key, may_change=may_change, before=before)
        self._pages[page.page_id] = page
        return page

    def _leaves(self, page: Page) -> None:
        page.cut_off(CLOSE_GOING_AWAY)
        if self._pages.get(page.page_id) is not page:
            return  # it has come back before its old stream was seen to end
        del self._pages[page.page_id]
        may_return = page.close_code in (CLOSE_SLOW, CLOSE_GOING_AWAY) and len(self._left) < PAGES_MAX
        if self._is_closed or not may_return:
            page.view_over.set()
            return
        ends = asyncio.get_running_loop().call_later(VIEW_KEPT_S, self._end_view, page)
        self._left[page.page_id] = page, ends

    def _stays(self, page: Page) -> None:
        if (left := self._left.pop(page.page_id, None)) is not None:
            left[1].cancel()

    def _end_view(self, page: Page) -> None:
        self._stays(page)
        page.view_over.set()

    async def serve(
        self,
        websocket: WebSocket,
        *,
        session_key: str,
        session_remaining_s: float,
        page_id: str | None = None,
        may_change: bool = True,
        snapshot: Callable[[str], schemas.Snapshot],
        present: Callable[[], Iterable[schemas.ServerMessage]] = tuple,
        on_message: OnMessage,
        vehicle: int = FIRST_VEHICLE,
        of_vehicle: OfVehicle | None = None,
    ) -> None:
        """Runs one accepted socket until either side ends it; ``present`` is what follows the snapshot at once.

        ``page_id``: of the page's stream before this one, whose 3D view it would go on with; ``vehicle``: the one that
        it showed.
        """
        if len(self._pages) >= PAGES_MAX:
            raise BusyError(f"{PAGES_MAX} pages are open already.", advice="Close some of them.")
        page = self._comes(session_key, page_id, may_change=may_change)
        try:
            # Taken in the same step as the registration: no change can fall between snapshot and deltas.
            self.send(page.page_id, snapshot(page.page_id))
            for message in (*self._greetings, *present()):
                self.send(page.page_id, message)
            if of_vehicle is not None:
                try:
                    _show(page, vehicle, of_vehicle)
                except NotFoundError:
                    _show(page, FIRST_VEHICLE, of_vehicle)
            await until_first(
                self._sender(websocket, page),
                self._receiver(websocket, page, on_message, of_vehicle),
                _wait(page.gone, session_remaining_s, page),
            )
        finally:
            self._leaves(page)
            await _close(websocket, page.close_code)

    async def _sender(self, websocket: WebSocket, page: Page) -> None:
        while True:
            text = await page.next_text()
            try:
                async with asyncio.timeout(SEND_TIMEOUT_S):
                    await websocket.send_text(text)
            except TimeoutError:
                log.warning("Page %s took no message for %g s and was dropped.", page.page_id, SEND_TIMEOUT_S)
                page.cut_off(CLOSE_SLOW)
                return
            except (WebSocketDisconnect, RuntimeError):
                return

    async def _receiver(
        self, websocket: WebSocket, page: Page, on_message: OnMessage, of_vehicle: OfVehicle | None
    ) -> None:
        bucket = Bucket(RATE_PER_S, BURST, time.monotonic())
        while True:
            received = await websocket.receive()
            if received["type"] == "websocket.disconnect":
                return
            page.heard_mono_s = time.monotonic()
            allowed = bucket.left(time.monotonic()) >= 1.0
            bucket.spend(1.0)
            if not allowed:
                log.warning("Page %s sent too many messages and was dropped.", page.page_id)
                page.cut_off(CLOSE_POLICY)
                return
            await self._handle(received.get("text"), page, on_message, of_vehicle)

    async def _handle(self, text: str | None, page: Page, on_message: OnMessage, of_vehicle: OfVehicle | None) -> None:
        try:
            message = parse(text)
        except ValueError as error:
            self.send(page.page_id, _unreadable(error))
            return
        if isinstance(message, schemas.Ping):
            clock = schemas.ClockMessage(page_ms=message.page_ms, now_mono_s=time.monotonic())
            self.send(page.page_id, clock)
            return
        try:
            if isinstance(message, schemas.ChooseVehicle):
                if of_vehicle is not None:
                    _show(page, message.vehicle, of_vehicle)
            elif page.may_change or isinstance(message, OBSERVERS_MAY):
                await on_message(page.page_id, message)
            elif not isinstance(message, schemas.HoverProfile | schemas.HoverView):  # a pointer is no wish
                raise ObserverError("Observers see everything and change nothing.", advice=ASK_OPERATOR)
        except Exception as error:
            notice = error_doc(error)
            if notice.code == "internal":
                log.exception("Message %s of page %s failed.", message.type, page.page_id)
            self.send(page.page_id, schemas.NoticeMessage(level="error", error=notice))
        if isinstance(message, schemas.SetView | schemas.SetSelection):
            self.send(page.page_id, schemas.AnsweredMessage(change=message.change))


class VehiclePages:
    """The pages that show one vehicle. Every method belongs to the event loop's thread."""

    def __init__(self, pages: Mapping[str, Page], number: int) -> None:
        self._pages, self._number = pages, number

    def publish(self, message: schemas.ServerMessage) -> None:
        outgoing = Outgoing(message)
        for page in self._shown():
            page.put(message, outgoing, of_vehicle=True)

    def publish_each(self, make: Callable[[str], schemas.ServerMessage]) -> None:
        """To each of them, what its session (by ``server.door.auth.session_key``) may know."""
        for page in self._shown():
            message = make(page.session_key)
            page.put(message, Outgoing(message), of_vehicle=True)

    def are_of(self, session_key: str) -> bool:
        """Whether this session has one of them."""
        return any(page.session_key == session_key for page in self._shown())

    def _shown(self) -> list[Page]:
        return [page for page in self._pages.values() if page.vehicle == self._number]


def _show(page: Page, number: int, of_vehicle: OfVehicle) -> None:
    """In one step: no change of the vehicle can fall between what is known of it and what follows."""
    known = list(of_vehicle(number))
    page.turn_to(number)
    for message in (schemas.ActiveMessage(vehicle=number), *known):
        page.put(message, Outgoing(message), of_vehicle=True)


def parse(text: str | None) -> schemas.ClientMessage:
    """Raises ``ValueError`` with one sentence for the operator's eyes."""
    if text is None or len(text) > MESSAGE_LIMIT_CHARS:
        raise ValueError(f"A message must be text of at most {MESSAGE_LIMIT_CHARS} characters.")
    try:
        return _CLIENT_MESSAGE.validate_json(text)
    except ValidationError as error:
        raise ValueError(_fault(text, error)) from None


def _fault(text: str, error: ValidationError) -> str:
    try:
        kind = json.loads(text)["type"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return "A message was not a JSON object with a type."
    if kind not in _CLIENT_TYPES:
        return f"Messages of type {str(kind)[:40]!r} are unknown."
    return f"A message of type {kind!r} was faulty: {error.errors()[0]['msg']}."


def _unreadable(error: ValueError) -> schemas.NoticeMessage:
    doc = schemas.ErrorDoc(
        code="unknown_message", what=str(error), advice="Reload the page: it may be older than the server."
    )
    return schemas.NoticeMessage(level="error", error=doc)


async def _wait(gone: asyncio.Event, session_remaining_s: float, page: Page) -> None:
    try:
        async with asyncio.timeout(session_remaining_s):
            await gone.wait()
    except TimeoutError:
        page.cut_off(CLOSE_SIGNED_OUT)


async def _close(websocket: WebSocket, code: int) -> None:
    if WebSocketState.DISCONNECTED in (websocket.application_state, websocket.client_state):
        return
    with contextlib.suppress(RuntimeError, WebSocketDisconnect, TimeoutError):
        async with asyncio.timeout(CLOSE_TIMEOUT_S):
            await websocket.close(code)
