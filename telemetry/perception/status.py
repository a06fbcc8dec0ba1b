"""What a sensor's node says of itself after every frame, and once a second when there is none."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import asdict
from statistics import median
from typing import Any, Generic, NamedTuple, TypeVar

from mapping.geometry.frames import LocalFrame
from mapping.perceiving.alerts import AlertEvent
from mapping.perceiving.flight_map import FlightMap
from mapping.perceiving.frame_result import FrameResult
from telemetry.perception.convert import alert_of, counts, obstacle_of
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.perception.whereabouts import Whereabouts
from telemetry.topics.obstacles import Basis, FlightMapStatus, MissionConflict, ObstacleAlert, PerceptionStatus, Region

_LATENCIES = 50
_SAY_BEGUN_S = 10.0
NO_PLACE = "No position of the vehicle yet: what the camera sees is told, but not drawn."
_SAY_PART_S = 20.0
_FAR_S = 60.0
"""A refused frame that says it is from farther away in time is told of at the present one."""


Status = TypeVar("Status")


class Outcome(NamedTuple, Generic[Status]):
    status: Status
    alerts: tuple[ObstacleAlert, ...]
    accepted: bool
    """A frame went into the map, or into the tracker."""


class Teller:
    """Turns results into messages."""

    def __init__(self, kind: SensorKind, utc_minus_mono_s: float) -> None:
        self.notes: dict[str, str] = {}
        """What stays to be said while it is so, by subject."""
        self.begun = ""
        """Why the map began afresh; said for a while."""
        self.ended: list[AlertEvent] = []
        """Alerts that ended with a map that was emptied."""
        self._kind, self._utc_minus_mono_s = kind, utc_minus_mono_s
        self._latencies: deque[float] = deque(maxlen=_LATENCIES)
        self._begun_s: float | None = None

    def note(self, subject: str, text: str) -> None:
        """Empty: it is not so any more."""
        if text:
            self.notes[subject] = text
        else:
            self.notes.pop(subject, None)

    def outcome(
        self,
        result: FrameResult,
        perception: Any,
        where: Whereabouts,
        *,
        dropped: Counter[str],
        done_s: float,
        basis: Basis | None,
        conflict: MissionConflict | None,
        clear_count: int,
    ) -> Outcome[PerceptionStatus]:
        if result.accepted:
            self._latencies.append(done_s - result.t_mono_s)
        frame, the_map = where.frame if perception.placed else None, perception.map
        t_mono_s = result.t_mono_s if abs(result.t_mono_s - done_s) < _FAR_S else done_s  # also when it is no number
        self.note("place", "" if perception.placed or not result.accepted else NO_PLACE)
        self.note("memory", full_text(the_map) if the_map.is_full else "")
        self._note_flight_map(perception.flight, done_s)
        status = PerceptionStatus(
            sensor=self._kind.sensor,
            state=result.state,
            text=self._text(result, done_s),
            t_mono_s=t_mono_s,
            t_utc_s=t_mono_s + self._utc_minus_mono_s,
            done_t_mono_s=done_s,
            frames=perception.frames,
            dropped=counts(dropped),
            lost_frames=perception.lost_frames,
            points=result.points,
            voxels_occupied=the_map.occupied_count,
            voxels_explained=the_map.explained_count,
            map_bytes=the_map.size_bytes,
            map_revision=the_map.revision,
            clear_count=clear_count,
            origin=where.origin,
            region=None if result.region is None else Region(**asdict(result.region)),
            corridor_m=result.corridor_m,
            corridor_occupied=result.corridor_occupied,
            obstacles=tuple(obstacle_of(found, frame) for found in result.obstacles),
            sweep_m=result.sweep_m,
            conflict=conflict,
            divergence_m=result.divergence_m,
            latency_s=median(self._latencies) if self._latencies else None,
            basis=basis,
            flight_map=flight_map_status(perception.flight),
            placed=perception.placed,
        )
        events, self.ended = [*self.ended, *result.alerts], []
        return Outcome(status, tuple(self._alert(event, frame, done_s) for event in events), result.accepted)

    def _note_flight_map(self, flight: FlightMap | None, now_s: float) -> None:
        """A part that has just begun is said, so that nobody misses what was drawn before."""
        if flight is None:
            return
        is_new = now_s - flight.since_t_s < _SAY_PART_S
        said = f"{flight.why}: the camera's map of the flight begins a new part ({flight.part})."
        self.note("part", said if is_new else "")
        self.note("flight_memory", f"Whole flight: {full_text(flight.map)}" if flight.map.is_full else "")

    def _alert(self, event: AlertEvent, frame: LocalFrame | None, done_s: float) -> ObstacleAlert:
        return alert_of(
            event,
            self._kind.sensor,
            frame,
            utc_minus_mono_s=self._utc_minus_mono_s,
            done_t_mono_s=done_s,
        )

    def _text(self, result: FrameResult, now_s: float) -> str:
        if self.begun and self._begun_s is None:
            self._begun_s = now_s
        if self._begun_s is not None and now_s - self._begun_s > _SAY_BEGUN_S:
            self.begun, self._begun_s = "", None
        return " ".join(text for text in (result.text, *self.notes.values(), self.begun) if text)


def flight_map_status(flight: FlightMap | None) -> FlightMapStatus | None:
    if flight is None:
        return None
    return FlightMapStatus(flight.map.occupied_count, flight.map.size_bytes, flight.part, flight.why)


def full_text(the_map: Any) -> str:
    """Of a map that takes little or nothing new."""
    return (
        f"The map has reached its memory limit ({the_map.size_bytes / 1e6:,.0f} MB): little or nothing new is "
        f"taken into it ({the_map.refused_updates:,} left out). Empty it, or allow it more."
    )
