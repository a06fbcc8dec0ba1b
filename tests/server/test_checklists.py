"""Checklists on disk: kept for each profile, never lost to somebody else's change, never silently taken for empty."""

from __future__ import annotations

from pathlib import Path

import pytest

from planning.errors import FormatError
from server.errors import ConflictError, StorageError
from server.flying.checklists import FILE, MOST_LISTS, Checklists

NOTHING = Checklists(Path("nowhere")).of("Quad").revision


def test_a_list_is_of_its_profile_and_outlives_the_server(tmp_path: Path) -> None:
    lists = Checklists(tmp_path)
    assert (lists.of("Quad").text, lists.points("Quad")) == ("", ())
    kept = lists.write("Quad", "# Vehicle\r\nPropellers  \n\n\n", instead_of=NOTHING, by="Anna")
    assert (kept.text, kept.before, kept.changed_by) == ("# Vehicle\nPropellers\n", None, "Anna")
    again = Checklists(tmp_path)
    assert again.of("Quad") == kept
    assert [(point.heading, point.text) for point in again.points("Quad")] == [("Vehicle", "Propellers")]
    assert again.points("Other") == ()


def test_a_change_can_be_taken_back(tmp_path: Path) -> None:
    lists = Checklists(tmp_path)
    first = lists.write("Quad", "one", instead_of=NOTHING, by="Anna")
    emptied = lists.write("Quad", "", instead_of=first.revision, by="Ben")
    assert (emptied.text, emptied.before, lists.points("Quad")) == ("", "one\n", ())
    back = lists.write("Quad", emptied.before or "", instead_of=emptied.revision, by="Ben")
    assert (back.text, back.before) == ("one\n", "")
    same = lists.write("Quad", "one", instead_of=back.revision, by="Anna")
    assert same == back


def test_nobody_overwrites_what_they_have_not_seen(tmp_path: Path) -> None:
    lists = Checklists(tmp_path)
    lists.write("Quad", "one", instead_of=NOTHING, by="Anna")
    with pytest.raises(ConflictError, match="Anna has changed this checklist meanwhile"):
        lists.write("Quad", "two", instead_of=NOTHING, by="Ben")
    assert lists.of("Quad").text == "one\n"


def test_what_is_too_long_changes_nothing(tmp_path: Path) -> None:
    lists = Checklists(tmp_path)
    first = lists.write("Quad", "one", instead_of=NOTHING, by="Anna")
    with pytest.raises(FormatError, match="61 points"):
        lists.write("Quad", "point\n" * 61, instead_of=first.revision, by="Anna")
    assert Checklists(tmp_path).of("Quad") == first


def test_there_are_no_more_lists_than_a_file_holds_well(tmp_path: Path) -> None:
    lists = Checklists(tmp_path)
    for number in range(MOST_LISTS):
        lists.write(f"Quad {number}", "one", instead_of=NOTHING, by="Anna")
    with pytest.raises(ConflictError, match="200 checklists already"):
        lists.write("Quad more", "one", instead_of=NOTHING, by="Anna")


@pytest.mark.parametrize("content", [b'{"Quad": {"text": "one', b"[]", b"\xff\xfe", b'{"Quad": {"text": 7}}'])
def test_a_damaged_file_is_left_alone_and_no_list_is_taken_for_empty(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).write_bytes(content)
    lists = Checklists(tmp_path)
    with pytest.raises(StorageError, match="cannot be read"):
        lists.points("Quad")
    with pytest.raises(StorageError, match="cannot be read"):
        lists.write("Quad", "two", instead_of=NOTHING, by="Anna")
    assert (tmp_path / FILE).read_bytes() == content


def test_a_file_with_a_list_that_is_too_long_is_said(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"Quad": {"text": "' + "point\\n" * 61 + '"}}')
    with pytest.raises(StorageError, match="61 points"):
        Checklists(tmp_path).points("Quad")
