"""Recordings between two stations: listed when asked, fetched whole or with a named error, whatever is sent."""

from __future__ import annotations

import asyncio
import hashlib
import os
import random
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.errors import StationsError
from telemetry.recording.disk_space import WARN_BYTES, Space, running_out
from telemetry.stations.recordings.asked_and_given import (
    MOST_OFFERED,
    MOST_RECORDING_BYTES,
    PIECE_BYTES,
    ListGive,
    Offer,
    PieceGive,
    file_name,
    meant_for,
    plain_file_name,
    read_key,
    sent_by,
)
from telemetry.stations.recordings.fetch_folder import FetchFolder, note_of
from telemetry.topics.station_recordings import EndFetch, FetchRecording, ListRecordings, OwnRecordings, RecordingThere
from tests.telemetry.recording_exchanges import Pair, offered, running

TOTAL_BYTES = 10**9
KEPT_BYTES = WARN_BYTES + Space(0, TOTAL_BYTES).reserve
EVIL = (
    "../evil.mcap",
    "/etc/cron.d/evil.mcap",
    "..\\evil.mcap",
    "a/../../evil.mcap",
    ".hidden.mcap",
    "evil.mcap\x00.txt",
    "evil\n.mcap",
    "evil‮pacm.exe",
    "C:evil.mcap",
    "~root.mcap",
    "evil.sh",
    "evil..mcap",
    "mcap",
    "",
    "x" * 101 + ".mcap",
)


def with_pair(tmp_path: Path, whole: Callable[[Pair], Awaitable[None]], **given: object) -> None:
    async def main() -> None:
        pair = Pair(tmp_path / "fetched", **given)  # type: ignore[arg-type]
        async with running(pair.alpha, pair.bravo):
            await whole(pair)

    asyncio.run(main())


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    path = tmp_path / "flight.mcap"
    path.write_bytes(os.urandom(50 * PIECE_BYTES + 17))
    return path


