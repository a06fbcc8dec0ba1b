"""The two serial ports of TI's boards: their rates, and which of two is which."""

from __future__ import annotations

import re
from pathlib import Path

CONFIG_BAUD, DATA_BAUD = 115_200, 921_600


def config_port_beside(data_device: str) -> str | None:
    """The config port that belongs to a data port: on TI's boards the one numbered one lower, if it is there."""
    match = re.fullmatch(r"(/.*?)(\d+)", data_device)
    if match is None or int(match[2]) == 0:
        return None
    beside = f"{match[1]}{int(match[2]) - 1}"
    return beside if Path(beside).exists() else None
