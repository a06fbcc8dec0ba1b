"""Settings of perception checked as a whole, before any node hears of them."""

from __future__ import annotations

import os

from mapping.errors import CapacityError, MappingError
from mapping.perceiving.limits import check_settings
from telemetry.obstacles import PerceptionSettings
from telemetry.perception.kinds import KINDS


def check_perception(settings: PerceptionSettings) -> None:
    """Raises ParameterError or CapacityError, naming the sensor, the number and what to do."""
    for kind in KINDS.values():
        try:
            own = kind.settings(settings)
            check_settings(own, reach_m=kind.reach_m, reach_down=kind.make.reach_down(own))
        except MappingError as error:
            raise type(error)(error.what, where=f"{kind.sensor} map", advice=error.advice) from None
    settings.tracker.params()


def check_memory(limit_bytes: int, *, maps: int) -> None:
    """Raises CapacityError where so many maps of that size are more than this computer's memory."""
    here_bytes = computer_bytes()
    if maps * limit_bytes > here_bytes:
        each = "A map" if maps == 1 else f"{maps} maps"
        raise CapacityError(
            f"{each} of {limit_bytes / 1e6:,.0f} MB may need {maps * limit_bytes / 1e6:,.0f} MB; this computer has "
            f"{here_bytes / 1e6:,.0f} MB.",
            where="memory",
            advice=f"Allow at most {here_bytes // maps // 1_000_000:,} MB.",
        )


def computer_bytes() -> int:
    """Memory of this computer."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
