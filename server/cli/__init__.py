"""The ``hedgehop`` command: the console's work without a browser.

Exit codes: 0 done, 1 not certified, not feasible or failed, 2 wrong input.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import typer

from planning import __version__
from server.cli.agent_command import agent
from server.cli.certify_command import certify
from server.cli.fly_command import fly
from server.cli.map_command import build_map
from server.cli.plan_command import plan
from server.cli.radar_command import radar
from server.cli.radar_tracks_command import tracks
from server.cli.review_command import review
from server.cli.scenario_command import scenario
from server.cli.serve_command import serve
from server.cli.shared import examples
from server.cli.shared.command import FAILED, run_command
from server.cli.shared.output import say
from server.cli.sim_command import sim
from server.cli.survey_command import survey
from server.cli.traversability_command import traversability
from server.cli.upload_command import upload

app = typer.Typer(
    name="hedgehop",
    help="Plan drone flights that hug the terrain, prove their clearance, fly and review them.",
    epilog=examples.EXIT_CODES,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def _options(version: bool = typer.Option(False, "--version", help="Print the version and exit.")) -> None:
    if version:
        typer.echo(f"hedgehop {__version__}")
        raise typer.Exit


app.command(epilog=examples.SERVE)(serve)
app.command(epilog=examples.PLAN)(plan)
app.command(epilog=examples.CERTIFY)(certify)
app.command(epilog=examples.SURVEY)(survey)
app.command(epilog=examples.UPLOAD)(upload)
app.command(epilog=examples.FLY)(fly)
app.command(epilog=examples.SIM)(sim)
app.command(epilog=examples.REVIEW)(review)
app.command(epilog=examples.SCENARIO)(scenario)
app.command("map", epilog=examples.MAP)(build_map)
app.command(epilog=examples.TRAVERSABILITY)(traversability)
app.command(epilog=examples.AGENT)(agent)
radar.command("tracks", epilog=examples.RADAR_TRACKS)(tracks)
app.add_typer(radar)


@app.command(epilog=examples.BENCH)
def bench() -> None:
    """Measure the kernels against scipy, OpenCV and others, and print the ratios."""
    root = Path(__file__).resolve().parents[2]
    if not (root / "tests" / "bench").is_dir():
        say("Error: the benchmarks lie in the source tree. Clone the project and run: make bench")
        raise typer.Exit(FAILED)
    sys.path.insert(0, str(root))
    importlib.import_module("tests.bench.__main__").main()


def main() -> None:
    """Entry point of the console script."""
    sys.exit(run_command(app))