def test_a_list_comes_when_it_is_asked_for_newest_first_and_no_longer_than_it_may_be(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        paths = [tmp_path / f"{n}.mcap" for n in range(60)]
        for path in paths:
            path.write_bytes(path.name.encode())
        pair.offer(*map(offered, paths))
        for _ in range(10):
            await pair.turn()
        assert pair.alpha.status(pair.now_s).stations == ()
        listed = await pair.listed(50)
        assert [each.name for each in listed.recordings] == [path.name for path in paths[:50]]
        first = listed.recordings[0]
        assert (first.size_bytes, first.vehicle, first.plan) == (6, "Vehicle 1", "Ridge")
        assert (first.begin_utc_s, first.end_utc_s) == (1.7e9, 1.7e9 + 60)
        assert first.sha256 == hashlib.sha256(b"0.mcap").hexdigest()

    with_pair(tmp_path, whole)


def test_where_it_is_switched_off_nothing_is_listed_and_nothing_given(tmp_path: Path, flight: Path) -> None:
    async def whole(pair: Pair) -> None:
        pair.offer(offered(flight))
        await pair.begin()
        pair.offer(offered(flight), is_on=False)
        failed = await pair.fetched()
        assert (failed.state, "not offered any more" in failed.text) == ("failed", True)
        await pair.alpha.handle(ListRecordings("Bravo"))
        await pair.until(lambda: pair.list.state == "off")
        assert (pair.list.recordings, "switched off there" in pair.list.text) == ((), True)

    with_pair(tmp_path, whole)


def test_one_that_does_not_answer_is_said_with_what_to_do(tmp_path: Path, flight: Path) -> None:
    async def whole(pair: Pair) -> None:
        await pair.alpha.handle(ListRecordings("Bravo"))
        await pair.until(lambda: pair.list.state == "silent")
        assert "hedgehop stations, and restart the router" in pair.list.text
        # It is asked again, and answers.
        pair.carry = lambda payload: [payload]
        pair.offer(offered(flight))
        assert (await pair.listed()).text == ""

    with_pair(tmp_path, whole, carry=lambda payload: [])


@settings(deadline=None, max_examples=12)
@given(
    size=st.integers(1, 80 * PIECE_BYTES), lost=st.floats(0, 0.3), twice=st.floats(0, 0.5), seed=st.integers(0, 2**32)
)
def test_over_a_line_that_loses_and_repeats_the_same_bytes_come(
    tmp_path_factory: pytest.TempPathFactory, size: int, lost: float, twice: float, seed: int
) -> None:
    tmp_path, drawn = tmp_path_factory.mktemp("lossy"), random.Random(seed)
    flight = tmp_path / "flight.tlog"
    flight.write_bytes(drawn.randbytes(size))

    def carry(payload: bytes) -> list[bytes]:
        return [payload for _ in range(1 + (drawn.random() < twice)) if drawn.random() >= lost]

    async def whole(pair: Pair) -> None:
        pair.offer(offered(flight))
        await pair.begin()
        done = await pair.fetched()
        assert (done.state, done.text) == ("whole", "")
        assert Path(done.path).read_bytes() == flight.read_bytes()

    with_pair(tmp_path, whole, carry=carry)


def test_a_lost_station_is_waited_for_and_what_is_there_counts(tmp_path: Path, flight: Path) -> None:
    async def whole(pair: Pair) -> None:
        pair.offer(offered(flight))
        await pair.begin()
        await pair.until(lambda: pair.fetch.have_bytes > 10 * PIECE_BYTES)
        pair.live = set()
        await pair.until(lambda: pair.fetch.state == "waiting")
        assert "is not heard: it goes on by itself" in pair.fetch.text
        had = pair.fetch.have_bytes
        pair.live = {"Bravo"}
        await pair.until(lambda: pair.fetch.state == "fetching")
        assert pair.fetch.have_bytes >= had
        assert (await pair.fetched()).state == "whole"

    with_pair(tmp_path, whole)


@pytest.mark.parametrize("becomes", ["removed", "changed"])
def test_a_file_that_is_removed_or_changed_there_ends_it_in_words(tmp_path: Path, flight: Path, becomes: str) -> None:
    async def whole(pair: Pair) -> None:
        pair.offer(offered(flight))
        await pair.begin()
        await pair.until(lambda: pair.fetch.have_bytes > 0)
        if becomes == "removed":
            flight.unlink()
        else:
            flight.write_bytes(os.urandom(flight.stat().st_size))
        failed = await pair.fetched()
        assert (failed.state, f"it was {becomes} there" in failed.text) == ("failed", True)

    with_pair(tmp_path, whole)


def test_one_that_newer_ones_push_off_the_list_is_given_on_until_it_is_gone(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        paths = [tmp_path / f"{n}.mcap" for n in range(MOST_OFFERED + 1)]
        for path in paths:
            path.write_bytes(os.urandom(2000 * PIECE_BYTES if path is paths[-1] else 10))
        pair.alpha.on_own(OwnRecordings(0.0, is_on=True, bytes_per_s=100_000))
        pair.offer(*map(offered, paths[1:]))
        oldest = (await pair.listed(MOST_OFFERED)).recordings[-1]
        await pair.alpha.handle(FetchRecording("Bravo", oldest.sha256))
        await pair.until(lambda: pair.fetch.have_bytes > 0)
        # Bravo has landed, and is asked for its list: that has the newest alone.
        pair.offer(*map(offered, paths))
        await pair.alpha.handle(ListRecordings("Bravo"))
        await pair.until(lambda: pair.list.state == "listed" and pair.list.recordings[0].name == "0.mcap")
        assert oldest.sha256 not in {each.sha256 for each in pair.list.recordings}
        assert 0 < pair.fetch.have_bytes < oldest.size_bytes
        had = pair.fetch.have_bytes
        await pair.until(lambda: pair.fetch.have_bytes > had or pair.fetch.state == "failed")
        assert pair.fetch.state == "fetching"
        # Deleted there, it is not Bravo's any more.
        pair.offer(*map(offered, paths[:-1]))
        failed = await pair.fetched()
        assert (failed.state, "it was removed there" in failed.text) == ("failed", True)

    with_pair(tmp_path, whole)


def test_what_has_another_hash_is_deleted_and_never_whole(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        content = os.urandom(3 * PIECE_BYTES)
        wrong = hashlib.sha256(b"something else").digest()
        await _lists(pair, Offer(wrong, "flight.mcap", len(content), None, None, "", ""))
        await pair.alpha.handle(FetchRecording("Bravo", wrong.hex()))
        for _ in range(60):
            await pair.turn()
            for at in range(0, len(content), PIECE_BYTES):
                pair.says(PieceGive(wrong, at, content[at : at + PIECE_BYTES]))
        failed = await pair.fetched()
        assert (failed.state, "its SHA-256 is another one" in failed.text) == ("failed", True)
        assert list((tmp_path / "fetched").glob("*")) == []

    with_pair(tmp_path, whole)


@pytest.mark.parametrize("at", [0, 7, 5 * PIECE_BYTES])
def test_pieces_of_a_wrong_length_or_beyond_the_end_fail_it(tmp_path: Path, at: int) -> None:
    async def whole(pair: Pair) -> None:
        sha256 = hashlib.sha256(b"x").digest()
        await _lists(pair, Offer(sha256, "flight.mcap", 5 * PIECE_BYTES, None, None, "", ""))
        await pair.alpha.handle(FetchRecording("Bravo", sha256.hex()))
        await pair.until(lambda: pair.fetch.state == "fetching")
        pair.says(PieceGive(sha256, at, b"short"))
        assert (pair.fetch.state, "is not what was asked for" in pair.fetch.text) == ("failed", True)

    with_pair(tmp_path, whole)


def test_pieces_without_end_fail_it_and_fill_no_disk(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        sha256 = hashlib.sha256(b"x").digest()
        await _lists(pair, Offer(sha256, "flight.mcap", 500 * PIECE_BYTES, None, None, "", ""))
        await pair.alpha.handle(FetchRecording("Bravo", sha256.hex()))
        await pair.until(lambda: pair.fetch.state == "fetching")
        for _ in range(1000):
            pair.says(PieceGive(sha256, 400 * PIECE_BYTES, bytes(PIECE_BYTES)))
        assert (pair.fetch.state, "without end" in pair.fetch.text) == ("failed", True)
        await pair.turn()
        assert sum(path.stat().st_size for path in (tmp_path / "fetched").glob("*.part")) == 0

    with_pair(tmp_path, whole)


def test_evil_names_and_sizes_are_neither_listed_nor_fetched_and_said(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        good = Offer(bytes(32), "good.mcap", 10, None, None, "", "")
        for name in EVIL:
            evil = Offer(bytes([1] * 32), name, 10, None, None, "", "")
            await _lists(pair, evil, good)
            assert [each.name for each in pair.list.recordings] == ["good.mcap"], name
            assert "is no plain name of a recording" in pair.list.text
            with pytest.raises(StationsError, match="lists no such recording"):
                await pair.alpha.handle(FetchRecording("Bravo", evil.sha256.hex()))
        await _lists(pair, Offer(bytes([2] * 32), "huge.mcap", MOST_RECORDING_BYTES + 1, None, None, "", ""), good)
        assert [each.name for each in pair.list.recordings] == ["good.mcap"]
        assert "more than the 4.3 GB that are fetched" in pair.list.text

    with_pair(tmp_path, whole)


def test_malformed_messages_and_foreign_keys_are_refused_and_counted(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        keys = "hedgehop/recordings/1/Bravo/to/Alpha/give", "hedgehop/recordings/1/Bravo/to/Alpha/ask"
        for key in keys:
            for payload in (b"", b"\xff" * 40, b"x" * 5000, b"\x92\x02\xc4\x01x"):
                pair.alpha.on_message(key, payload, 0.0)
        for key in ("hedgehop/recordings/1/Bravo/to/Charlie/give", "hedgehop/recordings/1/Alpha/to/Alpha/give", "x"):
            pair.alpha.on_message(key, b"", 0.0)
        assert pair.alpha.refused == 11
        await pair.turn()
        assert (pair.alpha.status(0.0).stations, pair.alpha.status(0.0).fetches) == ((), ())

    with_pair(tmp_path, whole)


def test_a_full_disk_is_said_before_and_during_and_what_is_there_is_kept(tmp_path: Path) -> None:
    there = RecordingThere("ab" * 32, "flight.mcap", 10 * PIECE_BYTES, None, None)
    note, free = note_of("Bravo", there), 0
    folder = FetchFolder(tmp_path, lambda _: Space(free, TOTAL_BYTES))
    with pytest.raises(StationsError, match=r"are missing\. Only 0 MB are free"):
        folder.begin(note)
    free = KEPT_BYTES + 10 * PIECE_BYTES
    with pytest.raises(StationsError, match=r"and 0\.0 MB of others that are being fetched"):
        folder.begin(note, 1)
    assert folder.begin(note) == 0
    folder.write(note, 0, bytes(PIECE_BYTES))
    free = KEPT_BYTES + PIECE_BYTES - 1
    with pytest.raises(StationsError, match="cannot be fetched"):
        folder.write(note, PIECE_BYTES, bytes(PIECE_BYTES))
    assert folder.have(note) == PIECE_BYTES
    # A piece that was cut off counts as not there.
    with folder.part(note).open("ab") as file:
        file.write(b"half a piece")
    assert (folder.have(note), folder.begun()) == (PIECE_BYTES, [note])
    # So nothing that is fetched has one's own recorder warn of the disk.
    assert running_out(Space(KEPT_BYTES + 1, TOTAL_BYTES), 1.0, "") is None
    assert running_out(Space(KEPT_BYTES, TOTAL_BYTES), 1.0, "") is not None


def test_a_disk_that_does_not_take_it_fails_the_fetch_in_words(tmp_path: Path, flight: Path) -> None:
    async def whole(pair: Pair) -> None:
        pair.offer(offered(flight))
        await pair.begin()
        (tmp_path / "fetched" / f"{pair.fetch.it.sha256}.part").mkdir()
        failed = await pair.fetched()
        assert (failed.state, "the disk does not take it" in failed.text) == ("failed", True)
        (tmp_path / "fetched" / f"{pair.fetch.it.sha256}.part").rmdir()
        await pair.alpha.handle(FetchRecording("Bravo", pair.fetch.it.sha256))
        assert (await pair.fetched()).state == "whole"

    with_pair(tmp_path, whole)


def test_several_come_one_after_the_other_and_one_can_be_cancelled(tmp_path: Path) -> None:
    async def whole(pair: Pair) -> None:
        paths = [tmp_path / f"{n}.bin" for n in range(10)]
        for path in paths:
            path.write_bytes(os.urandom(30 * PIECE_BYTES))
        pair.offer(*map(offered, paths))
        listed = await pair.listed(10)
        for each in listed.recordings[:8]:
            await pair.alpha.handle(FetchRecording("Bravo", each.sha256))
        with pytest.raises(StationsError, match="8 recordings are being fetched already"):
            await pair.alpha.handle(FetchRecording("Bravo", listed.recordings[8].sha256))
        await pair.until(lambda: pair.fetch.have_bytes > 0)
        assert [each.have_bytes for each in pair.alpha.status(0.0).fetches[1:]] == [0] * 7
        await pair.alpha.handle(EndFetch(pair.fetch.it.sha256))
        await pair.until(lambda: all(each.state == "whole" for each in pair.alpha.status(0.0).fetches))
        assert len(pair.alpha.status(0.0).fetches) == 7
        left = {path.name[:64] for path in (tmp_path / "fetched").iterdir()}
        assert left == {each.sha256 for each in listed.recordings[1:8]}

    with_pair(tmp_path, whole)


def test_notes_of_others_in_the_folder_are_left_alone(tmp_path: Path) -> None:
    folder = FetchFolder(tmp_path)
    for name, text in {
        "a.json": "{}",
        "b.json": "no json",
        f"{'ab' * 32}.json": '{"station":"../x","sha256":"%s","name":"../e.mcap","size_bytes":1}' % ("ab" * 32),
    }.items():
        (tmp_path / name).write_text(text)
    (tmp_path / f"{'cd' * 32}.json").symlink_to(tmp_path / "a.json")
    assert folder.begun() == []
    assert len(list(tmp_path.iterdir())) == 4


@given(st.text(max_size=200), st.sampled_from(["mcap", "tlog", "BIN", "ulg"]))
def test_whatever_a_file_is_called_here_others_take_its_name(stem: str, suffix: str) -> None:
    assert file_name(plain_file_name(f"{stem}.{suffix}")).endswith(f".{suffix.lower()}")


def test_a_station_hears_what_is_meant_for_it_alone() -> None:
    assert meant_for("Alpha") == "hedgehop/recordings/1/*/to/Alpha/**"
    assert sent_by("Alpha") == "hedgehop/recordings/1/Alpha/to/**"
    assert read_key("hedgehop/recordings/1/Bravo/to/Alpha/ask", "Alpha") == ("Bravo", True)


async def _lists(pair: Pair, *offers: Offer) -> None:
    """Bravo says so, whatever it has."""
    before = pair.alpha.status(pair.now_s).stations
    await pair.alpha.handle(ListRecordings("Bravo"))
    pair.says(ListGive(True, len(before) + pair.alpha.refused, len(offers), 0, 0, offers))
    assert pair.list.state == "listed"
