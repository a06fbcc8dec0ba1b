"""The table tells what holds from what does not."""

from __future__ import annotations

from typing import Any

import pytest

from tests.conftest import ROOT
from tests.telemetry.mission_vehicles import ArduCopter
from tests.trust import attempts, link
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
    passed = dict.fromkeys(files, (3, 0, 0)) | {"tests/server/test_guard.py": (2, 1, 0)}
    del passed["tests/server/test_hub.py"]
    monkeypatch.setattr(attempts, "_results", lambda _: passed)
    assert {row.name for row in attempts.attempt_rows() if row.verdict == "FAILS"} == {"S1", "S2", "S6", "R13"}


def test_results_are_counted_by_file() -> None:
    file = "tests/telemetry/test_bus_sockets.py"
    passed, failed, _ = attempts._results([file])[file]
    assert passed > 0
    assert failed == 0
