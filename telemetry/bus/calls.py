"""Calls over the bus: exactly one answer, the handler's errors raised at the caller, nothing ever sent twice."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar, cast

import zenoh

from planning.errors import DescribedError
from telemetry.bus.encoding import (
    decode_answer,
    decode_request,
    encode_answer,
    encode_failure,
    encode_request,
)
from telemetry.errors import BusError
from telemetry.topics.messages import ErrorInfo

_log = logging.getLogger(__name__)

T = TypeVar("T")

_CALLS = "call/"
_LOOK_EVERY_S = 0.02
_AT_A_TIME = 64


class Answers:
    """Carries out the requests to one name. At most 64 at a time; more are refused."""

    def __init__(
        self, session: zenoh.Session, name: str, handler: Callable[[Any], Awaitable[object]], requests: Any
    ) -> None:
        self._name = name
        self._handler = handler
        self._requests = requests
        self._loop = asyncio.get_running_loop()
        self._running: set[asyncio.Task[None]] = set()
        self._queryable = session.declare_queryable(_CALLS + name, self._on_query, complete=True)

    async def close(self) -> None:
        self._queryable.undeclare()
        for task in self._running:
            task.cancel()
        await asyncio.gather(*self._running, return_exceptions=True)

    def _on_query(self, query: zenoh.Query) -> None:
        """Called by a thread of Zenoh."""
        with contextlib.suppress(RuntimeError):  # the loop has ended: the caller learns that nobody answered
            self._loop.call_soon_threadsafe(self._begin, query)

    def _begin(self, query: zenoh.Query) -> None:
        task = self._loop.create_task(self._answer(query), name=f"call to {self._name}")
        self._running.add(task)
        task.add_done_callback(self._running.discard)

    async def _answer(self, query: zenoh.Query) -> None:
        with query:
            payload = await self._outcome(query.payload.to_bytes() if query.payload else b"")
            try:
                query.reply(query.key_expr, payload)
            except zenoh.ZError as error:
                _log.warning("An answer of %s did not reach its caller: %s", self._name, error)

    async def _outcome(self, payload: bytes) -> bytes:
        try:
            if len(self._running) > _AT_A_TIME:
                raise BusError(f"{self._name} is still busy with {_AT_A_TIME} requests.", advice="Try again later.")
            return encode_answer(await self._handler(decode_request(payload, self._requests)))
        except DescribedError as error:
            return encode_failure(ErrorInfo.of(error))
        except Exception:
            _log.exception("A request to %s failed", self._name)
            return encode_failure(ErrorInfo.of(_unforeseen(self._name)))


async def call(
    session: zenoh.Session, name: str, request: object, result: type[T], timeout_s: float, appears_s: float
) -> T:
    """See ``Bus.call``."""
    loop = asyncio.get_running_loop()
    deadline_s = loop.time() + timeout_s
    appears_by_s = loop.time() + min(appears_s, timeout_s)
    payload = encode_request(request)
    querier = session.declare_querier(
        _CALLS + name,
        timeout=timeout_s,
        priority=zenoh.Priority.INTERACTIVE_HIGH,
        congestion_control=zenoh.CongestionControl.BLOCK,
        consolidation=zenoh.ConsolidationMode.NONE,
    )
    try:
        async with asyncio.timeout_at(deadline_s):
            # Asking before somebody is there to answer would mean asking again, and so perhaps twice.
            while not _is_there(querier):
                if loop.time() > appears_by_s:
                    raise TimeoutError
                await asyncio.sleep(_LOOK_EVERY_S)
            return decode_answer(await _ask(querier, name, payload), result)
    except TimeoutError:
        raise _silent(name, timeout_s, there=_is_there(querier)) from None
    finally:
        querier.undeclare()


async def _ask(querier: zenoh.Querier, name: str, payload: bytes) -> bytes:
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[bytes] = loop.create_future()

    def settle(found: bytes | None) -> None:
        if answer.done():
            return
        if found is None:
            answer.set_exception(_gone(name))
        else:
            answer.set_result(found)

    def hand_over(found: bytes | None) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended, and the caller with it
            loop.call_soon_threadsafe(settle, found)

    def on_reply(reply: zenoh.Reply) -> None:
        if reply.ok:
            hand_over(reply.ok.payload.to_bytes())

    querier.get(zenoh.handlers.Callback(on_reply, lambda: hand_over(None)), payload=payload)
    return await answer


def _is_there(querier: zenoh.Querier) -> bool:
    # The type stub says bool; the object that comes is true whatever it says.
    return cast(zenoh.MatchingStatus, querier.matching_status).matching


def _unforeseen(name: str) -> BusError:
    return BusError(f"{name} failed on this request.", advice=f"Its log ({name}.log) says more.")


def _gone(name: str) -> BusError:
    return BusError(
        f"{name} ended before it answered.",
        advice="What was asked may have been done all the same: look before you repeat.",
    )


def _silent(name: str, timeout_s: float, *, there: bool) -> BusError:
    if there:
        return BusError(
            f"{name} did not answer within {timeout_s:g} s.",
            advice="What was asked may still be done: look before you repeat.",
        )
    return BusError(
        f"{name} is not running.",
        advice="It is started again if it ended; try again in some seconds. Until then: the transmitter.",
    )
