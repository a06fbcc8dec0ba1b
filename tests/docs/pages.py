"""The documents as tests read them: pages, code blocks, tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tests.conftest import ROOT

DOCS = ROOT / "docs"
PAGES = tuple(sorted(DOCS.glob("*.md")))
READ_BY_PEOPLE = (*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "docker" / "README.md")

_BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block of code, its indentation within a list taken away."""

    page: Path
    language: str
    text: str


def text_of(page: str) -> str:
    return (DOCS / f"{page}.md").read_text(encoding="utf-8")


def blocks(page: Path) -> list[Block]:
    found = _BLOCK.findall(page.read_text(encoding="utf-8"))
    return [Block(page, language, re.sub(f"^{indent}", "", text, flags=re.M)) for indent, language, text in found]


def without_blocks(page: Path) -> str:
    return _BLOCK.sub("", page.read_text(encoding="utf-8"))


def rows(page: str, header: str) -> list[list[str]]:
    """The cells of each row of every table whose first heading this is."""
    found: list[list[str]] = []
    for table in re.findall(r"(?:^\|.*\|\n)+", text_of(page), re.MULTILINE):
        lines = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in table.splitlines()]
        if lines[0][0] == header:
            found += lines[2:]
    assert found, f"no table of {header!r} in {page}.md"
    return found


def code_names(cell: str) -> list[str]:
    """What stands between backticks."""
    return re.findall(r"`([^`]+)`", cell)
