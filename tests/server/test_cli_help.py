"""What ``hedgehop`` says of itself, and to a command line that it does not understand."""

from __future__ import annotations

import subprocess
import sys

import pytest

from planning import __version__
from tests.server.cli_runs import hedgehop


@pytest.mark.parametrize(
    "command", ["serve", "plan", "certify", "survey", "upload", "fence", "rally", "fly", "sim", "review", "bench"]
)
def test_help_has_examples(command: str) -> None:
    run = hedgehop(command, "--help")
    assert run.code == 0
    assert f"hedgehop {command}" in run.out.split("Examples:")[1]
    assert run.err == ""


def test_help_of_plan_names_the_defaults_that_a_profile_gives() -> None:
    words = " ".join(hedgehop("plan", "--help").out.replace("│", " ").split())
    assert "default: the profile's (650)." in words
    assert "--max-hole-m2" in words
    assert "f450-paper, generic-quad, mapper-rtk, x500-rtk-px4" in words


def test_overview() -> None:
    run = hedgehop("--help")
    assert run.code == 0
    assert "Exit codes: 0 done, 1 not certified, not feasible or failed, 2 wrong input." in run.out


def test_version() -> None:
    assert hedgehop("--version").out == f"hedgehop {__version__}\n"


def test_no_command_shows_the_help() -> None:
    run = hedgehop()
    assert run.code == 2
    assert "certify" in run.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("soar",), "No such command 'soar'."),
        (("plan",), "Missing argument"),
        (("plan", "a", "b", "--out", "c", "--wings", "2"), "No such option: --wings"),
        (("plan", "a", "b", "--out", "c", "--radius-m", "wide"), "--radius-m"),
    ],
)
def test_misunderstood(arguments: tuple[str, ...], words: str) -> None:
    run = hedgehop(*arguments)
    assert run.code == 2
    assert run.out == ""
    assert run.err.startswith("Error: ")
    assert words in run.err
    assert run.err.rstrip().endswith("--help")
    assert len(run.err.splitlines()) == 1
    assert hedgehop(*arguments, "--json").json["error"]["code"] == "usage"


def test_as_a_process() -> None:
    command = [sys.executable, "-c", "from server.cli import main; main()", "plan", "no.tif", "no.csv", "--out", "x"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("Error: no.csv: The file cannot be read: No such file or directory.")
