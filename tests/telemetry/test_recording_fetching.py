"""Several recordings that are fetched one after the other: who goes on, what is said meanwhile, what is kept."""

from __future__ import annotations

import asyncio
import errno
import hashlib
import os
import threading
from collections.abc import Awaitable, Callable, Collection
from pathlib import Path

import pytest

from telemetry.errors import StationsError
from telemetry.recording.disk_space import Measure, Space, space_at
from telemetry.stations.recordings import fetching, offering
from telemetry.stations.recordings.asked_and_given import LOOKING, PIECE_BYTES, REMOVED, NoPiece, PieceGive, PiecesAsk
from telemetry.stations.recordings.fetch_folder import FetchFolder, Note
from telemetry.stations.recordings.fetching import NOT_ANSWERED_S, Fetching
from telemetry.topics.station_recordings import FetchStatus, RecordingThere

TURN_S = 0.5


class Fetched:
    """Fetches into ``folder``; time is the test's own, stations are its words."""

    def __init__(self, folder: Path, space: Measure = space_at) -> None:
        self.folder, self.now_s, self.turn_s, self.live = folder, 100.0, TURN_S, set[str]()
        self.it = Fetching(FetchFolder(folder, space))
        self.it.bucket.bytes_per_s = 1e6
        self.content = dict[bytes, bytes]()
        self.names = dict[str, str]()

    async def begin(self, station: str, size: int = 4 * PIECE_BYTES, name: str = "a.mcap") -> RecordingThere:
        content = os.urandom(size)
        sha256 = hashlib.sha256(content)
        self.content[sha256.digest()] = content
        it = RecordingThere(sha256.hexdigest(), name, size, None, None)
        await self.it.begin(station, it)
        return it

    async def turn(self) -> tuple[str, PiecesAsk] | None:
        self.now_s += self.turn_s
        return await self.it.turn(self.live, self.now_s)

    def gives(self, station: str, ask: PiecesAsk, *, junk: bool = False) -> None:
        for at in ask.offsets:
            data = self.content[ask.sha256][at : at + PIECE_BYTES]
            self.it.on_piece(station, PieceGive(ask.sha256, at, bytes(len(data)) if junk else data), self.now_s)

    async def until(self, holds: Callable[[], bool], *, mute: Collection[str] = ()) -> None:
        """All that are asked answer, without ``mute`` ones."""
        for _ in range(2000):
            if holds():
                return
            asked = await self.turn()
            if asked is not None and asked[0] not in mute:
                self.gives(*asked)
            await asyncio.sleep(0.001)  # what threads have read is taken up
        raise AssertionError(f"it does not come to that: {self.statuses}")

    @property
    def statuses(self) -> tuple[FetchStatus, ...]:
        return self.it.statuses(self.now_s)


def play(fetched: Fetched, whole: Callable[[Fetched], Awaitable[None]]) -> None:
    async def main() -> None:
        runs = asyncio.ensure_future(fetched.it.run())
        try:
            await whole(fetched)
        finally:
            runs.cancel()
            await asyncio.wait([runs])

    asyncio.run(asyncio.wait_for(main(), 60.0))


