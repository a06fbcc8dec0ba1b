"""How commands answer: one JSON object or a few lines on stdout, everything else on stderr."""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

from planning.errors import DescribedError
from telemetry.errors import AddressError, RecordingError, TelemetryError

DONE, FAILED, WRONG_INPUT = 0, 1, 2


@contextmanager
def refusing(*, as_json: bool) -> Iterator[None]:
    """Wrong input ends the command with exit code 2, a message on stderr and, if asked, as JSON on stdout.

    What a vehicle, a link or nobody foresaw ends it with 1; in the last case the message says where it happened.
    """
    try:
        yield
    except (typer.Exit, typer.Abort, BrokenPipeError):
        raise
    except DescribedError as error:
        _answer_error(error.code, error.what, error.where, error.advice, as_json=as_json)
        in_flight = isinstance(error, TelemetryError) and not isinstance(error, AddressError | RecordingError)
        raise typer.Exit(FAILED if in_flight else WRONG_INPUT) from None
    except OSError as error:
        what = f"{error.strerror or error}."
        advice = "Check the path, its permissions and the free space."
        _answer_error("file", what, str(error.filename or ""), advice, as_json=as_json)
        raise typer.Exit(WRONG_INPUT) from None
    except MemoryError:
        advice = "Use a coarser model, a smaller area or a larger sampling step."
        _answer_error("memory", "There is not enough memory.", "", advice, as_json=as_json)
        raise typer.Exit(FAILED) from None
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        what = f"Something in Hedgehop itself went wrong: {type(error).__name__}: {error}."
        advice = "Please report it with the command and its files."
        _answer_error("internal", what, f"{place.filename}:{place.lineno}", advice, as_json=as_json)
        raise typer.Exit(FAILED) from None


def _answer_error(code: str, what: str, where: str, advice: str, *, as_json: bool) -> None:
    end_progress()
    if as_json:
        print_json({"error": {"code": code, "what": what, "where": where, "advice": advice}})
    head = f"{where}: {what}" if where else what
    say(f"Error: {head} {advice}".rstrip())


def say(text: str) -> None:
    """A message for people: one line per event, control characters escaped."""
    typer.echo(harmless(text), err=True)


def harmless(text: str) -> str:
    """The text with whatever a terminal might obey (escape sequences, new lines) written out."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


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
