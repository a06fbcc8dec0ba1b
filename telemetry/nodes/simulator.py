"""The simulator node: ``python -m telemetry.nodes.simulator --home LAT,LON,ALT [--link URL] [--runtime DIR] ...``.

With ``--runtime`` it is one of the supervised nodes and ends by itself when it is disarmed and no server has been
there for long; without, it runs until it is stopped, and needs no bus.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from planning.errors import DescribedError, ParameterError
from telemetry.bus.bus import Bus
from telemetry.bus.node import EXIT_ENDED, EXIT_REFUSED, LOOK_EVERY_S, NodeContext, run_node
from telemetry.simulation.simulator.airframe.gnss import RECEIVERS
from telemetry.simulation.simulator.airframe.gnss_script import read_event
from telemetry.simulation.simulator.autopilot.personality import MAKES
from telemetry.simulation.simulator.run import SimOptions, Simulator, flying, run
from telemetry.topics.messages import Topic

_log = logging.getLogger(__name__)

_TRUTH_EVERY_S = 0.02


def main(arguments: Sequence[str] | None = None) -> int:
    """The process's exit code."""
    try:
        options, runtime = read_options(arguments)
        if runtime:
            return run_node("simulator", runtime, lambda bus, context: fly_supervised(bus, context, options))
        run(options, announce=lambda line: print(line, flush=True))
    except DescribedError as error:
        print(error, file=sys.stderr)
        return EXIT_REFUSED
    return EXIT_ENDED


async def fly_supervised(bus: Bus, context: NodeContext, options: SimOptions) -> None:
    """Until the vehicle is disarmed and nobody has been there for long. Raises DescribedError."""
    async with flying(options) as simulator:
        _log.info("%s", simulator.start_line)
        pilot = simulator.vehicle.autopilot
        telling = asyncio.ensure_future(_tell_truth(bus, simulator))
        try:
            while (context.is_needed() or pilot.armed) and not telling.done():
                context.set_replaceable(not pilot.armed)
                await asyncio.wait((telling,), timeout=LOOK_EVERY_S)
        finally:
            telling.cancel()
            await asyncio.gather(telling, return_exceptions=True)


async def _tell_truth(bus: Bus, simulator: Simulator) -> None:
    """Where the vehicle really is: simulated sensors look from there."""
    while True:
        bus.publish(Topic.TRUTH, simulator.vehicle.sim_truth(time.monotonic(), time.time()))
        await asyncio.sleep(_TRUTH_EVERY_S)


def read_options(arguments: Sequence[str] | None = None) -> tuple[SimOptions, Path | None]:
    """The vehicle's options and the directory of the bus."""
    given = _parser().parse_args(_joined(sys.argv[1:] if arguments is None else arguments))
    lat_deg, lon_deg, alt_m = read_home(given.home)
    options = SimOptions(
        home_lat_deg=lat_deg,
        home_lon_deg=lon_deg,
        home_alt_amsl_m=alt_m,
        autopilot=given.autopilot,
        link=given.link,
        speedup=given.speedup,
        seed=given.seed,
        gnss=given.gnss,
        wind_m_s=given.wind_m_s,
        wind_from_deg=given.wind_from_deg,
        dsm=given.dsm,
        world=given.world,
        gnss_script=tuple(read_event(text) for text in given.gnss_event),
        boot_s=given.boot_s,
        endurance_s=given.endurance_s,
        traffic=given.traffic,
        parameter_errors=given.parameter_errors,
        parameters=tuple(read_parameter(text) for text in given.parameter),
    )
    return options, given.runtime


def _joined(arguments: Sequence[str]) -> list[str]:
    """``--home -37.1,...`` as ``--home=-37.1,...``: a southern latitude looks like an option."""
    out: list[str] = []
    for argument in arguments:
        if out and out[-1] == "--home":
            out[-1] = f"--home={argument}"
        else:
            out.append(argument)
    return out


def read_home(text: str) -> tuple[float, float, float]:
    """``LAT,LON,ALT``: degrees, degrees, metres above sea level."""
    try:
        lat_deg, lon_deg, alt_m = (float(part) for part in text.split(","))
    except ValueError as error:
        raise ParameterError(
            f'"{text}" is no home.', where="--home", advice="Write LAT,LON,ALT, such as -37.1244507,175.6892879,803.15."
        ) from error
    return lat_deg, lon_deg, alt_m


def read_parameter(text: str) -> tuple[str, float]:
    """``NAME=VALUE``"""
    name, _, value = text.partition("=")
    try:
        return name.strip().upper(), float(value)
    except ValueError as error:
        raise ParameterError(
            f'"{text}" sets no parameter.', where="--parameter", advice="Write NAME=VALUE, such as RTL_ALT=3000."
        ) from error


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"{__package__}.simulator", description="A simulated vehicle on MAVLink.")
    default = SimOptions(0.0, 0.0, 0.0)
    parser.add_argument("--link", default=default.link, help="udpout:HOST:PORT, udpin:HOST:PORT or tcpin:HOST:PORT")
    parser.add_argument("--autopilot", choices=MAKES, default=default.autopilot, help="whose behaviour it has")
    parser.add_argument("--runtime", type=Path, help="directory of the bus; without it no bus is used")
    parser.add_argument("--home", required=True, help="LAT,LON,ALT: degrees, degrees, metres above sea level")
    parser.add_argument("--speedup", type=float, default=default.speedup, help="simulated seconds per second")
    parser.add_argument("--seed", type=int, default=default.seed)
    parser.add_argument("--gnss", choices=sorted(RECEIVERS), default=default.gnss)
    parser.add_argument("--wind-m-s", type=float, default=default.wind_m_s)
    parser.add_argument("--wind-from-deg", type=float, default=default.wind_from_deg)
    parser.add_argument("--dsm", type=Path, help="surface model that stands around the vehicle")
    parser.add_argument("--world", type=Path, help="world file: what else stands there (docs/worlds.md)")
    parser.add_argument(
        "--gnss-event", action="append", default=[], metavar="EVENT", help="loss:60:20 or glitch:60:5:100:90"
    )
    parser.add_argument("--boot-s", type=float, default=default.boot_s, help="until the position is known")
    parser.add_argument("--endurance-s", type=float, default=default.endurance_s, help="of hovering")
    parser.add_argument("--traffic", action="store_true", help="tell of an aircraft that flies past")
    parser.add_argument(
        "--parameter-errors", action="store_true", help="say so when it has no such parameter, as newer firmware does"
    )
    parser.add_argument("--parameter", action="append", default=[], metavar="NAME=VALUE", help="of the autopilot")
    return parser


if __name__ == "__main__":
    sys.exit(main())
