"""Reads the recorded logs for tests, frame by frame, with nothing of the project."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink


def tlog_messages(path: Path) -> Iterator[tuple[float, Any]]:
    """(seconds since 1970, message) of every record that is whole and in order."""
    data = path.read_bytes()
    codec = mavlink.MAVLink(None)
    at = 0
    while at + 12 <= len(data):
        t_utc_s = int.from_bytes(data[at : at + 8], "big") / 1e6
        start = at + 8
        header = {0xFD: 12, 0xFE: 8}.get(data[start])
        if header is None or not 1e9 < t_utc_s < 3e9:
            at += 1
            continue
        frame = data[start : start + header + data[start + 1]]
        try:
            yield t_utc_s, codec.decode(bytearray(frame))
        except mavlink.MAVError:
            at += 1
            continue
        at = start + len(frame)
