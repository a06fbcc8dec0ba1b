"""Calls over the bus: results, the handler's errors at the caller, time limits, nobody there, many at once."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from planning.errors import CapacityError, DescribedError
from telemetry.bus.bus import Bus
from telemetry.bus.encoding import encode, error_of
from telemetry.errors import BusError, MissionUnknownError, RefusedError, SilentError
from telemetry.topics.messages import ErrorInfo
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.recording_requests import Play, StartRecording, StopRecording
from telemetry.topics.requests import Arm, Connect, Download, LinkRequest, Operator, Pause, ReadParameters, Upload
from tests.telemetry.bus_runs import run, short_folder

OPERATOR = Operator("Ada", 7)
ARM = Arm(OPERATOR)
Handler = Callable[[Any], Awaitable[object]]


@pytest.fixture
def folder() -> Iterator[Path]:
    with short_folder() as short:
        yield short / "run"


def with_link(folder: Path, handler: Handler, use: Callable[[Bus], Awaitable[object]]) -> None:
    """`use` gets the server's bus while a link node answers with `handler`."""

    async def whole() -> None:
        async with await Bus.open(folder, "link") as link, await Bus.open(folder, "server") as server:
            await link.serve("link", handler, LinkRequest)
            await use(server)

    run(whole)


def test_the_request_arrives_as_it_is_and_so_does_the_result(folder: Path) -> None:
    item = Item(16, 3, (0.0, None, 2.5, None), -37.1, 175.6, 12.25)
    requests = [
        ARM,
        Connect(OPERATOR, "udpin:0.0.0.0:14550", adopt=True),
        Upload(OPERATOR, (item,) * 650, -37.1, 175.6, 803.15),
        ReadParameters(("RTL_ALT", "WPNAV_SPEED")),
    ]
    found = []
    mission = OnboardMission((item,) * 650, -37.1, None, 803.15, "digest")

    async def handler(request: Any) -> object:
        found.append(request)
        return mission

    async def use(server: Bus) -> None:
        for request in requests:
            assert await server.call("link", request, result=OnboardMission) == mission

    with_link(folder, handler, use)
    assert found == requests


@pytest.mark.parametrize(
    ("result", "kind"),
    [(None, type(None)), ("name", str), ({"RTL_ALT": 3000.0, "NOT_THERE": None}, dict[str, float | None])],
)
def test_plain_results(folder: Path, result: object, kind: Any) -> None:
    async def handler(request: Any) -> object:
        return result

    async def use(server: Bus) -> None:
        assert await server.call("link", ARM, result=kind) == result

    with_link(folder, handler, use)


@pytest.mark.parametrize(
    "error",
    [
        RefusedError("Arming was refused.", where="the vehicle", advice="It says: PreArm: Compass."),
        MissionUnknownError("Nobody knows what is on board."),
        SilentError("No answer."),
        CapacityError("Too many items."),
        BusError("The bus."),
    ],
)
def test_the_handlers_error_is_raised_at_the_caller(folder: Path, error: DescribedError) -> None:
    async def handler(request: Any) -> object:
        raise error

    async def use(server: Bus) -> None:
        with pytest.raises(DescribedError) as caught:
            await server.call("link", ARM, result=type(None))
        assert type(caught.value) is type(error)
        assert ErrorInfo.of(caught.value) == ErrorInfo.of(error)

    with_link(folder, handler, use)


def test_an_error_of_an_unknown_class_is_a_bus_error() -> None:
    error = error_of(ErrorInfo("of_tomorrow", "Something.", "there", "Do this."))
    assert type(error) is BusError
    assert str(error) == "there: Something. Do this."


