"""``hedgehop fly --checklist``: asked on a terminal, never ticked by nobody."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from planning.errors import FormatError, ParameterError
from server.cli.shared.checklist_asked import check_checklist, ticked
from server.cli.shared.own_nodes import OPERATOR
from telemetry.errors import NotAllowedError
from tests.server.cli_runs import hedgehop
from tests.server.test_cli_flying import CHECKLIST, SHORT, write_mission


class Terminal(io.StringIO):
    """What a pilot types."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def checklist(tmp_path: Path) -> Path:
    file = tmp_path / "checklist.txt"
    file.write_text(CHECKLIST)
    return file


def test_without_a_terminal_the_flight_is_refused_before_anything_is_done(checklist: Path, tmp_path: Path) -> None:
    flight = write_mission(tmp_path / "short.waypoints", SHORT)
    run = hedgehop("fly", flight, "--link", "tcp:127.0.0.1:9", "--checklist", checklist, "--json")
    assert run.code == 2
    error = run.json["error"]
    assert "2 points, and there is no terminal" in error["what"]
    assert "--checklist-done-by" in error["advice"]
    assert "Connecting" not in run.err


@pytest.mark.parametrize("typed", ["y\ny\n", "yes\ny\n", "what\ny\ny\n"])
def test_each_point_is_asked_under_its_heading(
    checklist: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], typed: str
) -> None:
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    points = ticked(check_checklist(checklist, ""), "")
    assert [(point.text, point.ticked_by) for point in points] == [
        ("Propellers", OPERATOR.name),
        ("No people", OPERATOR.name),
    ]
    assert all(point.ticked_utc_s for point in points)
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.index("Vehicle") < said.err.index("Propellers") < said.err.index("Place")


@pytest.mark.parametrize("typed", ["n\n", "y\nn\n", "\n"])
def test_a_point_that_is_not_so_ends_it(checklist: Path, monkeypatch: pytest.MonkeyPatch, typed: str) -> None:
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    with pytest.raises(NotAllowedError, match="The checklist is open at") as caught:
        ticked(check_checklist(checklist, ""), "")
    assert "Nothing was sent" in caught.value.advice


def test_who_answers_for_the_list_is_named(checklist: Path) -> None:
    points = ticked(check_checklist(checklist, "Anna\x1b[2J "), "Anna\x1b[2J ")
    assert {point.ticked_by for point in points} == {"Anna[2J"}


def test_no_list_no_points_and_wrong_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check_checklist(None, "") == ()
    with pytest.raises(ParameterError, match="There is no checklist"):
        check_checklist(None, "Anna")
    empty = tmp_path / "empty.txt"
    empty.write_text("# only a heading\n")
    assert check_checklist(empty, "") == ()
    assert "nothing is asked" in capsys.readouterr().err
    for content, why in ((b"\x00\x01", "binary"), (b"x\n" * 61, "61 points"), (b"\xff\xfex\x00", "UTF-16")):
        empty.write_bytes(content)
        with pytest.raises(FormatError, match=why):
            check_checklist(empty, "Anna")
    with pytest.raises(FormatError, match="cannot be read"):
        check_checklist(tmp_path / "missing.txt", "Anna")
