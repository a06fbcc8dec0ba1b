"""``hedgehop home``: home judged by the ground station that runs, with all that it has seen of the flight, then set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from server.cli.flights.station_session import StationSession, station_session
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.output import answer, end_progress, progress, say_notes
from server.errors import StationError
from server.schemas import HomeAskedDoc, HomeState, ReturnDoc

HERE = "here"
JUDGED_WITHIN_S, SET_WITHIN_S = 180.0, 60.0
"""A large model on a slow computer; a vehicle over a bad link."""


@command
def home(
    place: Annotated[str, Argument(metavar="here|LAT,LON", help="Where the vehicle is; elsewhere in the air only.")],
    *,
    check: Annotated[bool, Option("--check", help="Judge it and say it; set nothing.")] = False,
    accept_return: Annotated[
        bool, Option("--accept-return", help="Set it although the vehicle's return to it is not certified.")
    ] = False,
    vehicle: o.StationVehicle = None,
    data_dir: Annotated[
        Path | None, Option(help="That the station was started with; default: the user's data home.")
    ] = None,
    as_json: o.AsJson = False,
) -> None:
    """Set home, judged by the ground station that runs on this computer.

    It is asked for control of the vehicle as the console is. The place must be open ground of the open surface model;
    in the air the vehicle holds, and its return to there is certified by what sensors have seen in this flight.
    """
    where = None if place.strip().lower() == HERE else o.parse_place(place, "here|LAT,LON")
    body = {"place": None if where is None else {"lat_deg": where[0], "lon_deg": where[1]}}
    with station_session(data_dir, vehicle) as station:
        station.take_control()
        is_set = False
        try:
            asked = _judged(station, body)
            refusal = _why_not(asked.ret, accepts=accept_return)
            if not check and refusal is None:
                _set(station, asked)
                is_set = True
        finally:
            if not is_set:
                station.put_away("/api/flight/home")
    if refusal is not None and not check:
        say_notes(refusal)
    answer({"set": is_set, **_summary(asked)}, _lines(asked, is_set=is_set), as_json=as_json)
    raise typer.Exit(DONE if is_set or (check and refusal is None) else FAILED)


def _judged(station: StationSession, body: dict[str, Any]) -> HomeAskedDoc:
    progress("Judging home", None)
    content = station.ask("PUT", "/api/flight/home", body, within_s=JUDGED_WITHIN_S, doing="Judging home")
    end_progress()
    asked = station.told(HomeState, content).asked
    if asked is None:
        raise StationError("What was judged was put away meanwhile.", advice="Ask for home again.")
    return asked


def _set(station: StationSession, asked: HomeAskedDoc) -> None:
    progress("Setting home", None)
    station.ask("POST", "/api/flight/home/set", {"id": asked.id}, within_s=SET_WITHIN_S, doing="Setting home")
    end_progress()


def _why_not(ret: ReturnDoc | None, *, accepts: bool) -> str | None:
    """None: it may be set."""
    if ret is None or ret.state == "certified" or accepts:
        return None
    return "the vehicle's return to it is not certified. --accept-return sets it all the same."


def _summary(asked: HomeAskedDoc) -> dict[str, Any]:
    ret = asked.ret
    return {
        "here": asked.is_here,
        "lat_deg": asked.lat_deg,
        "lon_deg": asked.lon_deg,
        "alt_amsl_m": asked.alt_amsl_m,
        "moves_m": asked.moves_m,
        "rises_m": asked.rises_m,
        "changes": asked.changes,
        "return": None
        if ret is None
        else {
            "state": ret.state,
            "clearance_m": ret.clearance_m,
            "reasons": [reason.text for reason in ret.reasons],
            "way_home_certified": ret.instead,
            "notes": ret.notes,
        },
    }


def _lines(asked: HomeAskedDoc, *, is_set: bool) -> list[str]:
    rises = f"{abs(asked.rises_m):.1f} m {'higher' if asked.rises_m >= 0 else 'lower'}"
    head = "HOME SET" if is_set else "HOME NOT SET"
    lines = [f"{head}: {asked.lat_deg:.7f},{asked.lon_deg:.7f}, {asked.moves_m:.0f} m from home before, {rises}"]
    lines += [f"  {change}" for change in asked.changes]
    return lines if asked.ret is None else [*lines, *_return_lines(asked.ret)]


def _return_lines(ret: ReturnDoc) -> list[str]:
    if ret.state == "certified":
        by = "nothing is near" if ret.clearance_m is None else f"clear by {ret.clearance_m:.1f} m"
        return [f"  Return: CERTIFIED, {by}", *(f"  {note}" for note in ret.notes)]
    lines = [f"  Return: {'NOT CERTIFIED' if ret.state == 'not_certified' else 'UNKNOWN'}"]
    lines += [f"  - {reason.text} {reason.mend}".rstrip() for reason in ret.reasons]
    lines += ["  A guided way home is certified."] if ret.instead else []
    return [*lines, *(f"  {note}" for note in ret.notes)]
