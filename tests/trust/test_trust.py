"""The table tells what holds from what does not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.telemetry.mission_vehicles import ArduCopter
from tests.trust import attempts, link
from tests.trust.attempts import Tried
from tests.trust.growth import LongFlight, growth_row
from tests.trust.missions import missions_row


def test_few_of_each_hold() -> None:
    rows = [*link.link_rows(uploads=2, cuts=10, commands=5, frames=2000), missions_row(20)]
    assert [row.name for row in rows] == ["R1", "R1", "R1", "R2", "R3", "R6", "R7", "R16"]
    assert [str(row) for row in rows if row.verdict != "holds"] == []


class Forgetful(ArduCopter):
    """Says that it has stored what it has not."""

    def keep(self, item: Any) -> Any:
        kept = super().keep(item)
        kept.x += 10 * (item.seq == 3)
        return kept


def test_a_vehicle_that_stores_something_else_fails_its_row() -> None:
    assert link._lossy(Forgetful, 1).verdict == "FAILS"


def test_a_check_that_passes_what_is_unsafe_fails_its_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.trust.missions.is_safe", lambda *_: False)
    assert missions_row(5).verdict == "FAILS"


def test_a_short_flight_grows_by_nothing() -> None:
    assert growth_row(0.02).verdict == "holds"


def test_a_link_that_keeps_every_state_fails_its_row(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[object] = []
    publish = LongFlight.publish

    def keeps(self: LongFlight, topic: str, message: Any) -> None:
        kept.append([topic])
        publish(self, topic, message)

    monkeypatch.setattr(LongFlight, "publish", keeps)
    monkeypatch.setattr("tests.trust.growth.MOST_OBJECTS", 100)
    assert growth_row(0.02).verdict == "FAILS"


def test_every_file_of_the_table_is_there_and_one_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    files = {file for _, _, files in attempts.HELD for file in files}
    assert [file for file in files if not (ROOT / file).is_file()] == []
    passed = dict.fromkeys(files, Tried(3)) | {"tests/server/test_guard.py": Tried(2, failed=("test_x (it let in)",))}
    del passed["tests/server/test_hub.py"]
    monkeypatch.setattr(attempts, "_results", lambda _: passed)
    failed = {row.name: row.figure for row in attempts.attempt_rows() if row.verdict == "FAILS"}
    assert failed.keys() == {"S1", "S2", "S6", "R13"}
    assert "test_x (it let in)" in failed["S1"]
    assert "test_hub.py could not be run" in failed["R13"]


def test_results_are_counted_by_file() -> None:
    file = "tests/telemetry/test_bus_sockets.py"
    tried = attempts._results([file])[file]
    assert tried.passed > 0
    assert tried.failed == ()


def test_what_failed_is_named_with_its_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "test_one.py").write_text("def test_it():\n    assert False, 'the door was open'\n")
    monkeypatch.setattr(attempts, "ROOT", tmp_path)
    (tried,) = attempts._results(["test_one.py"]).values()
    assert (tried.passed, tried.failed) == (0, ("test_it (AssertionError: the door was open)",))
