"""The ``hedgehop`` command: the console's work without a browser.

Exit codes: 0 done, 1 not certified, not feasible or failed, 2 wrong input.
"""

from __future__ import annotations

import sys

import typer

from planning import __version__
from server.cli import examples
from server.cli.agent import agent
from server.cli.bench import bench
from server.cli.certify import certify
from server.cli.fly import fly
from server.cli.map import build_map
from server.cli.plan import plan
from server.cli.radar import radar
from server.cli.radar_tracks import tracks
from server.cli.review import review
from server.cli.scenario import scenario
from server.cli.serve import serve
from server.cli.sim import sim
from server.cli.survey import survey
from server.cli.traversability import traversability
from server.cli.upload import upload
from server.cli.usage import run_command

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
app.command(epilog=examples.BENCH)(bench)


def main() -> None:
    """Entry point of the console script."""
    sys.exit(run_command(app))
