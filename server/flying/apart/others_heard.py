"""What of other stations is heard, and what is not: nothing that was seen to fly vanishes because nobody tells of it.

The row of the check before the start is good only while every station and vehicle that was ever heard of is heard.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

from server.schemas import CheckRow
from telemetry.topics.station_vehicles import OtherStation, OtherVehicle, StationsStatus

LISTENED_S = 5.0
"""For so long at least before nobody's word means that nobody flies."""
NODE_SILENT_S, VEHICLE_SILENT_S = 3.0, 6.0
"""A vehicle that changes nothing is told of every two seconds."""
MOST_WITHIN_M = 200.0
"""A position that is not even known to that is none: nobody could be kept clear of it."""
_AGREE = "Agree with whoever flies there."


def is_vague(other: OtherVehicle) -> bool:
    return other.it.within_m is not None and other.it.within_m > MOST_WITHIN_M


def name_of(other: OtherVehicle) -> str:
    return f"{other.it.name} ({other.station} {other.it.number})"


def with_missing(before: StationsStatus | None, status: StationsStatus) -> StationsStatus:
    """And the stations that are no longer told of, and vehicles as they were last heard or seen in the air: the node
    may have started again, or the other station, which then knows no place of what it flew."""
    status = replace(status, vehicles=tuple(_placed(other) for other in status.vehicles))
    if before is None:
        return status
    told = {station.name: station for station in status.stations}
    stations = [*status.stations, *(_lost(station) for station in before.stations if station.name not in told)]
    vehicles = {(other.station, other.it.number): other for other in status.vehicles}
    for other in before.vehicles:
        key = other.station, other.it.number
        vehicles[key] = _after(other, vehicles.get(key), told.get(other.station))
    return replace(
        status,
        stations=tuple(sorted(stations, key=lambda station: station.name)),
        vehicles=tuple(vehicles[key] for key in sorted(vehicles)),
    )


def _placed(other: OtherVehicle) -> OtherVehicle:
    """Without a place that is known to no better than anywhere around."""
    if is_vague(other):
        it = replace(other.it, position_t_mono_s=None, lat_deg=None, lon_deg=None)
        return replace(other, it=it, oldest_t_mono_s=None)
    return other


def _after(before: OtherVehicle, now: OtherVehicle | None, station: OtherStation | None) -> OtherVehicle:
    """What is to be taken of a vehicle of which this was known, and that is told now."""
    if now is None:
        return before
    if before.it.in_air:
        unsettled = station is not None and (station.is_new or station.is_double)
        if now.run != before.run and unsettled and not now.it.in_air:
            return before  # perhaps another station's under the same name
        if not _says_where(now) and not (now.it.in_air and before.it.lat_deg is None):
            return before
    if now.it.link == "none" and before.it.link != "none":
        return replace(now, it=replace(now.it, link="lost"))
    return now


def row_of_others(status: StationsStatus | None, now_s: float, fault: str = "") -> CheckRow:
    """Of the check before a start: where another station's vehicle will be, nothing tells here.

    ``fault``: why none can be met, whatever is still heard by a node of the server before this one.
    """
    if fault:
        return _row("accept", f"{fault} Whether vehicles of others fly is not known.")
    if status is None or status.router == "lost" or now_s - status.t_mono_s > NODE_SILENT_S:
        return _row("accept", "Other stations are not heard: whether their vehicles fly is not known.")
    since_s = status.listens_since_t_mono_s
    if since_s is None or now_s - since_s < LISTENED_S:
        return _row("accept", "Other stations are only just being listened for: ask again in some seconds.")
    if status.leaves_out:
        return _row("accept", f"Not all stations are heard. {status.leaves_out}")
    if not status.stations:
        return _row("accept", "No other station is heard: whether vehicles of others fly is not known.")
    if unheard := [words for station in status.stations for words in _unheard(station, status.vehicles, now_s)]:
        return _row("accept", f"{'; '.join(unheard)}. Whether they fly is not known.")
    if flies := [name_of(other) for other in status.vehicles if other.it.in_air]:
        return _row("accept", f"In the air, and nothing tells all that it will fly: {', '.join(flies)}.")
    if deaf := [station.name for station in status.stations if not station.hears_us]:
        return _row("accept", f"Not heard there: this station, by {', '.join(deaf)}, which cannot keep clear of it.")
    return _row("good", "No vehicle of another station that is heard is in the air.")


def _lost(station: OtherStation) -> OtherStation:
    text = (
        f"{station.name} is not heard any more. Its vehicles may be anywhere by now: keep clear of where they flew, "
        "and call its pilot."
    )
    return replace(station, state="lost", hears_us=False, text=station.text if station.state == "lost" else text)


def _says_where(other: OtherVehicle) -> bool:
    """Where it is, or that it stands on the ground: of one that its station hears."""
    return other.it.lat_deg is not None or (other.it.link == "live" and not other.it.in_air)


def _unheard(station: OtherStation, vehicles: Sequence[OtherVehicle], now_s: float) -> Iterator[str]:
    """What of a station is not heard, in words."""
    if station.state == "lost":
        yield f"{station.name} is not heard"
        return
    if station.is_double:
        yield f"of two stations called {station.name} one is not heard"
    elif station.is_new:
        yield f"{station.name} has only just started again"
    if station.sent_t_mono_s is None:
        yield f"the clock of {station.name} is not compared yet, and how old its words are is not known"
        return
    if (old_s := now_s - station.sent_t_mono_s) > VEHICLE_SILENT_S:
        yield f"what {station.name} says comes {old_s:.0f} s late"
    heard = [other for other in vehicles if other.station == station.name]
    if station.vehicles > len(heard):
        yield f"{station.name} has {station.vehicles} vehicles, and {len(heard)} of them are heard"
    if lost := [name_of(other) for other in heard if _is_unheard(other, now_s)]:
        yield f"not heard: {', '.join(lost)}"


def _is_unheard(other: OtherVehicle, now_s: float) -> bool:
    """By its station, or here; one that its station has never connected to (none) is no vehicle yet.

    Words and positions count at the worse end of their age.
    """
    if other.it.link in ("stale", "lost") or other.sent_t_mono_s is None:
        return True
    placed_s = other.oldest_t_mono_s
    if placed_s is None and other.it.position_t_mono_s is not None:
        return True
    return now_s - min(other.sent_t_mono_s, other.sent_t_mono_s if placed_s is None else placed_s) > VEHICLE_SILENT_S


def _row(state: Literal["accept", "good"], text: str) -> CheckRow:
    return CheckRow(code="others", state=state, text=text, mend="" if state == "good" else _AGREE)
