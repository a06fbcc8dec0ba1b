"""What an autopilot makes of a mission item when it stores it, and what of that a multirotor flies by."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from planning.formats.commands import plain_frame
from planning.mav_cmd import MavCmd, MavFrame
from planning.model import Firmware
from telemetry.mavlink.items import PLACED
from telemetry.topics.messages import Item

WHOLE_SECONDS = frozenset({MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_TIME, MavCmd.NAV_SPLINE_WAYPOINT})
"""Commands whose first parameter, a time, ArduPilot cuts to whole seconds."""
LARGEST_CM = 2**31

_KEPT: dict[int, frozenset[int]] = {
    MavCmd.NAV_WAYPOINT: frozenset({1}),
    MavCmd.NAV_LOITER_UNLIM: frozenset(),
    MavCmd.NAV_LOITER_TURNS: frozenset({1, 3}),
    MavCmd.NAV_LOITER_TIME: frozenset({1}),
    MavCmd.NAV_RETURN_TO_LAUNCH: frozenset(),
    MavCmd.NAV_LAND: frozenset(),
    MavCmd.NAV_TAKEOFF: frozenset(),
    MavCmd.NAV_SPLINE_WAYPOINT: frozenset({1}),
    MavCmd.DO_CHANGE_SPEED: frozenset({1, 2, 3}),
    MavCmd.DO_SET_ROI_LOCATION: frozenset(),
    MavCmd.DO_SET_ROI_NONE: frozenset(),
    MavCmd.DO_SET_ROI: frozenset(),
    MavCmd.DO_MOUNT_CONTROL: frozenset({1, 2, 3}),
    MavCmd.DO_SET_CAM_TRIGG_DIST: frozenset({1, 3}),
}
_EVERY = frozenset({1, 2, 3, 4, 7})
_DIRECTION = frozenset({MavCmd.NAV_LOITER_UNLIM, MavCmd.NAV_LOITER_TIME})
"""Commands whose third parameter is the sense of a circle, which no multirotor flies."""


def kept_params(command: int) -> frozenset[int]:
    """Numbers of the parameters that ArduCopter stores; every one for a command that is not known here."""
    return _KEPT.get(command, _EVERY)


def is_flown(command: int, param: int) -> bool:
    """Whether a multirotor flies differently for it."""
    return not (param == 3 and command in _DIRECTION)


def as_stored(items: tuple[Item, ...], firmware: Firmware) -> tuple[Item, ...]:
    """Sent items as the vehicle will give them back. PX4 keeps what it gets, ArduPilot what its storage holds."""
    store = _ardupilot if firmware == "ardupilot" else _float32
    return tuple(store(item) for item in items)


def _float32(item: Item) -> Item:
    p1, p2, p3, p4 = (None if value is None else _single(value) for value in item.params)
    return replace(item, params=(p1, p2, p3, p4), alt_m=_single(item.alt_m))


def _ardupilot(item: Item) -> Item:
    item = _float32(item)
    placed, kept = item.command in PLACED, kept_params(item.command)
    values = [value if value is not None and k in kept else 0.0 for k, value in enumerate(item.params, start=1)]
    if item.command in WHOLE_SECONDS:
        values[0] = float(math.trunc(values[0]))
    if placed:
        alt_m = _whole_centimetres(item.alt_m)
    else:
        alt_m = item.alt_m if 7 in kept else 0.0
    return replace(
        item,
        frame=plain_frame(item.frame) if placed else MavFrame.GLOBAL,
        params=(values[0], values[1], values[2], values[3]),
        alt_m=alt_m,
        autocontinue=True,
    )


def _whole_centimetres(alt_m: float) -> float:
    """Cut towards zero after a multiplication in float32, as the autopilot does it: 32.94 becomes 32.93."""
    centimetres = float(np.float32(alt_m) * np.float32(100.0))
    if not abs(centimetres) < LARGEST_CM:
        return alt_m
    return _single(math.trunc(centimetres) / 100.0)


def _single(value: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.float32(value))
