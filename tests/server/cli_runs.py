"""Runs ``hedgehop`` inside the test's own process, and the files that its tests share."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planning.ground.demo_hillside import demo_dsm, demo_pois
from planning.terrain.geotiff import write_dsm
from server.cli import app
from server.cli.shared.command import run_command
from tests.planning.format_examples import write_pois_csv


@dataclass(frozen=True)
class Run:
    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        return json.loads(self.out)


def hedgehop(*arguments: object) -> Run:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run_command(app, [str(argument) for argument in arguments])
    return Run(code, out.getvalue(), err.getvalue())


def write_demo(folder: Path) -> tuple[Path, Path]:
    """The demo surface model with its points."""
    model, points = folder / "demo.tif", folder / "demo.csv"
    write_dsm(model, demo_dsm())
    points.write_text(write_pois_csv(demo_pois()))
    return model, points


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
