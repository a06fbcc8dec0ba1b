"""How commands answer: one JSON object or a few lines on stdout, everything else on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from typing import Any

import typer


def say(text: str) -> None:
    """A message for people: one line per event, control characters escaped."""
    typer.echo(harmless(text), err=True)


def say_notes(*notes: str | None) -> None:
    """One line each; None is left out."""
    for note in notes:
        if note is not None:
            say(f"Note: {note}")


def harmless(text: str) -> str:
    """The text with whatever a terminal might obey (escape sequences, new lines) written out."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def answer(summary: dict[str, Any], lines: Iterable[str], *, as_json: bool) -> None:
    """The one, or for people the other."""
    if as_json:
        print_json(summary)
    else:
        typer.echo("\n".join(lines))


def print_json(data: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(data, allow_nan=False) + "\n")


def progress(step: str, share: float | None) -> None:
    """A progress line that replaces itself, on a terminal only."""
    if sys.stderr.isatty():
        percent = "" if share is None else f" {100 * share:3.0f} %"
        sys.stderr.write(f"\r\x1b[K{step}{percent}")
        sys.stderr.flush()


def end_progress() -> None:
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
