"""How commands answer: one JSON object or a few lines on stdout, everything else on stderr."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from planning.errors import PlanningError
from server.errors import ServerError, error_doc

DONE, FAILED, WRONG_INPUT = 0, 1, 2


@contextmanager
def refusing(*, as_json: bool) -> Iterator[None]:
    """Wrong input ends the command with exit code 2, a message on stderr and, if asked, as JSON on stdout."""
    try:
        yield
    except (PlanningError, ServerError) as error:
        if as_json:
            print_json({"error": error_doc(error).model_dump()})
        say(f"Error: {error}")
        raise typer.Exit(WRONG_INPUT) from None
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        if as_json:
            document = {"code": "file", "what": error.strerror or str(error), "where": str(error.filename or "")}
            print_json({"error": {**document, "advice": "Check the path, its permissions and the free space."}})
        say(f"Error: {place}{error.strerror or error}. Check the path, its permissions and the free space.")
        raise typer.Exit(WRONG_INPUT) from None


def say(text: str) -> None:
    """A message for people: one line per event, control characters escaped."""
    typer.echo("".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text), err=True)


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


def write_files(directory: Path, files: dict[str, str]) -> None:
    """Writes each file beside its place and renames it: a full disk leaves the old one whole."""
    directory.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        handle, temporary = tempfile.mkstemp(dir=directory, prefix=f".{name}.")
        try:
            with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(temporary, 0o644)
            os.replace(temporary, directory / name)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise


def verdict_lines(summary: dict[str, Any]) -> list[str]:
    """A certificate in a few lines for the terminal."""
    lines = ["CERTIFIED" if summary["certified"] else "NOT CERTIFIED"]
    lines.append(
        f"  distance to the surface model at least {_metres(summary['min_distance_m'])} "
        f"(required {_metres(summary['required_clearance_m'])}), height above it at least "
        f"{_metres(summary['min_vertical_m'])}"
    )
    if summary["worst"] is not None:
        worst = summary["worst"]
        lines.append(
            f"  nearest at {worst['lat_deg']:.7f}, {worst['lon_deg']:.7f}, "
            f"{worst['alt_rel_home_m']:.2f} m above home, leg {worst['leg'] + 1}"
        )
    lines.append(f"  way home clear from RTL height {_metres(summary['rtl_height_needed_m'])} above home")
    for reason in summary["reasons"]:
        lines.append(f"  - {reason['text']} {reason['mend']}")
    return lines


def _metres(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2f} m"
