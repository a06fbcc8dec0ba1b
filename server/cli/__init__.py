"""The ``hedgehop`` command: the console's work without a browser.

Exit codes: 0 done, 1 not certified, not feasible or failed, 2 wrong input.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any, ClassVar

import typer
from typer.core import TyperGroup

from planning import __version__
from server.cli.shared import examples
from server.cli.shared.command import FAILED, run_command
from server.cli.shared.output import say
from server.work.guardian import become_guardian

UNGUARDED = "--no-guardian"
_PLAIN: dict[str, Any] = {"add_completion": False, "rich_markup_mode": "rich", "pretty_exceptions_enable": False}


class _Lazy(TyperGroup):
    """Each command is imported when it is asked for: one does not wait for what the others need."""

    places: ClassVar[dict[str, tuple[str, str]]]
    """Of each command: its function below this package, and the epilog of its help."""
    with_negative: ClassVar[frozenset[str]] = frozenset()
    """Commands whose arguments may begin with a minus."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = dict.fromkeys(self.places, None)  # type: ignore[assignment] # the names, for "Did you mean"

    def list_commands(self, ctx: Any) -> list[str]:
        del ctx
        return list(self.places)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        del ctx
        if cmd_name in _GROUPS and cmd_name in self.places:
            return typer.main.get_group(_GROUPS[cmd_name])
        if cmd_name not in self.places:
            return None
        place, epilog = self.places[cmd_name]
        module, _, function = place.rpartition(".")
        alone = typer.Typer(**_PLAIN)
        settings = {"ignore_unknown_options": cmd_name in self.with_negative}
        alone.command(cmd_name, epilog=epilog, context_settings=settings)(
            getattr(importlib.import_module(__name__ + module), function)
        )
        return typer.main.get_command(alone)


class _Commands(_Lazy):
    with_negative: ClassVar = frozenset({"goto", "home"})
    places: ClassVar = {
        "serve": (".serve_command.serve", examples.SERVE),
        "tls": (".door.tls_command.tls", examples.TLS),
        "stations": (".door.stations_command.stations", examples.STATIONS),
        "plan": (".plan_command.plan", examples.PLAN),
        "certify": (".judging.certify_command.certify", examples.CERTIFY),
        "risk": (".judging.risk_command.risk", examples.RISK),
        "survey": (".surveys.survey_command.survey", examples.SURVEY),
        "upload": (".upload_command.upload", examples.UPLOAD),
        "fence": (".places_command.fence", examples.FENCE),
        "rally": (".places_command.rally", examples.RALLY),
        "fly": (".flights.fly_command.fly", examples.FLY),
        "goto": (".flights.goto_command.goto", examples.GOTO),
        "home": (".flights.home_command.home", examples.HOME),
        "sim": (".sim_command.sim", examples.SIM),
        "review": (".review_command.review", examples.REVIEW),
        "scenario": (".scenario_command.scenario", examples.SCENARIO),
        "cloud": (".terrain.cloud_command.cloud", examples.CLOUD),
        "map": (".maps.map_command.build_map", examples.MAP),
        "bag": (".maps.bag_command.bag", examples.BAG),
        "export": (".maps.export_command.export", examples.EXPORT),
        "traversability": (".traversability_command.traversability", examples.TRAVERSABILITY),
        "agent": (".agent.agent_command.agent", examples.AGENT),
        "audit": (".audit_command.audit", examples.AUDIT),
        "bench": ("bench", examples.BENCH),
        "params": ("", ""),
        "logs": ("", ""),
        "radar": ("", ""),
        "ros2": ("", ""),
        "account": ("", ""),
        "library": ("", ""),
        "terrain": ("", ""),
    }


class _RadarCommands(_Lazy):
    places: ClassVar = {
        "process": (".radar.process_command.process", examples.RADAR_PROCESS),
        "tracks": (".radar.tracks_command.tracks", examples.RADAR_TRACKS),
    }


