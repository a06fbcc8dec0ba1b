"""A log that somebody keeps in a file stays within its limit; a terminal's or a pipe's is nobody's to cut."""

from __future__ import annotations

import io
import logging
import os
from pathlib import Path
from typing import Literal

import pytest

from server.work.logs import LimitedStderr


def said(handler: LimitedStderr, text: str, times: int) -> None:
    for number in range(times):
        handler.emit(logging.LogRecord("x", logging.INFO, "x", 1, f"{text} {number}", None, None))


@pytest.mark.parametrize("mode", ["w", "a"])
def test_a_file_is_begun_anew_and_what_was_before_is_kept(tmp_path: Path, mode: Literal["w", "a"]) -> None:
    file = tmp_path / "hedgehop.log"
    with file.open(mode, encoding="utf-8") as stream:
        handler = LimitedStderr(stream, most_bytes=1000)
        said(handler, "a line of the log", 200)
        os.write(stream.fileno(), b"another process\n")
    before = tmp_path / "hedgehop.log.1"
    assert file.stat().st_size <= 1000
    assert 1000 < before.stat().st_size < 1100
    assert before.stat().st_mode & 0o077 == 0
    whole = before.read_text(encoding="utf-8") + file.read_text(encoding="utf-8")
    assert "\0" not in whole
    lines = whole.splitlines()
    assert lines[-2:] == ["a line of the log 199", "another process"]
    numbers = [int(line.rpartition(" ")[2]) for line in lines[:-1]]
    assert numbers == list(range(numbers[0], 200))


def test_where_it_cannot_be_kept_it_is_emptied_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "hedgehop.log.1").mkdir()
    with (tmp_path / "hedgehop.log").open("w", encoding="utf-8") as stream:
        said(LimitedStderr(stream, most_bytes=1000), "a line of the log", 200)
    assert (tmp_path / "hedgehop.log").stat().st_size <= 1000


def test_a_pipe_and_what_is_no_file_are_left_alone() -> None:
    reading, writing = os.pipe()
    with os.fdopen(writing, "w", encoding="utf-8") as stream, os.fdopen(reading, encoding="utf-8") as out:
        said(LimitedStderr(stream, most_bytes=10), "all of it", 3)
        stream.flush()
        assert [out.readline() for _ in range(3)][-1] == "all of it 2\n"
    memory = io.StringIO()
    said(LimitedStderr(memory, most_bytes=10), "all of it", 3)
    assert memory.getvalue().count("\n") == 3
