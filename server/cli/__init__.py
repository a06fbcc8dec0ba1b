"""The ``hedgehop`` command: the console's work without a browser.

Exit codes: 0 done, 1 not certified or failed, 2 wrong input.
"""

from __future__ import annotations

import typer

from planning import __version__
from server.cli.bench import bench
from server.cli.certify import certify
from server.cli.plan import plan
from server.cli.serve import serve
from server.cli.survey import survey

app = typer.Typer(
    name="hedgehop",
    help="Plan drone flights that hug the terrain, and prove their clearance.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def _options(version: bool = typer.Option(False, "--version", help="Print the version and exit.")) -> None:
    if version:
        typer.echo(f"hedgehop {__version__}")
        raise typer.Exit


app.command(epilog="Example: `hedgehop serve --demo`")(serve)
app.command(epilog="Example: `hedgehop plan dsm.tif pois.csv --out flight --profile f450-paper --rtl-height-m 60`")(
    plan
)
app.command(epilog="Example: `hedgehop certify dsm.tif mission.waypoints --position-error-m 0.1`")(certify)
app.command(epilog="Example: `hedgehop survey dsm.tif area.geojson --out flight --profile mapper-rtk --gsd-cm 1`")(
    survey
)
app.command(epilog="Example: `hedgehop bench`")(bench)


def main() -> None:
    """Entry point of the console script."""
    app()
