"""What an autopilot makes of a mission when it stores it, and whether it holds what was sent."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Firmware
from planning.formats.commands import plain_frame
from telemetry.mavlink.items import DEG_E7, PLACED
from telemetry.topics.onboard_lists import Item, Rounded

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
ALTITUDE_TOLERANCE_M = 0.011
"""One centimetre, and what float32 adds."""
EXACT_M = 0.0005
PLACE_TOLERANCE_E7 = 1
PARAM_STEP = 1e-3
"""Parameters nearer than this are the same: autopilots that turn degrees into radians and back are off by less."""


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


@dataclass(frozen=True, slots=True)
class _Change:
    field: str
    sent: float | None
    kept: float | None
    harmless: bool


def compare(
    sent: tuple[Item, ...], found: tuple[Item, ...], *, firmware: Firmware = "ardupilot"
) -> tuple[tuple[Rounded, ...], tuple[str, ...]]:
    """What the vehicle rounded, and real differences as sentences; the mission is verified when there are none."""
    rounded: list[Rounded] = []
    differences: list[str] = []
    if len(sent) != len(found):
        differences.append(f"{len(sent)} items were sent, {len(found)} are on board.")
    for number, (ours, theirs) in enumerate(zip(sent, found, strict=False), start=1):
        for change in _changes(ours, theirs, firmware):
            if change.harmless:
                rounded.append(Rounded(number, change.field, change.sent, change.kept))
            else:
                sent_kept = f"{_say(change.kept)} on board, sent was {_say(change.sent)}"
                differences.append(f"Item {number}: {change.field} is {sent_kept}.")
    return tuple(rounded), tuple(differences)


def _changes(sent: Item, found: Item, firmware: Firmware) -> Iterator[_Change]:
    if sent.command != found.command:
        yield _Change("command", sent.command, found.command, False)
        return  # nothing else of two different commands can be compared
    if sent.command in PLACED:
        yield from _place(sent, found)
    elif not _same(sent.alt_m, found.alt_m):
        yield _Change("parameter 7", sent.alt_m, found.alt_m, _dropped(sent, 7, found.alt_m, firmware))
    for k, (ours, theirs) in enumerate(zip(sent.params, found.params, strict=True), start=1):
        if not _same(ours, theirs):
            yield _Change(f"parameter {k}", ours, theirs, _is_harmless(sent, k, ours, theirs, firmware))
    if sent.autocontinue != found.autocontinue:
        yield _Change("autocontinue", sent.autocontinue, found.autocontinue, firmware == "ardupilot")


def _place(sent: Item, found: Item) -> Iterator[_Change]:
    if plain_frame(sent.frame) != plain_frame(found.frame):
        yield _Change("frame", sent.frame, found.frame, False)
    places = (("latitude", sent.lat_deg, found.lat_deg), ("longitude", sent.lon_deg, found.lon_deg))
    for field, ours, theirs in places:
        apart_e7 = abs(round(ours * DEG_E7) - round(theirs * DEG_E7))
        if apart_e7:
            yield _Change(field, ours, theirs, apart_e7 <= PLACE_TOLERANCE_E7)
    apart_m = abs(sent.alt_m - found.alt_m)
    if not apart_m <= EXACT_M:
        yield _Change("altitude", sent.alt_m, found.alt_m, apart_m <= ALTITUDE_TOLERANCE_M)


def _is_harmless(sent: Item, k: int, ours: float | None, theirs: float | None, firmware: Firmware) -> bool:
    if not is_flown(sent.command, k):
        return True
    if k == 1 and sent.command in WHOLE_SECONDS and ours is not None and theirs is not None:
        return 0.0 <= ours - theirs < 1.0 and theirs == math.trunc(theirs)
    return _dropped(sent, k, theirs, firmware) or (firmware == "ardupilot" and ours is None and theirs == 0.0)


def _dropped(sent: Item, k: int, theirs: float | None, firmware: Firmware) -> bool:
    """ArduPilot has no room for it, and it changes nothing that the vehicle would have flown."""
    return firmware == "ardupilot" and k not in kept_params(sent.command) and theirs == 0.0


def _same(ours: float | None, theirs: float | None) -> bool:
    if ours is None or theirs is None:
        return ours is theirs
    return ours == theirs or abs(ours - theirs) <= max(PARAM_STEP / 2, 1e-6 * abs(ours))


def _say(value: float | None) -> str:
    return "none" if value is None else f"{value:.10g}"


def digest(items: tuple[Item, ...]) -> str:
    """SHA-256 (hex) of everything that is flown, of items AS STORED: read back, or through ``as_stored``.

    Spellings of a frame, and steps below a centimetre or a thousandth of a parameter, make no difference.
    """
    return hashlib.sha256("\n".join(map(_line, items)).encode()).hexdigest()


def _line(item: Item) -> str:
    flown = (value if is_flown(item.command, k) else 0.0 for k, value in enumerate(item.params, start=1))
    params = [_steps(value, PARAM_STEP) for value in flown]
    if item.command in PLACED:
        place = [round(item.lat_deg * DEG_E7), round(item.lon_deg * DEG_E7), _steps(item.alt_m, 0.01)]
        return f"{item.command} {plain_frame(item.frame)} {params} {place} {item.autocontinue}"
    last = [item.lat_deg, item.lon_deg, _steps(item.alt_m, PARAM_STEP)]
    return f"{item.command} {params} {last} {item.autocontinue}"


def _steps(value: float | None, step: float) -> int | str:
    if value is None or not math.isfinite(value):
        return str(value)
    return round(value / step)
