"""Every command in the documents is one that the command line and the Makefile know, with these options."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer.main
from typer.core import TyperCommand, TyperGroup

from server.cli import app
from tests.conftest import ROOT
from tests.docs.pages import READ_BY_PEOPLE, blocks

PAGES_WITH_COMMANDS = [
    page for page in READ_BY_PEOPLE if re.search(r"(^|`|/)hedgehop \w", page.read_text(encoding="utf-8"), re.M)
]


def _commands(page: Path) -> Iterator[list[str]]:
    """The words after ``hedgehop``, of code blocks and of `hedgehop ...` within a sentence."""
    text = page.read_text(encoding="utf-8")
    lines = [line for block in blocks(page) if block.language == "sh" for line in block.text.splitlines()]
    lines += re.findall(r"`(hedgehop [^`]+)`", text)
    for line in lines:
        for part in line.split("|"):
            _, found, rest = f" {part.partition(' #')[0]}".replace("/hedgehop", " hedgehop").partition(" hedgehop ")
            if found:
                yield shlex.split(rest)


def _takes(command: TyperCommand | TyperGroup, words: list[str]) -> None:
    known = {name: option for option in command.params for name in (*option.opts, *option.secondary_opts)}
    for word in words:
        if word.startswith("--"):
            name, _, _ = word.partition("=")
            assert name in known or name == "--help", f"{command.name} has no {name}"


@pytest.mark.parametrize("page", PAGES_WITH_COMMANDS, ids=lambda page: page.name)
def test_the_command_line_knows_the_commands_of_a_page(page: Path) -> None:
    found = list(_commands(page))
    assert found
    for words in found:
        command = typer.main.get_command(app)
        while isinstance(command, TyperGroup) and words and not words[0].startswith("-"):
            name, *words = words
            within = command
            command = within.get_command(typer.Context(within), name)
            assert command is not None, f"hedgehop has no {name}"
        assert isinstance(command, TyperCommand | TyperGroup)
        _takes(command, words)


def test_the_makefile_knows_its_tasks() -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for page in READ_BY_PEOPLE:
        inline = re.findall(r"`make ([a-z]+)", page.read_text(encoding="utf-8"))
        in_blocks = [name for block in blocks(page) for name in re.findall(r"^make ([a-z]+)", block.text, re.MULTILINE)]
        assert {*inline, *in_blocks} <= targets, page
