"""Runs the command and answers a wrong command line as any other wrong input is answered."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer
from typer.exceptions import Abort, TyperException

from server.cli.shared.output import FAILED, WRONG_INPUT, print_json, say


def run_command(app: typer.Typer, arguments: Sequence[str] | None = None) -> int:
    """The exit code of ``hedgehop`` with these arguments (the process's own by default)."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        return int(app(given, prog_name="hedgehop", standalone_mode=False) or 0)
    except TyperException as error:
        _refuse(error, as_json="--json" in given)
        return WRONG_INPUT
    except Abort:
        say("Stopped.")
        return FAILED


def _refuse(error: TyperException, *, as_json: bool) -> None:
    what = " ".join(error.format_message().replace("Value error, ", "").split())
    if not what:  # no arguments at all: the help was the answer
        return
    what += "" if what.endswith((".", "?")) else "."
    context = getattr(error, "ctx", None)
    command = "hedgehop" if context is None else context.command_path
    advice = f"Try: {command} --help"
    if as_json:
        print_json({"error": {"code": "usage", "what": what, "where": command, "advice": advice}})
    say(f"Error: {what} {advice}")
