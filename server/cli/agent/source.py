"""Where ``hedgehop agent`` takes its readings from, by its options."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from typer import Option

from server.cli.agent.ros2_reading import Ros2Options
from server.cli.shared.output import say, say_notes
from server.errors import BadRequestError
from telemetry.agent.client import Reading
from telemetry.agent.driver_lines import DriverLines, LineCounts
from telemetry.agent.live_radar import LiveStatus
from telemetry.agent.position2go import BAUD as POSITION2GO_BAUD
from telemetry.agent.position2go import Position2Go
from telemetry.agent.ros2_source import Ros2Source
from telemetry.agent.ros2_status import Ros2Status
from telemetry.agent.sources import at, recorded_readings
from telemetry.agent.ti_radar import TiRadar, TiStatus, captured_readings
from telemetry.errors import SensorLinkError
from telemetry.sensors.serial_port import open_port
from telemetry.sensors.ti_mmwave.config import read_config
from telemetry.sensors.ti_mmwave.differences import differences
from telemetry.sensors.ti_mmwave.ti_config import TiConfig
from telemetry.sensors.ti_mmwave.ti_session import DATA_BAUD, TiPorts, config_port_beside

NO_PORT = "none"


@dataclass(frozen=True, slots=True)
class SourceOptions:
    """As given on the command line; at most one source of them."""

    recording: Annotated[Path | None, Option(metavar="FILE", help="Send the frames of a recorded flight.")] = None
    ti_config: Annotated[Path | None, Option(metavar="CFG", help="The configuration that a TI radar is sent.")] = None
    ti_data: Annotated[str | None, Option(metavar="PORT", help="Data port of a TI radar (often /dev/ttyACM1).")] = None
    ti_config_port: Annotated[
        str | None,
        Option(metavar="PORT", help=f'Its config port; default: the one before; "{NO_PORT}": it runs already.'),
    ] = None
    ti_baud: Annotated[int | None, Option(help=f"Baud rate of the data port; default: {DATA_BAUD}.")] = None
    ti_capture: Annotated[Path | None, Option(metavar="FILE", help="Send what a TI radar's data port once sent.")] = (
        None
    )
    position2go: Annotated[str | None, Option(metavar="PORT", help="Port of an Infineon Position2Go.")] = None
    live: Ros2Options = field(default_factory=Ros2Options)


@dataclass(frozen=True, slots=True)
class Source:
    """``readings`` block; run them through in a thread of their own."""

    readings: Iterator[Reading]
    radar: LiveStatus | None = None
    """Of a radar that the agent itself reads, live or from a file."""
    lines: LineCounts | None = None
    """Of a driver on standard input."""
    ros2: Ros2Status | None = None
    """Of a robot's topics."""
    close: Callable[[], None] | None = None
    """Ends what ``readings`` has opened, from any thread; None: it ends with the process."""


def source_of(options: SourceOptions) -> Source:
    """Raises DescribedError for options that do not go together and for a configuration that cannot be read, and
    OSError for a file that cannot be opened: before any ground station is asked for."""
    _check(options)
    if options.live.ros2:
        robot = Ros2Source(options.live.asked(), options.live.reach.address(), tell=say)
        return Source(robot.readings(), ros2=robot.status, close=robot.close)
    for file in (options.recording, options.ti_capture):
        if file is not None:
            file.open("rb").close()
    if options.recording is not None:
        return Source(_paced(recorded_readings(options.recording)))
    if options.position2go is not None:
        open_port(options.position2go, POSITION2GO_BAUD).close()
        board = Position2Go(options.position2go, tell=say)
        return Source(board.readings(), board.status)
    config = _config(options.ti_config)
    if options.ti_capture is not None:
        status = TiStatus()
        return Source(_paced(captured_readings(options.ti_capture, config, status, tell=say)), status)
    if options.ti_data is not None and config is not None:
        radar = TiRadar(config, _ports(options, options.ti_data), tell=say)
        return Source(radar.readings(), radar.status)
    driver = DriverLines(sys.stdin.buffer, tell=say)
    return Source(_wrong_input(driver.readings()), lines=driver.counts)


def _check(options: SourceOptions) -> None:
    sources = {
        "--recording": options.recording,
        "--ti-data": options.ti_data,
        "--ti-capture": options.ti_capture,
        "--position2go": options.position2go,
        "--ros2": options.live.ros2 or None,
    }
    given = [name for name, value in sources.items() if value is not None]
    if len(given) > 1:
        raise BadRequestError(f"{' and '.join(given)} are two sources.", advice="Give one of them.")
    options.live.check()
    if options.ti_data is not None and options.ti_config is None:
        raise BadRequestError(
            "The radar's configuration is missing.", where="--ti-config", advice="Give the .cfg file that it is sent."
        )
    if options.ti_config is not None and options.ti_data is None and options.ti_capture is None:
        raise BadRequestError(
            "There is no radar for this configuration.", where="--ti-config", advice="Name its data port: --ti-data."
        )
    if options.ti_config_port is not None and options.ti_data is None:
        raise BadRequestError("A config port needs a data port.", where="--ti-config-port", advice="Add --ti-data.")
    if options.ti_baud is not None and options.ti_data is None:
        raise BadRequestError("A baud rate needs a data port.", where="--ti-baud", advice="Add --ti-data.")


def _config(path: Path | None) -> TiConfig | None:
    if path is None:
        return None
    config = read_config(path)
    if not config.sends_points:
        raise BadRequestError(
            "With this configuration the radar sends no points.",
            where=path.name,
            advice="Set guiMonitor -1 1 0 0 0 0 0.",
        )
    say_notes(*differences(config))
    return config


def _ports(options: SourceOptions, data: str) -> TiPorts:
    """Raises SensorError at once for a data port that cannot be opened, before any ground station is asked for."""
    baud = DATA_BAUD if options.ti_baud is None else options.ti_baud
    open_port(data, baud).close()
    config = options.ti_config_port or config_port_beside(data)
    if config is None:
        raise BadRequestError(
            f"Which config port belongs to {data} is not known.",
            where="--ti-config-port",
            advice=f'Name it, or write "{NO_PORT}" for a radar that runs already.',
        )
    if config == NO_PORT:
        return TiPorts(data, None, baud)
    say(f"The radar is configured through {config}, its frames come from {data}.")
    return TiPorts(data, config, baud)


def _wrong_input(readings: Iterator[Reading]) -> Iterator[Reading]:
    """Lines that are no readings are wrong input, and nothing that went wrong in flight."""
    try:
        yield from readings
    except SensorLinkError as error:
        raise BadRequestError(error.what, where=error.where, advice=error.advice) from error


def _paced(timed: Iterator[tuple[float, Reading]]) -> Iterator[Reading]:
    """At the recorded pace, as if measured now."""
    began_s = time.monotonic()
    for after_s, reading in timed:
        wait_s = began_s + after_s - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        yield at(reading, began_s + after_s)
