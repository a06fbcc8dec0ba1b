"""Review: what a recorded flight came to, against its plan and over the surface model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from planning.basics.plan_model import Mission
from planning.following.below import below_required
from planning.following.figures import Judged, judge
from planning.formats.other_surface import other_surface
from planning.terrain.dsm import Dsm
from server.flying.review_curves import (
    curves,
    demanded_of,
    events,
    figures_doc,
    gap_events,
    histogram_doc,
    predicted_note,
)
from server.flying.review_flight import Flight, placed_flight
from server.library.shelf import iso_utc
from server.schemas.flight_docs import RecordingDoc
from server.schemas.review_docs import ReviewDoc, ReviewSeries
from telemetry.recording.flight_log import FlightLog
from telemetry.topics.track_settings import unusual

EMPTY = ReviewSeries(
    t_s=[],
    alt_rel_home_m=[],
    reference_alt_rel_home_m=[],
    planned_alt_rel_home_m=[],
    ground_rel_home_m=[],
    cross_track_m=[],
    s_m=[],
    distance_to_dsm_m=[],
)


def review(
    log: FlightLog,
    recording: RecordingDoc,
    *,
    dsm: Dsm | None = None,
    mission: Mission | None = None,
    terrain_name: str = "",
    truth: bool = False,
) -> ReviewDoc:
    """Judge a flight. Takes a second or two for a long one: not for the event loop.

    ``mission`` stands in for the recording's own; ``truth`` takes a simulator's true positions instead of
    the vehicle's estimate. What is missing is null, and ``notes`` say why.
    """
    flight = placed_flight(log, dsm=dsm, mission=mission, truth=truth)
    judged = _judged(flight)
    other = _other_surface(flight, dsm, log if mission is None else None)
    figures = judged.figures if judged else None
    return ReviewDoc(
        recording=recording,
        start_utc=iso_utc(log.start_utc_s),
        duration_s=log.end_utc_s - log.start_utc_s,
        first_waypoint_t_s=figures.start_s if figures else None,
        last_waypoint_t_s=figures.end_s if figures and figures.completed else None,
        figures=figures_doc(flight, figures) if flight and figures else None,
        series=curves(flight, judged) if flight else EMPTY,
        histogram=histogram_doc(figures) if figures else None,
        events=events(log, gap_events(flight.track) if flight else []),
        plan_name=log.plan.name if log.plan and mission is None else "",
        terrain_name=terrain_name,
        other_surface=other or "",
        checklist=log.checklist,
        notes=[*([other] if other else []), *_notes(flight, judged, dsm, log)],
    )


def _other_surface(flight: Flight | None, dsm: Dsm | None, log: FlightLog | None) -> str | None:
    """``log`` where its own mission is judged: older ones name the surface model beside it only."""
    mission = None if flight is None else flight.mission
    if mission is None or dsm is None:
        return None
    if not mission.surface_sha256 and log is not None and log.plan is not None:
        mission = replace(mission, surface_sha256=log.plan.terrain_sha256, surface_name=log.plan.terrain_name)
    return other_surface(mission, dsm)


def _judged(flight: Flight | None) -> Judged | None:
    if flight is None or flight.reference is None:
        return None
    return judge(flight.reference, flight.track, flight.surface)


def _followed_by(log: FlightLog) -> list[str]:
    """How objects were followed, where that was not as usual; while it was changed in flight, each time."""
    told = [", ".join(unusual(settings.tracker, settings.velocities)) for _, settings in log.settings]
    changes = [words for k, words in enumerate(told) if k == 0 or told[k - 1] != words]
    if not any(changes):
        return []
    return [f"Objects were followed with {', then '.join(words or 'the usual figures' for words in changes)}."]


def _notes(flight: Flight | None, judged: Judged | None, dsm: Dsm | None, log: FlightLog) -> list[str]:
    if flight is None:
        return list(dict.fromkeys([*log.faults, "The recording holds no position of the vehicle.", *_followed_by(log)]))
    notes = [*flight.notes, *_followed_by(log)]
    if dsm is None:
        notes.append("There is no surface model: distances to the ground are not known.")
    if judged is None:
        return notes
    if judged.figures is None:
        return [*notes, "The flight never came to the mission's line: there are no figures."]
    figures = judged.figures
    below = below_required(figures, demanded_of(flight))
    if below is not None:
        notes.insert(0, below.text)
    if figures.told_by == "geometry":
        notes.append("The vehicle did not say what it reached: waypoints count where the track is nearest to them.")
    if flight.track.detours:
        notes.append("Avoidance flew a part of it: that counts for distances to the ground, not for errors.")
    if not figures.completed:
        notes.append("The last waypoint was not reached: the figures end where the mission was left.")
    if figures.unknown_positions:
        notes.append(f"{figures.unknown_positions} positions lie over terrain that the surface model does not know.")
    note = predicted_note(flight.reference, log)
    return [*notes, note] if note else notes


def recording_of(log: FlightLog, path: Path) -> RecordingDoc:
    """A file outside the library as the library would list it."""
    vehicle = log.vehicle
    return RecordingDoc(
        id=path.name,
        name=path.stem,
        kind=log.kind,
        started_utc=iso_utc(log.start_utc_s),
        duration_s=log.end_utc_s - log.start_utc_s,
        bytes=path.stat().st_size,
        vehicle=f"{vehicle.autopilot} {vehicle.firmware_version or ''}".strip(),
        plan_name=log.plan.name if log.plan else "",
        fault=" ".join(log.faults),
    )
