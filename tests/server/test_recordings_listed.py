"""The shelf of recordings lists whatever lies there: a file that cannot be looked at is one line with its fault."""

from __future__ import annotations

import asyncio
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from server.flying.apart import recordings_there
from server.flying.apart.recordings_there import RecordingsThere
from server.flying.recordings import RecordingDesk
from server.library import Library, recording_list
from server.library.recording_list import RecordingShelf
from server.schemas import RecordingsMessage
from tests.server.fakes import Told
from tests.telemetry.own_logs import ulog
from tests.telemetry.recordings import write_flight


def beyond_all_dates(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    data = bytearray(ulog())
    data[8:16] = (2**63).to_bytes(8, "little")
    (folder / "x.ulg").write_bytes(data)
    return "The time in it is no date"


def no_utf8(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    with open(os.path.join(os.fsencode(folder), b"flug_\xfc.mcap"), "wb") as file:
        file.write(b"x" * 100)
    return "Its name is not UTF-8: rename the file"


def failing_disk(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    stat = Path.stat

    def fails(self: Path, **options: Any) -> os.stat_result:
        if self.name == "y.mcap":
            raise OSError(5, "Input/output error")
        return stat(self, **options)

    (folder / "y.mcap").write_bytes(b"x")
    monkeypatch.setattr(Path, "stat", fails)
    return "The file cannot be read: Input/output error"


def changed_in_no_year(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (folder / "z.mcap").write_bytes(b"x")
    key = recording_list._key
    monkeypatch.setattr(recording_list, "_key", lambda path: (*key(path)[:2], 2**80 if path.stem == "z" else 0))
    return "is not a recording"


def our_own_fault(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    from telemetry.recording import describe

    whole = describe.describe_recording

    def fails(path: Path) -> Any:
        if path.name == "z.mcap":
            raise ZeroDivisionError
        return whole(path)

    (folder / "z.mcap").write_bytes(b"x")
    monkeypatch.setattr(describe, "describe_recording", fails)
    return "Something in Hedgehop itself went wrong"


@pytest.mark.parametrize("bad", [beyond_all_dates, no_utf8, failing_disk, changed_in_no_year, our_own_fault])
def test_one_bad_file_is_a_line_with_its_fault_and_the_others_are_listed_and_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bad: Any
) -> None:
    library = Library(tmp_path)
    shelf, pages, none = RecordingShelf(library), Told(), None
    folder = library.root / "recordings"
    write_flight(folder / "good.mcap", seconds=2.0)
    fault = bad(folder, monkeypatch)
    desk = RecordingDesk(shelf, none, none, pages)  # type: ignore[arg-type]
    there = RecordingsThere(none, none, pages, desk, lambda: None, is_on=True, kb_s=8)  # type: ignore[arg-type]
    asyncio.run(desk.refresh())
    asyncio.run(there.list_own())
    (told,) = pages
    assert isinstance(told, RecordingsMessage)
    told.model_dump_json()
    assert {doc.name for doc in told.recordings if not doc.fault} == {"good.mcap"}
    (line,) = [doc for doc in told.recordings if doc.fault]
    assert fault in line.fault
    assert "good.mcap" in {each.name for each in there._own}
    for each in there._own:
        each.path.encode()


def test_what_nobody_foresaw_does_not_end_the_listing_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recordings_there, "LIST_EVERY_S", 0.0)
    tried = list[int]()

    class Desk:
        async def shelved(self) -> list[Any]:
            tried.append(1)
            raise ValueError("year 294247 is out of range")

    async def whole() -> None:
        desk: Any = Desk()
        none: Any = None
        there = RecordingsThere(none, none, Told(), desk, lambda: None, is_on=True, kb_s=8)
        loop = asyncio.ensure_future(there._list())
        while len(tried) < 3 and not loop.done():
            await asyncio.sleep(0)
        assert not loop.done()
        loop.cancel()
        with suppress(asyncio.CancelledError):
            await loop

    asyncio.run(whole())
