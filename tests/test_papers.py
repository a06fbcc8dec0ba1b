"""docs/papers.md and the comments in the code name the same equations in the same functions."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.conftest import ROOT

FLOORS = ("mapping", "planning", "telemetry", "server")
DOCUMENT = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
EQUATIONS = {
    "Melita 2020": ["1", "2"],
    "Miccinesi 2022": ["1", "2", "3", "4", "5", "6"],
    "Bigazzi 2022": ["1", "2", "A1"],
    "Wessendorp 2021": ["1", "2", "3", "4", "5", "6"],
    "Ahtiainen": ["1", "2", "3", "4", "5", "6", "7"],
}
"""All that the papers number."""
PAPER = "|".join(EQUATIONS)
PLACE = r"(?:eq\.|fig\.|table|section) \w+"
WHOLE = re.compile(rf"# ({PAPER}), ({PLACE}(?:, {PLACE})*)")
LOOSE = re.compile(rf"\beqs?\b\.? ?\(?[A\d]|^# ?(?:{PAPER})")
ROW = re.compile(rf"^\| ({PAPER}), ({PLACE}) \| [^|]+ \| (?:`([^`|]+)` \| `([^`|]+)`|- \| -) \|$", re.MULTILINE)


class Computed(NamedTuple):
    """Where an equation or a figure is worked out."""

    paper: str
    place: str
    file: str
    function: str


def functions(tree: ast.AST, within: str = "") -> Iterator[tuple[int, int, str]]:
    """First line, last line and dotted name of every function and method, inner ones after outer ones."""
    for node in ast.iter_child_nodes(tree):
        name = within
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            name = f"{within}.{node.name}".lstrip(".")
            if not isinstance(node, ast.ClassDef):
                yield node.lineno, node.end_lineno or node.lineno, name
        yield from functions(node, name)


def comments(path: Path) -> list[tuple[int, str]]:
    lines = io.StringIO(path.read_text(encoding="utf-8")).readline
    return [(t.start[0], t.string) for t in tokenize.generate_tokens(lines) if t.type == tokenize.COMMENT]


def in_code() -> Iterator[Computed]:
    for path in sorted(path for floor in FLOORS for path in (ROOT / floor).rglob("*.py")):
        cited = [(line, match) for line, comment in comments(path) if (match := WHOLE.fullmatch(comment))]
        if not cited:
            continue
        spans = list(functions(ast.parse(path.read_text(encoding="utf-8"))))
        for line, match in cited:
            name = next((name for first, last, name in reversed(spans) if first <= line <= last), "")
            for place in match[2].split(", "):
                yield Computed(match[1], place, str(path.relative_to(ROOT)), name)


@pytest.fixture(scope="module")
def rows() -> list[tuple[str, str, str, str]]:
    """Of the document; file and function are empty where nothing computes it."""
    return ROW.findall(DOCUMENT)


def test_every_row_can_be_read(rows: list[tuple[str, str, str, str]]) -> None:
    lines = [line for line in DOCUMENT.splitlines() if re.match(rf"\| (?:{PAPER})\b", line)]
    assert len(lines) == len(rows) == len(set(rows))
    assert len(rows) > 40


def test_document_and_code_name_the_same_places(rows: list[tuple[str, str, str, str]]) -> None:
    named = {Computed(*row) for row in rows if row[2]}
    computed = set(in_code())
    assert named - computed == set()
    assert computed - named == set()


def test_every_numbered_equation_has_a_row(rows: list[tuple[str, str, str, str]]) -> None:
    numbered = {(paper, f"eq. {number}") for paper, numbers in EQUATIONS.items() for number in numbers}
    assert {(paper, place) for paper, place, _, _ in rows if place.startswith("eq.")} == numbered


def test_comments_name_equations_in_one_form() -> None:
    paths = [path for floor in FLOORS for path in (ROOT / floor).rglob("*.py")]
    loose = [
        f"{path.relative_to(ROOT)}:{line}: {comment}"
        for path in paths
        for line, comment in comments(path)
        if LOOSE.search(comment) and not WHOLE.fullmatch(comment)
    ]
    assert loose == []
