"""A judged flight as the console's figures, curves and events: thinned, with every peak kept."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64, I64
from planning.certificate.certificate_model import with_accuracy
from planning.following.below import Demanded, below_required
from planning.following.figures import Judged, TrackFigures
from planning.following.lag import planned_alt_dsm_m
from planning.following.reference import Reference
from planning.following.track import Track
from planning.planner.request import clearance_of_planned
from server.flying.review_flight import Flight
from server.schemas.review_docs import Histogram, ReviewEvent, ReviewFigures, ReviewSeries
from telemetry.recording.flight_log import FlightLog
from telemetry.topics.obstacles import ObstacleAlert

STRETCHES = 400
"""Parts of a long recording of which each keeps its first position and its peaks."""
_WARNING, _INFO = 4, 6
"""MAV_SEVERITY"""


def figures_doc(flight: Flight, figures: TrackFigures) -> ReviewFigures:
    nearest, home = figures.nearest, figures.nearest_on_way_home
    demanded = demanded_of(flight)
    below = below_required(figures, demanded)
    lat_deg = lon_deg = None
    if nearest:
        lat_deg, lon_deg = (float(v) for v in flight.dsm.lat_lon_from_xy(np.array([nearest.xyz_m[:2]]))[0])
    return ReviewFigures(
        completed=figures.completed,
        duration_s=figures.flight_s,
        predicted_s=figures.predicted_s,
        lag_s=figures.lag_s,
        cross_track_max_m=figures.cross_track.max_m,
        cross_track_mean_m=figures.cross_track.mean_m,
        cross_track_p95_m=figures.cross_track.p95_m,
        height_error_max_m=figures.height.max_m,
        height_error_mean_m=figures.height.mean_m,
        height_error_p95_m=figures.height.p95_m,
        height_error_lowest_m=figures.height_lowest_m,
        height_error_highest_m=figures.height_highest_m,
        min_distance_m=nearest.distance_m if nearest else None,
        min_vertical_m=figures.min_vertical_m,
        certified_distance_m=certified_distance_m(flight.log),
        required_distance_m=demanded.required_m if demanded else None,
        below_required=below.text if below else None,
        min_distance_t_s=nearest.t_s if nearest else None,
        min_distance_s_m=nearest.s_m if nearest else None,
        min_distance_lat_deg=lat_deg,
        min_distance_lon_deg=lon_deg,
        min_distance_way_home_m=home.distance_m if home else None,
        positions=figures.positions,
        higher_m=figures.higher.most_m if figures.higher else None,
        higher_from_item=figures.higher.from_item + 1 if figures.higher else None,
    )


def certified_distance_m(log: FlightLog) -> float | None:
    """What was certified of the mission that flew; None when the recording holds no certificate."""
    return _metres(_certificate(log), "min_distance_m")


def demanded_of(flight: Flight) -> Demanded | None:
    """By the recorded certificate, which is of what was on board; else by what the mission's own file says."""
    certificate = _certificate(flight.log)
    required_m = _metres(certificate, "required_clearance_m")
    if required_m is not None:
        return Demanded(required_m, _metres(certificate.get("tube"), "radius_m") or 0.0)
    planned = None if flight.mission is None else flight.mission.planned_for
    if planned is None:
        return None
    params = with_accuracy(clearance_of_planned(planned), flight.dsm)
    return Demanded(params.required_clearance_m, params.following_m)


def _certificate(log: FlightLog) -> dict[str, Any]:
    try:
        found = json.loads(log.plan.certificate_json) if log.plan is not None else {}
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _metres(values: object, key: str) -> float | None:
    value = values.get(key) if isinstance(values, dict) else None
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def histogram_doc(figures: TrackFigures) -> Histogram:
    return Histogram(edges_m=figures.histogram_edges_m.tolist(), counts=figures.histogram_counts.tolist())


