"""``hedgehop goto station``: the way is judged by the ground station that runs, with all that its sensors have seen of
the flight, and flown by it. The station holds the vehicle and watches it: this command ends once the way is ordered.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from server.cli.flights.station_session import StationSession, station_session
from server.cli.shared.command import DONE, FAILED
from server.cli.shared.output import answer, end_progress, progress, say_notes
from server.errors import StationError
from server.schemas import GuidedState, WayBody, WayDoc
from telemetry.bus.link_client import START_S

WAY = "/api/flight/way"
JUDGED_WITHIN_S = 180.0
"""A large model on a slow computer."""
ORDERED_WITHIN_S = JUDGED_WITHIN_S + START_S + 15.0
"""The link's own time for a start over a bad link, and the way there; it may be judged once more before."""
MAY_FLY = "It may be flown: look at the console."
_VERDICTS = {None: "CERTIFIED", "others": "VEHICLE IN THE WAY"}
WATCH = "The station flies it: watch it in the console, where Hold stands."


def goto_by_station(
    data_dir: Path | None, vehicle: str | None, body: WayBody, *, may_fly: bool, accepts: bool, as_json: bool
) -> int:
    """The command's exit code. Raises BadRequestError where no station runs, StationError."""
    with station_session(data_dir, vehicle) as station:
        station.take_control()
        is_ordering = ordered = False
        try:
            way = _judged(station, body)
            if may_fly and (way.problem is None or (way.problem == "return" and accepts)):
                is_ordering = True
                _order(station, way, accepts=accepts)
                ordered = True
        finally:
            if not is_ordering:
                station.put_away(WAY)
            elif not ordered:
                say_notes(MAY_FLY)
    if may_fly and way.problem == "return" and not accepts:
        say_notes("The way itself is clear. --accept-return flies it all the same.")
    if not way.has_seen:
        say_notes("no sensor of the station has seen anything that counts: the way is judged by the model alone.")
    answer({"action": body.action, "ordered": ordered, **_summary(way)}, _lines(way, ordered=ordered), as_json=as_json)
    return DONE if ordered or (not may_fly and way.problem is None) else FAILED


def _judged(station: StationSession, body: WayBody) -> WayDoc:
    progress("Judging the way", None)
    content = station.ask("PUT", WAY, body.model_dump(mode="json"), within_s=JUDGED_WITHIN_S, doing="Judging the way")
    end_progress()
    way = station.told(GuidedState, content).way
    if way is None:
        raise StationError("What was judged was put away meanwhile.", advice="Ask for the way again.")
    return way


def _order(station: StationSession, way: WayDoc, *, accepts: bool) -> None:
    progress("Ordering the way", None)
    body = {"id": way.id, "accept_return": accepts}
    station.ask("POST", f"{WAY}/fly", body, within_s=ORDERED_WITHIN_S, doing="Ordering the way")
    end_progress()


def _summary(way: WayDoc) -> dict[str, Any]:
    return {
        "certified": way.problem is None,
        "problem": way.problem,
        "clearance_m": way.clearance_m,
        "required_clearance_m": way.required_m,
        "length_m": way.length_m,
        "seconds": way.seconds,
        "terrain": way.terrain_name,
        "has_seen": way.has_seen,
        "notes": way.notes,
        "reasons": [reason.text for reason in way.reasons],
    }


def _lines(way: WayDoc, *, ordered: bool) -> list[str]:
    kept = "nothing is near" if way.clearance_m is None else f"at least {way.clearance_m:.1f} m from the surface"
    by = "the model with what sensors have seen" if way.has_seen else "the model alone"
    figures = f"{way.length_m:.0f} m, about {way.seconds:.0f} s; {kept}, required {way.required_m:.1f} m, by {by}"
    lines = [f"{_VERDICTS.get(way.problem, 'NOT CERTIFIED')}: {figures}"]
    lines += [f"  - {reason.text} {reason.mend}".rstrip() for reason in way.reasons]
    lines += [f"  {note}" for note in way.notes]
    return [*lines, f"ORDERED. {WATCH}" if ordered else "NOT FLOWN"]
