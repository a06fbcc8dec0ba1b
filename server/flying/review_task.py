"""What workers do with recordings: read them, find what they were flown over, judge them.

The readers bring in the wire protocols; they are imported by the workers only, so that the page answers sooner.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planning.following.reference import Reference
from planning.following.track import Track
from planning.planner.plan import plan_mission
from planning.terrain.dsm import Dsm
from server.heard.flown_track import EVERY_S
from server.library.documents import request_from_doc
from server.library.terrain_of import FlownOver
from server.library.terrains import load_terrain
from server.plan.archives import named
from server.scene.geometry.payload import ReviewScene, TerrainScene
from server.scene.geometry.plain import plain_ground
from server.schemas import PlanDoc, RecordingDoc, ReviewDoc
from server.work.jobs import Progress
from telemetry.errors import TelemetryError
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from telemetry.recording.flight_log import FlightLog

_PLACES = 12
_DRAWN_POINTS = 4000


@dataclass(frozen=True, slots=True)
class FlownTerrain:
    """A surface model of the library."""

    terrain_id: str
    name: str
    directory: Path


@dataclass(frozen=True, slots=True)
class Reviewed:
    """All that is shown of a recording."""

    doc: ReviewDoc
    start_utc_s: float
    terrain_id: str | None
    scene: ReviewScene | None
    reference: Reference | None
    """In the coordinates of that surface model, or of the recording's own; None without one, or without a plan."""


def read(upload: Path, filename: str, *, report: Progress) -> None:
    """Raises RecordingError, in words about the operator's own file."""
    from telemetry.recording.flight_log import read_flight_log

    report("Reading the recording", None)
    with named(upload, filename, kind=TelemetryError):
        read_flight_log(upload)


def states_so_far(path: Path, *, report: Progress) -> list[VehicleState]:
    """Of a recording that is being written: the positions since the vehicle armed, thinned. Raises RecordingError."""
    from telemetry.recording.flight_log import read_flight_log

    report("Reading the recording", None)
    log = read_flight_log(path)
    armed_utc_s = next((t for t, armed in reversed(log.armed) if armed), log.end_utc_s)
    kept: list[VehicleState] = []
    for t_utc_s, state in log.states:
        if t_utc_s >= armed_utc_s and (not kept or state.t_utc_s - kept[-1].t_utc_s >= EVERY_S):
            kept.append(state)
    return kept


def flown_over(path: Path, *, report: Progress) -> FlownOver:
    """What the recording tells about its surface model. Raises RecordingError."""
    report("Reading the recording", None)
    log = _log(path, path.stat().st_mtime_ns)
    rows = np.unique(np.linspace(0, max(0, len(log.track) - 1), _PLACES).astype(int)) if len(log.track) else []
    places = tuple((float(log.track.lat_deg[row]), float(log.track.lon_deg[row])) for row in rows)
    if log.plan is None:
        return FlownOver(places=places)
    if log.ground is not None:
        return FlownOver(log.plan.terrain_id, log.plan.terrain_sha256)  # any other one would be worse than its own
    return FlownOver(log.plan.terrain_id, log.plan.terrain_sha256, places)


def review(
    path: Path, recording: RecordingDoc, terrain: FlownTerrain | None, plan: PlanDoc | None, *, report: Progress
) -> Reviewed:
    """Judges a recording against its own plan, or ``plan``, over a surface model.

    Raises RecordingError, PlanningError.
    """
    from server.flying.review import review as judged
    from server.flying.review_flight import placed_flight

    report("Reading the recording", None)
    log = _log(path, path.stat().st_mtime_ns)
    dsm = log.ground if terrain is None else load_terrain(terrain.directory)
    mission = None
    if plan is not None and terrain is not None and dsm is not None:
        report("Computing the plan", None)
        mission = plan_mission(dsm, request_from_doc(plan, dsm)).mission
    report("Judging the flight", None)
    doc = judged(log, recording, dsm=dsm, mission=mission, terrain_name=_name(log, terrain))
    if plan is not None:
        doc = doc.model_copy(update={"plan_name": plan.name})
    flight = placed_flight(log, dsm=dsm, mission=mission)
    reference = None if flight is None else flight.reference
    ground = drawn = None
    if flight is not None and dsm is None:
        ground = plain_ground(flight.dsm, np.vstack([flight.track.xyz_m, _planned_m(reference)]))
    elif terrain is None and dsm is not None:
        ground, drawn = dsm, _drawn(dsm)
    return Reviewed(
        doc=doc,
        start_utc_s=log.start_utc_s,
        terrain_id=None if terrain is None else terrain.terrain_id,
        scene=None if flight is None else _scene(flight.track, reference, ground, drawn),
        reference=None if dsm is None else reference,
    )


def _name(log: FlightLog, terrain: FlownTerrain | None) -> str:
    if terrain is not None:
        return terrain.name
    return "" if log.ground is None else "the recording's own surface model"


def _drawn(ground: Dsm) -> TerrainScene:
    from server.scene.geometry.terrain_payload import build_terrain_scene

    return build_terrain_scene("", ground, shading="height", orthophoto=None)


def _scene(track: Track, reference: Reference | None, ground: Dsm | None, drawn: TerrainScene | None) -> ReviewScene:
    every = max(1, len(track.xyz_m) // _DRAWN_POINTS)
    rows = np.union1d(np.arange(0, len(track.xyz_m), every), np.concatenate([track.gaps, track.gaps + 1]))
    after = np.searchsorted(rows, track.gaps) + 1
    flown_m = np.insert(track.xyz_m[rows], after, np.nan, axis=0)
    return ReviewScene(planned_m=_planned_m(reference), flown_m=flown_m, ground=ground, drawn=drawn)


def _planned_m(reference: Reference | None) -> np.ndarray:
    return np.zeros((0, 3)) if reference is None else reference.points_m


@lru_cache(maxsize=1)
def _log(path: Path, changed_ns: int) -> FlightLog:
    """Read once for both questions."""
    from telemetry.recording.flight_log import read_flight_log

    del changed_ns
    return read_flight_log(path)
