"""A request that names another station's vehicle: refused, with who commands it and whom to call."""

from __future__ import annotations

import re

from server.errors import BadRequestError, OtherStationError
from server.flying.apart.others_heard import NODE_SILENT_S, name_of
from telemetry.topics.station_vehicles import OtherVehicle, StationsStatus

_NAMED = re.compile(r"([A-Za-z0-9][A-Za-z0-9_-]{0,23})[/ ]([1-9][0-9]?)", re.ASCII)
"""Bravo/2, or as the list of other stations' vehicles says it: Bravo 2. A station's name alone is a number's, too."""


def own_number(words: str, own: str, status: StationsStatus | None, now_s: float) -> str | None:
    """The number, where the station that is named is this one, ``own``; None: no station is named.

    Raises OtherStationError: no command crosses from one station to another. BadRequestError while it is not known
    which station this is (``own`` empty).
    """
    named = _NAMED.fullmatch(words)
    if named is None:
        return None
    station, number = named[1], named[2]
    if station == own:
        return number
    heard = () if status is None else status.vehicles
    for other in heard:
        if (other.station, str(other.it.number)) == (station, number):
            raise OtherStationError(
                f"{name_of(other)} is commanded by {station} alone: nothing of this was done.",
                advice=_whom_to_call(other, status, now_s),
            )
    if not own:
        raise BadRequestError(
            "This station's own name is not known, because its file cannot be used: nothing of this was done.",
            advice="Name one of its vehicles by the number alone.",
        )
    knows = status is not None and any(each.name == station for each in status.stations)
    what = f"{station} tells of no vehicle {number}" if knows else f"No station {station} is heard here"
    raise OtherStationError(
        f"{what}; its vehicles are commanded by {station} alone: nothing of this was done.",
        advice=f"Call {station}, or name one of this station's vehicles by its number.",
    )


def _whom_to_call(other: OtherVehicle, status: StationsStatus | None, now_s: float) -> str:
    """Who was in charge may have changed since it was told."""
    live = {each.name for each in status.stations if each.state == "live"} if status is not None else set()
    is_heard = status is not None and now_s - status.t_mono_s <= NODE_SILENT_S and other.station in live
    when = "" if is_heard else f" when it was last heard, {max(0.0, now_s - other.heard_t_mono_s):.0f} s ago"
    if not other.it.in_charge:
        return f"Nobody {'is' if is_heard else 'was'} in charge of it there{when}. Call {other.station}."
    silent = ", and nothing was heard of them" if other.it.in_charge_silent else ""
    verb = "is" if is_heard else "was"
    return f"{other.it.in_charge} {verb} in charge of it there{when}{silent}. Call {other.station}."
