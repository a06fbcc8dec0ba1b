"""Mission items: a planned mission, its items on the wire, and a mission read back from a vehicle."""

from __future__ import annotations

import math
from collections.abc import Iterable

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.mav_cmd import FENCES, MavCmd
from planning.basics.plan_model import Firmware, Home, Mission, MissionItem
from planning.formats.commands import POSITIONED
from telemetry.errors import TransferError
from telemetry.mavlink.actions import Message
from telemetry.topics.onboard_lists import Item, OnboardMission

PLACED = (POSITIONED - {MavCmd.DO_SET_CAM_TRIGG_DIST}) | FENCES | {MavCmd.NAV_RALLY_POINT}
"""Commands with latitude, longitude and altitude; the one that sets the distance between photos has none."""
DEG_E7 = 1e7
_INT32 = 2**31 - 1
_FIELDS = ("latitude", "longitude")


def items_from_mission(mission: Mission) -> tuple[Item, ...]:
    """A planned mission as the wire knows it."""
    return wire_items(mission.items)


def wire_items(items: Iterable[MissionItem]) -> tuple[Item, ...]:
    """NaN ("not given") becomes None."""
    return tuple(
        Item(
            command=item.command,
            frame=item.frame,
            params=_params(item.params),
            lat_deg=item.lat_deg,
            lon_deg=item.lon_deg,
            alt_m=item.alt_m,
            autocontinue=item.autocontinue,
        )
        for item in items
    )


def mission_from_onboard(onboard: OnboardMission, firmware: Firmware, *, home: Home | None = None) -> Mission:
    """What was read back, as a mission to plan and certify with.

    ``home``: instead of the vehicle's own, which is above mean sea level (unknown: NaN).
    """
    return Mission(home=home or _home(onboard), items=mission_items(onboard.items), firmware=firmware)


def mission_items(items: Iterable[Item]) -> tuple[MissionItem, ...]:
    """None becomes NaN ("not given")."""
    return tuple(
        MissionItem(
            command=item.command,
            frame=item.frame,
            params=_or_nan(item.params),
            lat_deg=item.lat_deg,
            lon_deg=item.lon_deg,
            alt_m=item.alt_m,
            autocontinue=item.autocontinue,
        )
        for item in items
    )


def _home(onboard: OnboardMission) -> Home:
    lat_deg, lon_deg, alt_m = onboard.home_lat_deg, onboard.home_lon_deg, onboard.home_alt_amsl_m
    if lat_deg is None or lon_deg is None:
        return Home(math.nan, math.nan, math.nan)
    return Home(lat_deg, lon_deg, math.nan if alt_m is None else alt_m, "AMSL")


def item_message(
    item: Item, seq: int, *, target: tuple[int, int], number: int, firmware: Firmware, mission_type: int = 0
) -> Message:
    """MISSION_ITEM_INT. Raises TransferError when a place cannot be written down at all.

    ``number`` names the item in that error. ArduPilot refuses most parameters that are not given: it gets 0.
    """
    missing = 0.0 if firmware == "ardupilot" else math.nan
    p1, p2, p3, p4 = (missing if value is None else value for value in item.params)
    scale = DEG_E7 if item.command in PLACED else 1.0
    x, y = (
        _whole(value * scale, number, field) for value, field in zip((item.lat_deg, item.lon_deg), _FIELDS, strict=True)
    )
    current = int(seq == 0 and firmware == "px4" and mission_type == 0)
    return mavlink.MAVLink_mission_item_int_message(
        target[0],
        target[1],
        seq,
        item.frame,
        item.command,
        current,
        int(item.autocontinue),
        p1,
        p2,
        p3,
        p4,
        x,
        y,
        item.alt_m,
        mission_type,
    )


def home_message(lat_deg: float, lon_deg: float, alt_amsl_m: float, *, target: tuple[int, int]) -> Message:
    """The row that ArduPilot keeps at sequence 0 and replaces by its own home: what is unknown may be 0."""
    lat_deg, lon_deg, alt_amsl_m = (value if math.isfinite(value) else 0.0 for value in (lat_deg, lon_deg, alt_amsl_m))
    item = Item(mavlink.MAV_CMD_NAV_WAYPOINT, 0, (0.0, 0.0, 0.0, 0.0), lat_deg, lon_deg, alt_amsl_m)
    return item_message(item, 0, target=target, number=0, firmware="ardupilot")


def item_from_message(message: Message) -> Item:
    """Of a MISSION_ITEM_INT."""
    scale = DEG_E7 if message.command in PLACED else 1.0
    return Item(
        command=message.command,
        frame=message.frame,
        params=_params((message.param1, message.param2, message.param3, message.param4)),
        lat_deg=message.x / scale,
        lon_deg=message.y / scale,
        alt_m=message.z,
        autocontinue=bool(message.autocontinue),
    )


def _whole(value: float, number: int, field: str) -> int:
    if not (math.isfinite(value) and abs(value) <= _INT32):
        raise TransferError(
            f"The {field} of item {number} cannot be sent.",
            where=f"item {number}",
            advice=f"Correct the {field} in the plan and upload again.",
        )
    return round(value)


def _params(values: tuple[float, float, float, float]) -> tuple[float | None, float | None, float | None, float | None]:
    p1, p2, p3, p4 = (None if math.isnan(value) else float(value) for value in values)
    return p1, p2, p3, p4


def _or_nan(values: tuple[float | None, float | None, float | None, float | None]) -> tuple[float, float, float, float]:
    p1, p2, p3, p4 = (math.nan if value is None else value for value in values)
    return p1, p2, p3, p4
