"""``hedgehop bench``: the speed of what Hedgehop does itself, against the alternatives, in one run."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import typer

from server.cli.shared.output import FAILED, say


def bench() -> None:
    """Measure the kernels against scipy, OpenCV and others, and print the ratios."""
    root = Path(__file__).resolve().parents[2]
    if not (root / "tests" / "bench").is_dir():
        say("Error: the benchmarks lie in the source tree. Clone the project and run: make bench")
        raise typer.Exit(FAILED)
    sys.path.insert(0, str(root))
    importlib.import_module("tests.bench.__main__").main()
