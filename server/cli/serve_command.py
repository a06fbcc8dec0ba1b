"""``hedgehop serve``: the ground station in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from server.app import run
from server.cli.shared.command import command
from server.settings import Settings, load_settings
from telemetry.topics.vehicle import RadarKind

_USUAL = Settings.model_fields


@command
def serve(
    *,
    demo: Annotated[bool, Option("--demo", help="Open the generated demo, with a simulated vehicle.")] = False,
    host: Annotated[str | None, Option(help=f"Address to listen on; default {_USUAL['host'].default}.")] = None,
    port: Annotated[int | None, Option(help=f"Port; default {_USUAL['port'].default}.")] = None,
    behind_proxy: Annotated[
        bool | None,
        Option("--behind-proxy", help="Plain HTTP beyond this machine all the same: a proxy adds TLS."),
    ] = None,
    demo_world: Annotated[
        bool | None,
        Option("--demo-world/--no-demo-world", help="Whether the demo's vehicle meets obstacles that it has to see."),
    ] = None,
    radar: Annotated[
        RadarKind | None,
        Option(
            help="How the demo's radar, an AWR1843, is simulated: its targets (model, the default) or its samples, "
            "processed (iq)."
        ),
    ] = None,
    link: Annotated[
        list[str] | None,
        Option(
            metavar="ADDRESS", help="Connection to a vehicle, such as udpin:0.0.0.0:14550; may be given several times."
        ),
    ] = None,
    vehicle: Annotated[
        list[str] | None,
        Option(metavar="NAME=LINK[,LINK]", help="One of several vehicles and its connections; once for each of them."),
    ] = None,
    demo_vehicles: Annotated[int | None, Option(help="How many simulated vehicles the demo has; default 1.")] = None,
    demo_autopilots: Annotated[
        str | None,
        Option(
            metavar="NAME,...",
            help="ardupilot or px4, for each of the demo's vehicles; default: ardupilot.",
        ),
    ] = None,
    data_dir: Annotated[
        Path | None, Option(help="Where models and plans are kept; default: the user's data home.")
    ] = None,
    no_guardian: Annotated[
        bool,
        Option(
            "--no-guardian",
            help="Without the process that starts a dead or hung server again: for debuggers.",
        ),
    ] = False,
) -> None:
    """Start the ground station and print a sign-in link for the browser."""
    del no_guardian  # looked at before this process became the server
    settings = load_settings(
        host=host,
        port=port,
        behind_proxy=behind_proxy,
        data_dir=data_dir,
        link=link or None,
        vehicle=vehicle or None,
        demo_vehicles=demo_vehicles,
        demo_autopilots=demo_autopilots,
        demo_world=demo_world,
        demo_radar=radar,
    )
    run(settings, demo=demo)
