"""Each finding on real autopilots is held by tests that name it, and no test names one that is not there."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator

import pytest

from tests.conftest import ROOT
from tests.docs.pages import code_names, rows

TESTS = ROOT / "tests"
TABLE = {number: (words, code_names(held_by)) for number, words, held_by in rows("measured_facts", "Finding")}


def _findings_of(function: ast.stmt) -> Iterator[str]:
    """What its ``@pytest.mark.fact("A1", ...)`` names."""
    for decorator in function.decorator_list if isinstance(function, ast.FunctionDef) else ():
        if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) == "pytest.mark.fact":
            yield from (ast.literal_eval(one) for one in decorator.args)


@pytest.fixture(scope="module")
def named() -> dict[str, list[str]]:
    """The tests that name each finding, as the table writes them: of files and functions that pytest collects."""
    found = defaultdict(list)
    for path in sorted(TESTS.rglob("test_*.py")):
        for function in ast.parse(path.read_text(encoding="utf-8")).body:
            for number in _findings_of(function):
                assert isinstance(function, ast.FunctionDef)
                assert function.name.startswith("test_"), f"{path.name}: {function.name} is not collected"
                found[number].append(f"{path.relative_to(TESTS).as_posix()}::{function.name}")
    return found


def test_findings_are_numbered_without_a_gap() -> None:
    assert all(re.fullmatch(r"[AP]\d+", number) for number in TABLE)
    for autopilot in "AP":
        numbers = [int(number[1:]) for number in TABLE if number[0] == autopilot]
        assert numbers == list(range(1, len(numbers) + 1))
        assert numbers
    assert len(TABLE) == len(rows("measured_facts", "Finding")), "a number stands twice"


@pytest.mark.parametrize("number", TABLE)
def test_each_finding_is_held_by_the_tests_that_name_it(named: dict[str, list[str]], number: str) -> None:
    words, tests = TABLE[number]
    assert words
    assert tests
    assert sorted(tests) == sorted(named[number])


def test_no_test_names_a_finding_that_is_not_in_the_table(named: dict[str, list[str]]) -> None:
    assert set(named) <= set(TABLE)
