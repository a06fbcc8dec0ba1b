"""``hedgehop review``: the figures of a recorded flight."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Argument, Option

from mapping.geometry.arrays import F64
from planning.basics.plan_model import Mission
from planning.formats.detect import read_mission
from planning.planner.part import mission_places
from planning.terrain.dsm import SurfaceModel
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import answer, end_progress, harmless, progress, say, say_notes
from server.cli.shared.terrain_given import read_around
from server.flying.review import recording_of
from server.flying.review import review as judge
from server.flying.review_flight import flown_mission
from server.schemas.review_docs import ReviewDoc, ReviewFigures
from server.work.clocks import StepTimer
from telemetry.recording.flight_log import FlightLog, read_flight_log

FIRST_KEYS = (
    "completed",
    "cross_track_max_m",
    "cross_track_mean_m",
    "cross_track_p95_m",
    "height_error_max_m",
    "min_distance_m",
    "lag_s",
    "duration_s",
)
"""What ``fly`` and ``review`` print first, in this order."""


@command
def review(
    recording: Annotated[
        Path,
        Argument(metavar="RECORDING", help="A recording, a ground station's .tlog, or a vehicle's own .bin or .ulg."),
    ],
    *,
    dsm: o.FlightDsm = None,
    mission: Annotated[
        Path | None, Option(metavar="FILE", help="Mission to judge it against; default: the recorded one.")
    ] = None,
    truth: Annotated[
        bool, Option("--truth", help="Take a simulator's true positions instead of the vehicle's estimate.")
    ] = False,
    as_json: o.AsJson = False,
    how: Annotated[o.ModelOptions, Without("max_hole_m2", "remove_spikes")],
) -> None:
    """Judge a recorded flight: errors against its mission, distances to the surface model, lag.

    Ends with 1 when it went below its required clearance.
    """
    flown = read_mission(mission.name, read_small(mission)) if mission else None
    timer = StepTimer(progress)
    timer("Reading the recording", None)
    log = read_flight_log(recording)
    model = None if dsm is None else read_around(dsm, timer, how, partial(_places, log=log, mission=flown))
    timer("Judging the flight", None)
    doc = judge(log, recording_of(log, recording), dsm=model or log.ground, mission=flown, truth=truth)
    end_progress()
    say_notes(*doc.notes)
    tell(doc, as_json=as_json)
    raise typer.Exit(DONE if doc.figures is not None and doc.figures.below_required is None else FAILED)


def _places(model: SurfaceModel, log: FlightLog, mission: Mission | None) -> F64:
    """(N, 2) projected places of all tracks, of the mission and of home."""
    tracks = [log.track] if log.truth is None else [log.track, log.truth]
    flown = [np.column_stack([track.lat_deg, track.lon_deg]) for track in tracks]
    planned = mission or flown_mission(log, [])
    home = [] if log.home is None else [(log.home.lat_deg, log.home.lon_deg)]
    xy_m = model.xy_from_lat_lon(np.vstack([*flown, np.reshape(home, (-1, 2))]))
    return xy_m if planned is None else np.vstack([xy_m, mission_places(model, planned)])


def tell(doc: ReviewDoc, *, as_json: bool) -> None:
    """What it came to; a clearance that was not kept stands on its own as well, so that nobody overlooks it."""
    if doc.figures is not None and doc.figures.below_required is not None:
        say(f"WARNING: {doc.figures.below_required}")
    answer(summary(doc), figure_lines(doc), as_json=as_json)


def summary(doc: ReviewDoc) -> dict[str, Any]:
    """The figures, those that ``fly`` promises first; null where they cannot be told."""
    figures = doc.figures.model_dump() if doc.figures else {}
    first = {key: figures.get(key) for key in FIRST_KEYS} | {"completed": figures.get("completed", False)}
    return {
        **first,
        "other_surface": doc.other_surface or None,
        **{key: value for key, value in figures.items() if key not in first},
        "first_waypoint_t_s": doc.first_waypoint_t_s,
        "last_waypoint_t_s": doc.last_waypoint_t_s,
        "start_utc": doc.start_utc,
        "recording_s": doc.duration_s,
        "notes": doc.notes,
    }


def figure_lines(doc: ReviewDoc) -> list[str]:
    """What the figures say to people."""
    figures = doc.figures
    other = [doc.other_surface] if doc.other_surface else []
    if figures is None:
        return [
            *other,
            f"{harmless(doc.recording.name)}: no figures",
            f"  recorded {doc.duration_s:.0f} s from {doc.start_utc}",
        ]
    lines = [
        *other,
        _ending(figures),
        f"  from the first waypoint to the last: {_number(figures.duration_s, 1)} s,"
        f" predicted {_number(figures.predicted_s, 1)} s, lag {_number(figures.lag_s, 1)} s",
        f"  beside the line: at most {_number(figures.cross_track_max_m)} m, mean"
        f" {_number(figures.cross_track_mean_m)} m, 95 % within {_number(figures.cross_track_p95_m)} m",
        f"  above and below it: {_number(figures.height_error_lowest_m)} m to"
        f" {_number(figures.height_error_highest_m)} m, 95 % within {_number(figures.height_error_p95_m)} m",
    ]
    if figures.min_distance_m is not None:
        certified = figures.certified_distance_m
        proved = f", certified {_number(certified)} m" if certified is not None else ""
        required = figures.required_distance_m
        proved += f", required {_number(required)} m" if required is not None else ""
        lines.append(
            f"  distance to the surface model: at least {_number(figures.min_distance_m)} m{proved};"
            f" on the way home {_number(figures.min_distance_way_home_m)} m"
        )
    return lines


def _ending(figures: ReviewFigures) -> str:
    word = "COMPLETED" if figures.completed else "NOT COMPLETED"
    word += "" if figures.below_required is None else ", BELOW THE REQUIRED CLEARANCE"
    if figures.higher_m is None:
        return word
    return f"{word}, up to {_number(figures.higher_m, 0)} m higher from item {figures.higher_from_item}"


def _number(value: float | None, digits: int = 2) -> str:
    return "unknown" if value is None else f"{value:.{digits}f}"
