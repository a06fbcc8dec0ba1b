"""Recordings of other stations at the server: what is offered and asked for, and what becomes of one that has come."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from server.errors import BusyError, InUseError, JobCancelledError, NotReadyError, StorageError, WorkerDiedError
from server.flying.apart import recordings_there
from server.flying.apart.recordings_there import FRESH_S, PRESSED_S, RecordingsThere
from server.flying.recordings import RecordingDesk
from server.library import Library
from server.library.recording_list import FETCHED, RecordingShelf
from server.schemas import RecordingDoc
from telemetry.errors import RecordingError, RecordingUnreadableError
from telemetry.topics.station_recordings import (
    EndFetch,
    FetchRecording,
    FetchState,
    FetchStatus,
    ListRecordings,
    ListState,
    RecordingsStatus,
    RecordingThere,
    StationRecordings,
)
from telemetry.topics.station_vehicles import OtherStation, StationsStatus
from tests.server.fakes import Told
from tests.telemetry.recordings import write_flight

NOW_S = 1000.0
IT = RecordingThere("ab" * 32, "flight.mcap", 1000, 1.7e9, 1.7e9 + 60, "Vehicle 1", "Ridge")


def doc_of(name: str, station: str = "") -> RecordingDoc:
    return RecordingDoc(
        id=f"id-{name}-{station}",
        name=name,
        kind="hedgehop",
        started_utc="2026-01-01T00:00:00Z",
        duration_s=60.0,
        bytes=1000,
        vehicle="Vehicle 1",
        plan_name="Ridge",
        station=station,
    )


class Desk:
    """Of recordings: takes in what ``answers`` lets it, else raises."""

    def __init__(self, root: Path) -> None:
        self.root, self.shelf, self.answers = root, list[tuple[Path, RecordingDoc]](), list[Any]()
        self.taken, self.reads = list[tuple[str, str, str]](), 0
        self.goes_on: asyncio.Event | None = None

    async def shelved(self) -> list[tuple[Path, RecordingDoc]]:
        return self.shelf

    async def add_fetched(self, path: str, name: str, station: str, sha256: str) -> RecordingDoc:
        assert sha256 == IT.sha256
        self.reads += 1
        if self.goes_on is not None:
            await self.goes_on.wait()
        if self.answers and (error := self.answers.pop(0)) is not None:
            raise error
        self.taken.append((path, name, station))
        return doc_of(name, station)


class There:
    """The desk, what its node was asked, and what pages were told."""

    def __init__(self, root: Path, *, is_on: bool = True, state: Any = "live") -> None:
        self.desk, self.asked, self.told = Desk(root), list[Any](), Told()
        nodes: Any = SimpleNamespace(ask_stations=self._ask)
        none: Any = None
        desk: Any = self.desk
        stations = StationsStatus(NOW_S, "Alpha", "connected", stations=(OtherStation("Bravo", state, NOW_S, 0.0, 1),))
        self.it = RecordingsThere(
            none, nodes, self.told, desk, lambda: stations, is_on=is_on, kb_s=8, now_mono_s=lambda: NOW_S
        )

    async def _ask(self, request: object) -> None:
        self.asked.append(request)

    def listed(self, state: ListState = "listed", *, age_s: float = 0.0) -> None:
        self.it.on_status(RecordingsStatus(NOW_S, (StationRecordings("Bravo", state, NOW_S - age_s, "", (IT,)),)))

    def fetched(self, state: FetchState, have: int = 1000) -> None:
        fetch = FetchStatus("Bravo", IT, state, have, 100.0 if state == "fetching" else 0.0, "", "/some/where.mcap")
        self.it.on_status(RecordingsStatus(NOW_S, (), (fetch,)))


def play(whole: Callable[[], Awaitable[None]]) -> None:
    asyncio.run(asyncio.wait_for(whole(), 30.0))  # type: ignore[arg-type]


async def taking(there: There, done: Callable[[], bool]) -> None:
    loop = asyncio.ensure_future(there.it._take_in())
    while not done():
        await asyncio.sleep(0)
    loop.cancel()
    with suppress(asyncio.CancelledError):
        await loop


def test_a_look_asks_stations_that_are_heard_unless_their_list_is_fresh(tmp_path: Path) -> None:
    async def whole() -> None:
        there = There(tmp_path)
        await there.it.look()
        there.listed("asking")
        await there.it.look()
        there.listed(age_s=FRESH_S - 1)
        await there.it.look()
        assert there.asked == [ListRecordings("Bravo")]
        there.listed(age_s=FRESH_S + 1)
        await there.it.look()
        assert there.asked == [ListRecordings("Bravo")] * 2
        # Whoever asks by a press does not wait for that.
        there.listed(age_s=PRESSED_S - 1)
        await there.it.look(PRESSED_S)
        assert len(there.asked) == 2
        there.listed(age_s=PRESSED_S + 1)
        await there.it.look(PRESSED_S)
        assert len(there.asked) == 3
        lost = There(tmp_path, state="lost")
        await lost.it.look()
        assert lost.asked == []

    play(whole)


def test_own_ones_are_offered_and_neither_fetched_nor_pulled_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recordings_there, "pulled_recordings", lambda root: frozenset({"pulled.mcap"}))

    async def whole() -> None:
        for is_on, names in ((True, ["own.mcap"]), (False, [])):
            there = There(tmp_path, is_on=is_on)
            there.desk.shelf = [
                (Path("/r/own.mcap"), doc_of("own.mcap")),
                (Path("/r/pulled.mcap"), doc_of("pulled.mcap")),
                (Path("/f/Bravo/flight.mcap"), doc_of("flight.mcap", "Bravo")),
            ]
            await there.it.list_own()
            assert [each.name for each in there.it._own] == names
            assert there.it.doc().is_offered is is_on

    play(whole)


def test_a_whole_one_is_taken_in_and_then_put_away_at_the_node(tmp_path: Path) -> None:
    async def whole() -> None:
        there = There(tmp_path)
        there.fetched("whole")
        await taking(there, lambda: bool(there.asked))
        assert there.desk.taken == [("/some/where.mcap", "flight.mcap", "Bravo")]
        assert there.asked == [EndFetch(IT.sha256)]
        # It is listed there as one that is here, and is not fetched twice.
        there.listed()
        assert there.it.doc().stations[0].recordings[0].recording_id == "id-flight.mcap-Bravo"
        with pytest.raises(InUseError, match="was fetched already"):
            await there.it.fetch("Bravo", IT.sha256)

    play(whole)


def test_what_came_and_is_no_recording_is_said_until_it_is_put_away(tmp_path: Path) -> None:
    async def whole() -> None:
        there = There(tmp_path)
        there.desk.answers = [RecordingError("The file is a program.", advice="Choose another one.")]
        there.fetched("whole")
        await taking(there, lambda: bool(there.asked))
        assert there.asked == [EndFetch(IT.sha256)]  # nothing of it is kept
        there.it.on_status(RecordingsStatus(NOW_S))
        (failed,) = there.it.doc().fetches
        assert (failed.state, "is no recording: The file is a program." in failed.text) == ("failed", True)
        await there.it.end(IT.sha256)
        assert there.it.doc().fetches == []

    play(whole)


def test_one_that_cannot_be_opened_now_is_kept_and_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recordings_there, "AGAIN_S", 0.0)

    async def whole() -> None:
        there = There(tmp_path)
        there.desk.answers = [BusyError("Too many jobs wait."), StorageError("The disk is full."), None]
        there.fetched("whole")
        await taking(there, lambda: bool(there.asked))
        assert there.desk.taken == [("/some/where.mcap", "flight.mcap", "Bravo")]
        said = [fetch.text for message in there.told for fetch in getattr(message, "fetches", [])]
        assert any("is tried to be opened again: Too many jobs wait." in text for text in said)
        assert any("is tried to be opened again: The disk is full." in text for text in said)

    play(whole)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (WorkerDiedError("The process that did the work ended."), "The process that did the work ended."),
        (JobCancelledError("The job was cancelled."), "The job was cancelled."),
        (RecordingUnreadableError("The file cannot be read: I/O."), "The file cannot be read: I/O."),
        (RuntimeError("a bug"), "Something in Hedgehop itself went wrong."),
    ],
)
def test_one_that_ends_its_worker_is_read_once_kept_and_read_again_by_a_press(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, words: str
) -> None:
    monkeypatch.setattr(recordings_there, "AGAIN_S", 0.0)

    async def whole() -> None:
        there = There(tmp_path)
        there.desk.answers = [error]
        loop = asyncio.ensure_future(there.it._take_in())
        for _ in range(50):
            there.fetched("whole")
            await asyncio.sleep(0)
        (fetch,) = there.it.doc().fetches
        assert (there.desk.reads, there.asked, there.desk.taken) == (1, [], [])
        assert (fetch.state, fetch.have_bytes) == ("failed", 1000)
        assert f"could not be opened: {words}" in fetch.text
        # Again reads the file that is there: nothing is fetched anew.
        await there.it.fetch("Bravo", IT.sha256)
        while not there.asked:
            await asyncio.sleep(0)
        assert (there.desk.reads, there.asked) == (2, [EndFetch(IT.sha256)])
        loop.cancel()
        with suppress(asyncio.CancelledError):
            await loop

    play(whole)


def test_one_that_was_taken_in_before_the_server_died_is_not_fetched_anew(tmp_path: Path) -> None:
    async def whole() -> None:
        there = There(tmp_path)
        (tmp_path / ".flight.mcap.sha256").write_text(f"{IT.sha256}  flight.mcap")
        there.desk.shelf = [(tmp_path / "flight.mcap", doc_of("flight.mcap", "Bravo"))]
        await there.it.list_own()
        there.fetched("waiting", have=0)
        await taking(there, lambda: bool(there.asked))
        assert (there.asked, there.desk.taken) == ([EndFetch(IT.sha256)], [])

    play(whole)


def test_pages_are_told_how_far_it_is_and_a_lost_station_gives_none(tmp_path: Path) -> None:
    async def whole() -> None:
        there = There(tmp_path, state="lost")
        there.fetched("fetching", have=400)
        (fetch,) = there.told[-1].fetches
        assert (fetch.have_bytes, fetch.bytes, fetch.left_s) == (400, 1000, 6.0)
        with pytest.raises(NotReadyError, match="Bravo is not heard"):
            await there.it.fetch("Bravo", IT.sha256)
        live = There(tmp_path)
        await live.it.fetch("Bravo", IT.sha256)
        assert live.asked == [FetchRecording("Bravo", IT.sha256)]

    play(whole)


def test_why_it_is_no_recording_is_not_overwritten_by_a_word_of_before(tmp_path: Path) -> None:
    async def whole() -> None:
        there = There(tmp_path)
        there.desk.answers = [RecordingError("The file is a program."), RecordingError("There is no such recording.")]
        there.fetched("whole")
        loop = asyncio.ensure_future(there.it._take_in())
        for _ in range(50):
            await asyncio.sleep(0)
            there.fetched("whole")  # the node says it again meanwhile, as it does every two seconds
        there.it.on_status(RecordingsStatus(NOW_S))
        (failed,) = there.it.doc().fetches
        assert "The file is a program." in failed.text
        assert (there.desk.reads, there.asked) == (1, [EndFetch(IT.sha256)])
        # Fetched anew it is read anew.
        there.desk.answers = []
        await there.it.fetch("Bravo", IT.sha256)
        there.fetched("whole")
        while not there.desk.taken:
            await asyncio.sleep(0)
        loop.cancel()
        with suppress(asyncio.CancelledError):
            await loop

    play(whole)


def test_one_that_is_cancelled_while_it_is_read_fails_nowhere_and_leaves_no_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recordings_there, "AGAIN_S", 1e9)

    async def whole() -> None:
        for error in (BusyError("Too many jobs wait."), RecordingError("There is no such recording.")):
            there = There(tmp_path)
            there.desk.answers, there.desk.goes_on = [error], asyncio.Event()
            there.fetched("whole")
            loop = asyncio.ensure_future(there.it._take_in())
            while not there.desk.reads:
                await asyncio.sleep(0)
            await there.it.end(IT.sha256)
            there.desk.goes_on.set()
            for _ in range(20):
                await asyncio.sleep(0)
                there.fetched("whole")
            assert (there.desk.reads, there.asked) == (1, [EndFetch(IT.sha256)])
            there.it.on_status(RecordingsStatus(NOW_S))
            assert there.it.doc().fetches == []
            loop.cancel()
            with suppress(asyncio.CancelledError):
                await loop
        # What was tried again says nothing of that once it was cancelled and is fetched anew.
        there = There(tmp_path)
        there.desk.answers = [BusyError("Too many jobs wait.")]
        there.fetched("whole")
        await taking(there, lambda: bool(there.it._taking))
        await there.it.end(IT.sha256)
        there.fetched("fetching", 12)
        assert [fetch.text for fetch in there.it.doc().fetches] == [""]

    play(whole)


def test_lists_are_told_when_one_has_changed_and_not_with_every_piece(tmp_path: Path) -> None:
    async def whole() -> None:
        there, now_s = There(tmp_path), NOW_S
        there.it._now_mono_s = lambda: now_s
        lists = (StationRecordings("Bravo", "listed", NOW_S, "", (IT,)),)
        status = RecordingsStatus(now_s, lists)
        for have in range(100):
            now_s = NOW_S + 0.5 * have
            status = replace(status, fetches=(FetchStatus("Bravo", IT, "fetching", have, 100.0 + have),))
            there.it.on_status(status)
        types = [message.type for message in there.told]
        assert (types.count("station_recordings"), types.count("station_fetches")) == (1, 25)
        assert [message.type for message in there.it.messages()] == ["station_recordings", "station_fetches"]
        # One of the list is here: pages are told which.
        there.it._here[recordings_there._key(IT)] = "id"
        there.it.on_status(status)
        assert there.told[-1].stations[0].recordings[0].recording_id == "id"

    play(whole)


def test_the_shelf_lists_a_fetched_one_with_where_it_came_from_and_deletes_it(tmp_path: Path) -> None:
    library = Library(tmp_path / "data")
    shelf = RecordingShelf(library)
    write_flight(tmp_path / "a.mcap", seconds=2.0)
    write_flight(tmp_path / "b.mcap", seconds=2.0)
    own = shelf.add(tmp_path / "a.mcap", "flight.mcap")
    fetched = shelf.add(tmp_path / "b.mcap", "flight.mcap", "Bravo")
    assert {(doc.name, doc.station) for doc in shelf.docs()} == {("flight.mcap", ""), ("flight.mcap", "Bravo")}
    assert own.id != fetched.id
    assert shelf.path(fetched.id) == library.root / FETCHED / "Bravo" / "flight.mcap"
    # What is still coming is not listed.
    parts = library.root / FETCHED / ".parts"
    parts.mkdir()
    write_flight(parts / "c.mcap", seconds=1.0)
    assert len(shelf.docs()) == 2
    shelf.delete(fetched.id)
    assert [doc.id for doc in shelf.docs()] == [own.id]


def test_two_of_one_name_from_one_station_are_both_here(tmp_path: Path) -> None:
    library = Library(tmp_path / "data")
    shelf = RecordingShelf(library)
    none: Any = None
    desk = RecordingDesk(shelf, none, none, Told())
    there = RecordingsThere(none, none, Told(), desk, lambda: None, is_on=True, kb_s=8)
    for number in (1, 2):
        part = write_flight(tmp_path / f"{number}.mcap", seconds=2.0 * number)
        it = replace(IT, sha256=f"{number:064x}", size_bytes=part.stat().st_size)
        doc = shelf.add(part, it.name, "Bravo", it.sha256)
        # As a server that starts finds it.
        asyncio.run(there.list_own())
        assert there._recording_doc(it).recording_id == doc.id
        assert there._recording_doc(replace(it, sha256="f" * 64)).recording_id is None
    bravo = library.root / FETCHED / "Bravo"
    assert (bravo / ".flight-2.mcap.sha256").read_text() == f"{2:064x}  flight-2.mcap\n"
    for fetched in shelf.docs():
        shelf.delete(fetched.id)
    assert list(bravo.iterdir()) == []
