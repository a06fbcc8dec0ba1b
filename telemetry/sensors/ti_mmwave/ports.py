"""Serial ports of radars: opened with a clear word where that fails, and which of two is which."""

from __future__ import annotations

import errno
import re
import termios
from pathlib import Path

import serial

from telemetry.errors import SensorError

CONFIG_BAUD, DATA_BAUD = 115_200, 921_600
READ_TIMEOUT_S = 0.2


def open_port(device: str, baud: int) -> serial.Serial:
    """For this program alone. Raises SensorError."""
    try:
        return serial.Serial(device, baud, timeout=READ_TIMEOUT_S, write_timeout=5.0, exclusive=True)
    except serial.SerialException as error:
        raise _described(device, error) from error
    except (OSError, termios.error) as error:
        raise _described(device, serial.SerialException(error.args[0], str(error))) from error
    except (ValueError, OverflowError) as error:
        raise SensorError(f"{baud} is no baud rate of this port.", where=device) from error


def _described(device: str, error: serial.SerialException) -> SensorError:
    cause = error.errno or getattr(error.__context__, "errno", None)
    if cause in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK):
        what, advice = "The port is in use by another program.", "End that program, then try again."
    elif cause in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        what, advice = "There is no such port.", "Plug the radar in, and look under /dev for its two ports."
    elif cause in (errno.EACCES, errno.EPERM):
        what, advice = "Access to the port is denied.", "Add this user to the group that owns it (often dialout)."
    else:
        what, advice = f"The port cannot be opened ({error}).", "Check the name of the port."
    return SensorError(what, where=device, advice=advice)


def config_port_beside(data_device: str) -> str | None:
    """The config port that belongs to a data port: on TI's boards the one numbered one lower, if it is there."""
    match = re.fullmatch(r"(/.*?)(\d+)", data_device)
    if match is None or int(match[2]) == 0:
        return None
    beside = f"{match[1]}{int(match[2]) - 1}"
    return beside if Path(beside).exists() else None
