"""A radar's serial port: opened with a clear word where that fails, and given up when it has gone."""

from __future__ import annotations

import contextlib
import errno
import termios
from collections.abc import Iterator

import serial

from telemetry.errors import SensorError

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
        what, advice = "There is no such port.", "Plug the radar in, and look under /dev for its port."
    elif cause in (errno.EACCES, errno.EPERM):
        what, advice = "Access to the port is denied.", "Add this user to the group that owns it (often dialout)."
    else:
        what, advice = f"The port cannot be opened ({error}).", "Check the name of the port."
    return SensorError(what, where=device, advice=advice)


@contextlib.contextmanager
def failing_as_sensor(device: str) -> Iterator[None]:
    """What a port that is no more raises, as SensorError: the terminal's own errors are no OSError."""
    try:
        yield
    except (serial.SerialException, OSError, termios.error) as error:
        raise SensorError(
            "The radar has gone: its port does not answer any more.", where=device, advice="Check its cable and power."
        ) from error