def curves(flight: Flight, judged: Judged | None) -> ReviewSeries:
    """Curves over the whole recording, parted where nothing is known; errors against the plan only where the flight
    is judged."""
    track = flight.track
    n = len(track.t_s)
    nowhere = np.full(n, math.nan)
    cross_m, s_m, reference_m, distance_m, planned_m = nowhere, nowhere, nowhere, nowhere, nowhere
    if flight.surface is not None:
        distance_m = judged.distance_m if judged and judged.distance_m is not None else _distances(flight)
    if judged is not None and judged.window is not None and flight.reference is not None:
        counts = judged.window.judged
        cross_m = np.where(counts, judged.found.cross_track_m, math.nan)
        s_m = np.where(counts, judged.found.s_m, math.nan)
        line_m = track.xyz_m[:, 2] - judged.found.height_error_m - flight.home_alt_dsm_m
        reference_m = np.where(counts, line_m, math.nan)
        planned_m = planned_alt_dsm_m(flight.reference, track.t_s - judged.window.start_s) - flight.home_alt_dsm_m
    height_m = track.xyz_m[:, 2] - flight.home_alt_dsm_m
    ground_m = nowhere
    if flight.surface is not None:
        ground_m = flight.dsm.elevation_at(track.xyz_m[:, :2]) - flight.home_alt_dsm_m
    kept = thinned(n, (cross_m, height_m - reference_m, distance_m, height_m, planned_m))
    gaps = track.gaps
    kept = np.union1d(kept, np.concatenate([gaps, gaps + 1]))
    after = np.searchsorted(kept, gaps) + 1

    def parted(curve: F64) -> list[float | None]:
        return _or_null(np.insert(curve[kept], after, math.nan))

    return ReviewSeries(
        t_s=np.insert(track.t_s[kept], after, (track.t_s[gaps] + track.t_s[gaps + 1]) / 2).tolist()
        if len(gaps)
        else track.t_s[kept].tolist(),
        alt_rel_home_m=parted(height_m),
        reference_alt_rel_home_m=parted(reference_m),
        planned_alt_rel_home_m=parted(planned_m),
        ground_rel_home_m=parted(ground_m),
        cross_track_m=parted(cross_m),
        s_m=parted(s_m),
        distance_to_dsm_m=parted(distance_m),
    )


def _distances(flight: Flight) -> F64:
    assert flight.surface is not None
    return flight.surface.distances_m(flight.track.xyz_m)


def thinned(count: int, peaks: tuple[F64, ...]) -> I64:
    """Rows to keep of a long track: of every stretch the first, and where each curve is lowest and highest."""
    if count <= STRETCHES * (2 * len(peaks) + 1):
        return np.arange(count)
    edges = np.linspace(0, count, STRETCHES + 1).astype(np.int64)
    kept = {0, count - 1, *edges[:-1].tolist()}
    for begin, end in itertools.pairwise(edges):
        for curve in peaks:
            part = curve[begin:end]
            if np.isfinite(part).any():
                kept |= {int(begin + np.nanargmin(part)), int(begin + np.nanargmax(part))}
    return np.array(sorted(kept), dtype=np.int64)


def _or_null(values: F64) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def gap_events(track: Track) -> list[ReviewEvent]:
    """Where curves and line are parted, and why."""
    return [
        ReviewEvent(
            t_s=float(track.t_s[row]),
            kind="gap",
            text=f"No position was recorded for {track.t_s[row + 1] - track.t_s[row]:.1f} s: no line is drawn.",
            severity=_WARNING,
        )
        for row in track.gaps
    ]


def events(log: FlightLog, gaps: list[ReviewEvent]) -> list[ReviewEvent]:
    """Everything that happened, in the order of time."""
    found = [_event(log, t, "mode", mode) for t, mode in log.modes]
    found += [_event(log, t, "arm", "Armed" if armed else "Disarmed") for t, armed in log.armed]
    found += [_event(log, t, "item", f"Item {seq} reached") for t, seq in log.reached]
    found += [_event(log, text.t_utc_s, "text", text.text, text.severity) for text in log.texts]
    found += [_event(log, c.t_utc_s, "command", f"{c.operator}: {c.words}") for c in log.commands]
    found += [_alert(log, alert) for alert in log.alerts]
    return sorted([*found, *gaps], key=lambda event: event.t_s)


def _alert(log: FlightLog, alert: ObstacleAlert) -> ReviewEvent:
    over = alert.phase == "ends"
    severity = _INFO if over else _WARNING
    return _event(log, alert.t_utc_s, "alert", f"Over: {alert.text}" if over else alert.text, severity)


def _event(log: FlightLog, t_utc_s: float, kind: str, text: str, severity: int = 6) -> ReviewEvent:
    return ReviewEvent(t_s=t_utc_s - log.start_utc_s, kind=kind, text=text, severity=severity)


def predicted_note(reference: Reference | None, log: FlightLog) -> str | None:
    """On whose limits the predicted time rests, when the recording does not say what was planned with."""
    if reference is None or not math.isfinite(reference.flight_s) or (log.plan and log.plan.profile_toml):
        return None
    return "The predicted time and the lag rest on the default vehicle profile's speeds: the recording names none."
