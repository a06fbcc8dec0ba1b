"""One session with a radar at its ports: configure it, then read frames until the line fails."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import serial

from telemetry.errors import SensorError
from telemetry.sensors.serial_port import failing_as_sensor, open_port
from telemetry.sensors.ti_mmwave.cfg_commands import Command
from telemetry.sensors.ti_mmwave.packets import TiStream
from telemetry.sensors.ti_mmwave.sender import ConfigSender
from telemetry.sensors.ti_mmwave.ti_frame import TiFrame

GARBLED_S, GARBLED_BYTES = 3.0, 200
"""So long and so much without a frame: what comes is no stream of frames."""
MOST_WAITING = 100
"""Frames that one read is taken to span, at most."""
SILENT_S = 5.0
"""A radar that sees nothing sends empty frames all the same."""
CONFIG_BAUD, DATA_BAUD = 115_200, 921_600


@dataclass(frozen=True, slots=True)
class TiPorts:
    """Where a radar is connected; without a config port it is taken as running already."""

    data: str
    config: str | None
    data_baud: int = DATA_BAUD
    config_baud: int = CONFIG_BAUD


def empty(port: serial.Serial) -> None:
    """What waits there is old. Raises SensorError."""
    with failing_as_sensor(str(port.port)):
        port.reset_input_buffer()


def configure(
    device: str,
    baud: int,
    commands: tuple[Command, ...],
    *,
    now: Callable[[], float],
    before_start: Callable[[], None] = lambda: None,
) -> None:
    """Sends a configuration line by line; ``before_start`` is called when the radar has stopped and is set up.

    Raises SensorError: refused, silent, or the port.
    """
    with contextlib.closing(open_port(device, baud)) as port, failing_as_sensor(device):
        port.reset_input_buffer()
        sender = ConfigSender(commands)
        port.write(sender.start(now()))
        while not sender.done:
            line = sender.on_data(port.read(max(1, port.in_waiting)), now())
            if line and sender.command.name == "sensorStart":
                before_start()
            port.write(line)
            sender.on_tick(now())


def frames(
    port: serial.Serial, stream: TiStream, *, period_s: float, now: Callable[[], float]
) -> Iterator[tuple[float, TiFrame | None]]:
    """When each frame's first byte was sent, and the frame; None when bytes come and no frame is among them.

    Several at once have waited, here or in the port: all but the newest are older by the ``period_s`` between them.
    Raises SensorError when the port has gone or is silent for ``SILENT_S``.
    """
    device, byte_s = str(port.port), 10.0 / port.baudrate
    heard_s = frame_s = now()
    while True:
        with failing_as_sensor(device):
            data = port.read(max(1, port.in_waiting))
        now_s = now()
        found = stream.feed(data)
        for k, frame in enumerate(found, start=1):
            behind = min(sum(later.periods for later in found[k:]), MOST_WAITING)
            yield now_s - behind * period_s - frame.packet_bytes * byte_s, frame
        heard_s, frame_s = now_s if data else heard_s, now_s if found else frame_s
        if now_s - frame_s > GARBLED_S and stream.bytes_since_frame > GARBLED_BYTES:
            yield now_s, None
        if now_s - heard_s > SILENT_S:
            raise SensorError(
                f"The radar has sent nothing for {SILENT_S:g} s.",
                where=device,
                advice="Check its power, that this is its data port, and that it was started.",
            )


def config_port_beside(data_device: str) -> str | None:
    """The config port that belongs to a data port: on TI's boards the one numbered one lower, if it is there."""
    match = re.fullmatch(r"(/.*?)(\d+)", data_device)
    if match is None or int(match[2]) == 0:
        return None
    beside = f"{match[1]}{int(match[2]) - 1}"
    return beside if Path(beside).exists() else None