def test_an_unforeseen_error_is_logged_there_and_not_described_here(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def handler(request: Any) -> object:
        raise KeyError("secret")

    async def use(server: Bus) -> None:
        with pytest.raises(BusError) as caught:
            await server.call("link", ARM, result=type(None))
        assert "secret" not in str(caught.value)
        assert "link failed" in str(caught.value)

    with caplog.at_level(logging.ERROR), _expected_errors(caplog):
        with_link(folder, handler, use)
    assert "KeyError: 'secret'" in caplog.text


def test_a_result_that_cannot_travel_is_the_handlers_failure(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def handler(request: Any) -> object:
        return object()

    async def use(server: Bus) -> None:
        with pytest.raises(BusError, match="link failed"):
            await server.call("link", ARM, result=type(None))

    with _expected_errors(caplog):
        with_link(folder, handler, use)


def test_a_request_that_is_not_understood_is_refused(folder: Path) -> None:
    async def handler(request: Any) -> object:
        return None

    async def use(server: Bus) -> None:
        with pytest.raises(BusError, match="'StartRecording' is not understood"):
            await server.call("link", StartRecording(), result=str)
        with pytest.raises(BusError, match="cannot be understood"):
            await server.call("link", Arm("no operator"), result=str)  # type: ignore[arg-type]

    with_link(folder, handler, use)


def test_a_result_of_another_type_is_noticed(folder: Path) -> None:
    async def handler(request: Any) -> object:
        return 5

    async def use(server: Bus) -> None:
        with pytest.raises(BusError, match="cannot be understood"):
            await server.call("link", ARM, result=str)

    with_link(folder, handler, use)


def test_nobody_there(folder: Path) -> None:
    async def whole() -> None:
        async with await Bus.open(folder, "server") as server:
            with pytest.raises(BusError, match=r"replay is not running"):
                await server.call("replay", Play(True), result=type(None), timeout_s=0.3)

    run(whole)


def test_who_takes_too_long_is_told_of_once(folder: Path) -> None:
    asked = []

    async def handler(request: Any) -> object:
        asked.append(request)
        await asyncio.Event().wait()
        return None

    async def use(server: Bus) -> None:
        with pytest.raises(BusError, match=r"link did not answer within 0\.5 s"):
            await server.call("link", ARM, result=type(None), timeout_s=0.5)

    with_link(folder, handler, use)
    assert asked == [ARM]


def test_who_ends_while_it_is_asked(folder: Path) -> None:
    async def whole() -> None:
        asked = asyncio.Event()

        async def handler(request: Any) -> object:
            asked.set()
            await asyncio.Event().wait()
            return None

        async with await Bus.open(folder, "server") as server:
            link = await Bus.open(folder, "link")
            await link.serve("link", handler, LinkRequest)
            async with asyncio.TaskGroup() as group:
                call = group.create_task(_failure(server.call("link", ARM, result=type(None), timeout_s=60)))
                await asked.wait()
                await link.close()
            assert "link ended before it answered" in str(call.result())

    run(whole)


def test_a_call_waits_for_a_node_that_is_just_starting(folder: Path) -> None:
    async def whole() -> None:
        async def handler(request: Any) -> object:
            return "a.mcap"

        async with await Bus.open(folder, "server") as server, asyncio.TaskGroup() as group:
            call = group.create_task(server.call("recorder", StartRecording(), result=str, timeout_s=60))
            await asyncio.sleep(0)
            async with await Bus.open(folder, "recorder") as recorder:
                await recorder.serve("recorder", handler, StartRecording | StopRecording)
                assert await call == "a.mcap"

    run(whole)


def test_a_pause_is_answered_while_an_upload_goes_on(folder: Path) -> None:
    paused = asyncio.Event()

    async def handler(request: Any) -> object:
        if isinstance(request, Pause):
            paused.set()
        else:
            await paused.wait()
        return None

    async def use(server: Bus) -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(server.call("link", Download(OPERATOR), result=type(None), timeout_s=60))
            await asyncio.sleep(0)
            await server.call("link", Pause(OPERATOR), result=type(None), timeout_s=60)
        assert paused.is_set()

    with_link(folder, handler, use)


def test_more_calls_than_can_be_carried_out_are_refused(folder: Path) -> None:
    go_on = asyncio.Event()

    async def handler(request: Any) -> object:
        await go_on.wait()
        return None

    async def use(server: Bus) -> None:
        calls = [_failure(server.call("link", ARM, result=type(None), timeout_s=60)) for _ in range(70)]
        tasks = [asyncio.ensure_future(call) for call in calls]
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        go_on.set()
        errors = [error for error in await asyncio.gather(*tasks) if error is not None]
        assert errors
        assert all("busy with 64 requests" in str(error) for error in errors)

    with_link(folder, handler, use)


def test_numbers_of_numpy_travel_as_numbers() -> None:
    numpy = pytest.importorskip("numpy")
    assert encode((numpy.float64(1.5), numpy.int32(3), numpy.bool_(True))) == encode((1.5, 3, True))
    with pytest.raises(NotImplementedError):
        encode(numpy.zeros(3))


async def _failure(call: Awaitable[object]) -> DescribedError | None:
    try:
        await call
    except DescribedError as error:
        return error
    return None


class _expected_errors:  # noqa: N801 - read as a phrase
    """Log lines of a failure that the test wants are no noise in the report."""

    def __init__(self, caplog: pytest.LogCaptureFixture) -> None:
        self._caplog = caplog

    def __enter__(self) -> None:
        self._caplog.set_level(logging.ERROR, logger="telemetry.bus.calls")

    def __exit__(self, *_exc: object) -> None:
        assert [record.levelname for record in self._caplog.records] == ["ERROR"]