def test_while_several_wait_nothing_changes_in_what_is_told_of_them(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        for station in ("Bravo", "Charlie", "Delta"):
            await fetched.begin(station)
        await fetched.turn()
        told = fetched.statuses
        assert [each.station for each in told] == ["Bravo", "Charlie", "Delta"]
        assert all("is not heard: it goes on by itself" in each.text for each in told)
        for _ in range(7):
            assert await fetched.turn() is None
            assert fetched.statuses == told
        # The one that is heard goes on, whatever stands before it.
        fetched.live = {"Charlie"}
        await fetched.until(lambda: fetched.statuses[1].state == "whole")
        assert [each.state for each in fetched.statuses] == ["waiting", "whole", "waiting"]
        assert fetched.statuses[1].text == ""

    play(Fetched(tmp_path), whole)


def test_the_room_that_others_still_need_is_not_promised_twice(tmp_path: Path) -> None:
    free = 4_500_000_000

    async def whole(fetched: Fetched) -> None:
        await fetched.begin("Bravo", name="small.mcap")
        big = RecordingThere("ab" * 32, "big.mcap", 4_000_000_000, None, None)
        await fetched.it.begin("Bravo", big)
        another = RecordingThere("cd" * 32, "another.mcap", 1_000_000_000, None, None)
        with pytest.raises(
            StationsError, match=r"and 4000\.0 MB of others that are being fetched\. Only 4500 MB are free"
        ):
            await fetched.it.begin("Bravo", another)
        assert [each.it.name for each in fetched.statuses] == ["small.mcap", "big.mcap"]
        # One that has failed needs nothing any more.
        await fetched.it.end(big.sha256)
        await fetched.it.begin("Bravo", another)

    play(Fetched(tmp_path, lambda _: Space(free, 10**11)), whole)


def test_a_disk_that_fills_up_meanwhile_fails_it_before_the_recorder_stops(tmp_path: Path) -> None:
    free = 10**9

    async def whole(fetched: Fetched) -> None:
        nonlocal free
        fetched.live = {"Bravo"}
        await fetched.begin("Bravo", 40 * PIECE_BYTES)
        await fetched.until(lambda: fetched.statuses[0].have_bytes > 0)
        free = 210_000_000
        await fetched.until(lambda: fetched.statuses[0].state == "failed")
        assert "Only 210 MB are free, of which 226 MB are kept" in fetched.statuses[0].text
        assert not Space(free, 10**11).exhausted

    play(Fetched(tmp_path, lambda _: Space(free, 10**11)), whole)


def test_a_station_that_does_not_answer_holds_up_nobody_and_is_asked_again(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        # A turn has one piece.
        fetched.live, fetched.it.bucket.bytes_per_s, fetched.turn_s = {"Mute", "Good"}, 8000.0, 2.0
        for _ in range(7):
            await fetched.begin("Mute", name="mute.mcap")
        await fetched.begin("Good", 90 * PIECE_BYTES, "good.mcap")
        await fetched.turn()
        assert fetched.statuses[-1].text == "It waits for mute.mcap of Mute."
        began_s = fetched.now_s
        await fetched.until(lambda: fetched.statuses[-1].state == "whole", mute={"Mute"})
        # Four fifths of the time are Good's.
        assert fetched.now_s - began_s < NOT_ANSWERED_S + 90 * 2.0 * 1.5
        for each in fetched.statuses[:-1]:
            assert "Mute does not answer about recordings" in each.text
            assert "It is asked again." in each.text
        # Alone it is asked on, and goes on once it answers.
        await fetched.until(lambda: all(each.state == "whole" for each in fetched.statuses))
        assert {each.text for each in fetched.statuses} == {""}

    play(Fetched(tmp_path), whole)


def test_of_two_silent_stations_each_is_asked(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        fetched.live = {"Mute", "Late"}
        await fetched.begin("Mute")
        await fetched.begin("Late")
        fetched.turn_s = 5.0
        for _ in range(20):
            await fetched.turn()
        await fetched.until(lambda: fetched.statuses[1].state == "whole", mute={"Mute"})

    play(Fetched(tmp_path), whole)


def test_while_one_is_looked_for_there_others_go_on_and_that_is_said(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        fetched.live = {"Looks", "Good"}
        looked = await fetched.begin("Looks")
        await fetched.begin("Good", 40 * PIECE_BYTES)
        for _ in range(60):
            asked = await fetched.turn()
            if asked is not None and asked[0] == "Looks":
                fetched.it.on_none("Looks", NoPiece(bytes.fromhex(looked.sha256), LOOKING), fetched.now_s)
            elif asked is not None:
                fetched.gives(*asked)
                assert "it is still being looked for there" in fetched.statuses[0].text
            await asyncio.sleep(0.001)
        assert [each.state for each in fetched.statuses][1] == "whole"
        await fetched.until(lambda: fetched.statuses[0].state == "whole")

    play(Fetched(tmp_path), whole)


def test_a_piece_under_way_counts_though_another_one_has_its_turn_now(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        fetched.live = {"Good"}
        await fetched.begin("Back", 40 * PIECE_BYTES)
        good = await fetched.begin("Good", 40 * PIECE_BYTES)
        asked = await fetched.turn()
        assert asked is not None
        fetched.live = {"Back", "Good"}
        await fetched.turn()
        assert [each.state for each in fetched.statuses] == ["fetching", "waiting"]
        fetched.gives(*asked)
        assert fetched.statuses[1].have_bytes == len(asked[1].offsets) * PIECE_BYTES > 0
        await fetched.until(lambda: {each.state for each in fetched.statuses} == {"whole"})
        assert Path(fetched.statuses[1].path).read_bytes() == fetched.content[bytes.fromhex(good.sha256)]

    play(Fetched(tmp_path), whole)


def test_a_turn_that_is_cancelled_while_it_writes_loses_no_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the router is lost and the wire opened anew."""
    slow = threading.Event()
    write = FetchFolder.write

    def writes(self: FetchFolder, note: Note, at: int, data: bytes) -> None:
        slow.wait(30.0)
        write(self, note, at, data)

    async def whole(fetched: Fetched) -> None:
        fetched.live = {"Bravo"}
        it = await fetched.begin("Bravo", 10 * PIECE_BYTES)
        asked = await fetched.turn()
        assert asked is not None
        fetched.gives(*asked)
        # The thread has not begun: the write is cancelled before it is done.
        full = [asyncio.ensure_future(asyncio.to_thread(slow.wait, 30.0)) for _ in range(64)]
        turn = asyncio.ensure_future(fetched.turn())
        for _ in range(20):
            await asyncio.sleep(0)
        turn.cancel()
        await asyncio.wait([turn])
        slow.set()
        await asyncio.gather(*full)
        await fetched.until(lambda: fetched.statuses[0].state in ("whole", "failed"))
        assert (fetched.statuses[0].state, fetched.statuses[0].text) == ("whole", "")
        assert Path(fetched.statuses[0].path).read_bytes() == fetched.content[bytes.fromhex(it.sha256)]

    monkeypatch.setattr(FetchFolder, "write", writes)
    play(Fetched(tmp_path), whole)


def test_a_disk_here_that_cannot_be_read_deletes_nothing_and_blames_no_other_station(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fails = True

    async def hashed(path: Path, size: int) -> bytes | None:
        if fails:
            raise OSError(errno.EIO, "Input/output error")
        return await offering.hashed(path, size)

    monkeypatch.setattr(fetching, "hashed", hashed)

    async def whole(fetched: Fetched) -> None:
        nonlocal fails
        fetched.live = {"Bravo"}
        it = await fetched.begin("Bravo")
        await fetched.until(lambda: fetched.statuses[0].state == "failed")
        (status,) = fetched.statuses
        assert "cannot be read here (Input/output error)" in status.text
        assert "Bravo" not in status.text
        assert (status.have_bytes, {path.suffix for path in tmp_path.iterdir()}) == (it.size_bytes, {".json", ".part"})
        fails, fetched.live = False, set()
        await fetched.it.begin("Bravo", it)
        await fetched.until(lambda: fetched.statuses[0].state == "whole")

    play(Fetched(tmp_path), whole)


def test_bytes_of_one_station_are_not_taken_for_anothers(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        fetched.live = {"Evil", "Good"}
        it = await fetched.begin("Evil", 10 * PIECE_BYTES)
        for _ in range(3):
            asked = await fetched.turn()
            assert asked is not None
            fetched.gives(*asked, junk=True)
        await fetched.turn()
        fetched.it.on_none("Evil", NoPiece(bytes.fromhex(it.sha256), REMOVED), fetched.now_s)
        assert fetched.statuses[0].have_bytes > 0
        await fetched.it.begin("Good", it)
        assert fetched.statuses[0].have_bytes == 0
        await fetched.until(lambda: fetched.statuses[0].state in ("whole", "failed"))
        assert (fetched.statuses[0].state, fetched.statuses[0].text) == ("whole", "")

    play(Fetched(tmp_path), whole)


def test_of_what_was_deleted_nothing_is_there(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        fetched.live = {"Evil"}
        await fetched.begin("Evil")
        while fetched.statuses[0].state != "failed":
            asked = await fetched.turn()
            if asked is not None:
                fetched.gives(*asked, junk=True)
            await asyncio.sleep(0.001)
        assert "What came from Evil is not a.mcap" in fetched.statuses[0].text
        assert (fetched.statuses[0].have_bytes, list(tmp_path.iterdir())) == (0, [])

    play(Fetched(tmp_path), whole)


def test_the_same_bytes_are_fetched_from_one_station_and_the_other_press_is_told(tmp_path: Path) -> None:
    async def whole(fetched: Fetched) -> None:
        it = await fetched.begin("Bravo")
        with pytest.raises(StationsError, match="is being fetched from Bravo"):
            await fetched.it.begin("Charlie", it)
        await fetched.it.begin("Bravo", it)
        assert [each.station for each in fetched.statuses] == ["Bravo"]
        await fetched.it.end(it.sha256)
        await fetched.it.begin("Charlie", it)
        assert [each.station for each in fetched.statuses] == ["Charlie"]

    play(Fetched(tmp_path), whole)
