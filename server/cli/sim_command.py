"""``hedgehop sim``: a simulated vehicle that any ground station can fly."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from typer import Option

from planning.basics.limits import LARGEST_SEED
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import say
from telemetry.nodes.simulator import read_home, read_parameter
from telemetry.simulation.simulator.airframe.gnss_script import read_event
from telemetry.simulation.simulator.autopilot.personality import Make
from telemetry.simulation.simulator.run import SimOptions, run


@command
def sim(
    *,
    link: Annotated[
        str,
        Option(
            metavar="URL", help="Where ground stations find it: udpout:HOST:PORT, udpin:HOST:PORT or tcpin:HOST:PORT."
        ),
    ],
    home: Annotated[str, Option(metavar="LAT,LON,ALT", help="Where it stands; metres above sea level.")],
    autopilot: Annotated[
        Make, Option(help="Whose behaviour it has: ArduCopter's (4.7) or PX4's (1.17).")
    ] = "ardupilot",
    speedup: Annotated[float, Option(help="Simulated seconds per second.")] = 1.0,
    seed: Annotated[int, Option(min=0, max=LARGEST_SEED, help="Of wind gusts and GNSS errors.")] = 0,
    gnss: Annotated[Literal["standalone", "rtk", "perfect"], Option(help="Its receiver.")] = "rtk",
    wind_m_s: Annotated[float, Option(help="Mean wind speed.")] = 0.0,
    dsm: Annotated[
        Path | None, Option(metavar="FILE", help="Surface model that it can hit; default: level ground.")
    ] = None,
    world: Annotated[
        Path | None, Option(metavar="FILE", help="World file: what else it can hit (docs/worlds.md).")
    ] = None,
    gnss_event: Annotated[
        list[str] | None,
        Option(
            metavar="EVENT",
            help="loss:START:SECONDS or glitch:START:SECONDS:METRES[:BEARING]; may be given several times.",
        ),
    ] = None,
    parameter: Annotated[
        list[str] | None, Option(metavar="NAME=VALUE", help="Of the autopilot; may be given several times.")
    ] = None,
    parameter_errors: Annotated[
        bool, Option("--parameter-errors", help="It says so when it has no such parameter, as newer firmware does.")
    ] = False,
) -> None:
    """Simulate a vehicle on a MAVLink connection until Ctrl+C."""
    lat_deg, lon_deg, alt_m = read_home(home)
    options = SimOptions(
        home_lat_deg=lat_deg,
        home_lon_deg=lon_deg,
        home_alt_amsl_m=alt_m,
        autopilot=autopilot,
        link=link,
        speedup=speedup,
        seed=seed,
        gnss=gnss,
        wind_m_s=wind_m_s,
        dsm=o.existing(dsm),
        world=o.existing(world),
        gnss_script=tuple(read_event(text) for text in gnss_event or ()),
        parameter_errors=parameter_errors,
        parameters=tuple(read_parameter(text) for text in parameter or ()),
    )
    run(options, announce=say)