class _ParamsCommands(_Lazy):
    with_negative: ClassVar = frozenset({"set"})
    places: ClassVar = {
        "get": (".params.commands.get", examples.PARAMS_GET),
        "set": (".params.commands.set_", examples.PARAMS_SET),
        "save": (".params.commands.save", examples.PARAMS_SAVE),
        "load": (".params.commands.load", examples.PARAMS_LOAD),
        "compare": (".params.commands.compare", examples.PARAMS_COMPARE),
        "review": (".params.low_flight_command.review", examples.PARAMS_REVIEW),
    }


class _LogsCommands(_Lazy):
    places: ClassVar = {
        "list": (".logs.commands.list_", examples.LOGS_LIST),
        "get": (".logs.commands.get", examples.LOGS_GET),
    }


class _Ros2Commands(_Lazy):
    places: ClassVar = {
        "topics": (".agent.ros2.topics_command.topics", examples.ROS2_TOPICS),
        "publish": (".agent.ros2.publish_command.publish", examples.ROS2_PUBLISH),
    }


class _LibraryCommands(_Lazy):
    places: ClassVar = {
        "push": (".library.commands.push", examples.LIBRARY_PUSH),
        "pull": (".library.commands.pull", examples.LIBRARY_PULL),
        "list": (".library.commands.list_", examples.LIBRARY_LIST),
    }


class _TerrainCommands(_Lazy):
    places: ClassVar = {
        "catalogue": (".terrain.catalogue_command.catalogue", examples.TERRAIN_CATALOGUE),
        "dilate": (".terrain.dilate_command.dilate", examples.TERRAIN_DILATE),
    }


class _AccountCommands(_Lazy):
    places: ClassVar = {
        "add": (".door.account_command.add", examples.ACCOUNT_ADD),
        "list": (".door.account_command.list_", examples.ACCOUNT_LIST),
        "link": (".door.account_command.link", examples.ACCOUNT_LINK),
        "password": (".door.account_command.password", examples.ACCOUNT_PASSWORD),
        "remove": (".door.account_command.remove", examples.ACCOUNT_REMOVE),
    }


radar = typer.Typer(
    name="radar", help="Raw radar files.", no_args_is_help=True, rich_markup_mode="rich", cls=_RadarCommands
)
account = typer.Typer(
    name="account", help="Who may sign in.", no_args_is_help=True, rich_markup_mode="rich", cls=_AccountCommands
)
params = typer.Typer(
    name="params", help="The vehicle's parameters.", no_args_is_help=True, rich_markup_mode="rich", cls=_ParamsCommands
)
logs = typer.Typer(
    name="logs", help="Logs on the vehicle.", no_args_is_help=True, rich_markup_mode="rich", cls=_LogsCommands
)
ros2 = typer.Typer(
    name="ros2",
    help="A robot of ROS 2 by rmw_zenoh.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    cls=_Ros2Commands,
)
library = typer.Typer(
    name="library",
    help="One library on several machines.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    cls=_LibraryCommands,
)
terrain = typer.Typer(
    name="terrain", help="Surface models.", no_args_is_help=True, rich_markup_mode="rich", cls=_TerrainCommands
)
_GROUPS = {
    "radar": radar,
    "ros2": ros2,
    "account": account,
    "params": params,
    "logs": logs,
    "library": library,
    "terrain": terrain,
}
app = typer.Typer(
    name="hedgehop",
    help="Plan drone flights that hug the terrain, prove their clearance, fly and review them.",
    epilog=examples.EXIT_CODES,
    no_args_is_help=True,
    cls=_Commands,
    **_PLAIN,
)


@app.callback(invoke_without_command=True)
def _options(version: bool = typer.Option(False, "--version", help="Print the version and exit.")) -> None:
    if version:
        typer.echo(f"hedgehop {__version__}")
        raise typer.Exit


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
    if sys.argv[1:2] == ["serve"] and not {UNGUARDED, "--help"} & set(sys.argv):
        become_guardian(UNGUARDED)  # before anything large is loaded that the guardian would only leave behind
    sys.exit(run_command(app))
