"""What the flight lane's worker does when a moving object approaches: the proposed velocity as a way that is flown."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from planning.evading.keep_clear import Seen, Surface
from planning.evading.sidestep import Mover, Proposed, Sidestep, sidestep
from planning.evading.way_past import AvoidanceParams, NoWay
from server.obstacles.manoeuvre_situation import MissionAhead, Prepared, Situation, cruise_m_s, handle_of, impossible
from server.schemas import ManoeuvreDoc
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.tracks import Track, TracksStatus


@dataclass(frozen=True, slots=True)
class Around:
    """What stands around the vehicle, and the frame that all is in."""

    seen: Sequence[Seen]
    surface: Surface | None
    params: AvoidanceParams
    frame: LocalFrame


def sidestepped(
    situation: Situation, approach: ObstacleAlert, position_enu_m: F64, ahead: MissionAhead | None, around: Around
) -> Prepared:
    tracks = situation.tracks
    if tracks is None:
        return impossible("sidestep", "Moving objects are not followed at the moment.", approach)
    proposed = _proposed(situation, tracks, around.frame)
    if isinstance(proposed, NoWay):
        return impossible(proposed.kind, proposed.reason, approach)
    # A return home is not gone on with on the mission's line.
    line = None if ahead is None or situation.flight.phase == "returning" else ahead.points_enu_m
    way = sidestep(position_enu_m, line, proposed, around.seen, around.surface, around.params)
    if isinstance(way, NoWay):
        return impossible(way.kind, way.reason, approach)
    return _prepared(way, tracks, situation, approach, ahead, around.frame)


def _proposed(situation: Situation, tracks: TracksStatus, frame: LocalFrame) -> Proposed | NoWay:
    proposal = tracks.proposal
    if proposal is None:
        why = tracks.no_proposal or "The present velocity leads into nothing: keep it."
        return NoWay("sidestep", why)
    return Proposed(
        velocity_enu_m_s=proposal.velocity_enu_m_s,
        hold_s=proposal.hold_s,
        movers=tuple(_mover(track, tracks, situation, frame) for track in tracks.tracks if track.moving),
        keep_m=situation.safety_radius_m,
        back_m_s=cruise_m_s(situation.record),
    )


def _mover(track: Track, tracks: TracksStatus, situation: Situation, frame: LocalFrame) -> Mover:
    """Where it is when the vehicle is where its state says."""
    alt_m = situation.origin.alt_amsl_m + track.enu_m[2]
    east_m, north_m, _ = frame.to_enu(track.lat_deg, track.lon_deg, alt_m)[0].tolist()
    at_s = situation.state.position_t_mono_s
    later_s = 0.0 if at_s is None else at_s - tracks.t_mono_s
    v_east_m_s, v_north_m_s = track.velocity_enu_m_s
    return Mover((east_m + later_s * v_east_m_s, north_m + later_s * v_north_m_s), track.velocity_enu_m_s)


def _prepared(
    way: Sidestep,
    tracks: TracksStatus,
    situation: Situation,
    approach: ObstacleAlert,
    ahead: MissionAhead | None,
    frame: LocalFrame,
) -> Prepared:
    item = None
    if way.leg is not None and ahead is not None:
        item = ahead.item(way.leg)
    clearance_m = min(way.seen_m, way.surface_m)
    legs = zip(itertools.pairwise(way.points_enu_m), way.speeds_m_s, strict=True)
    seconds = way.wait_s + sum(math.dist(a, b) / speed_m_s for (a, b), speed_m_s in legs)
    doc = ManoeuvreDoc(
        id=handle_of("sidestep", approach),
        kind="sidestep",
        for_alert=approach.id,
        possible=True,
        text=_words(way, tracks),
        clearance_m=clearance_m if math.isfinite(clearance_m) else None,
        length_m=way.length_m,
        seconds=seconds,
        climb_m=float(way.points_enu_m[-1, 2] - way.points_enu_m[0, 2]),
    )
    places = frame.to_geodetic(way.points_enu_m).tolist()
    flown_to = item or situation.flight.target or 1
    targets = tuple(
        GuidedTarget(flown_to, lat, lon, up, speed_m_s, loiter_s=way.wait_s if number == 0 else 0.0)
        for number, ((lat, lon, _), up, speed_m_s) in enumerate(
            zip(places[1:], way.points_enu_m[1:, 2].tolist(), way.speeds_m_s, strict=True)
        )
    )
    points = tuple((e, n, u) for e, n, u in way.points_enu_m.tolist())
    begins = places[0][0], places[0][1]
    return Prepared(doc, targets, item, situation.height_offset_m, points, begins)


def _words(way: Sidestep, tracks: TracksStatus) -> str:
    proposal = tracks.proposal
    assert proposal is not None
    then = "back to the mission" if way.leg is not None else "it holds there"
    passes = f", passes {way.moving_m:.1f} m away" if math.isfinite(way.moving_m) else ""
    held_s = way.wait_s or math.dist(way.points_enu_m[0], way.points_enu_m[1]) / way.speeds_m_s[0]
    return f"{proposal.text.rstrip('.')} for {held_s:.0f} s{passes}, then {then}."
