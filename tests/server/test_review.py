"""Review of made-up flights, where every figure is known beforehand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from planning.basics.plan_model import Home, PlannedFor
from planning.formats.wpl import write_wpl
from planning.missions.vehicle_profile import dump_profile, load_profile
from server.cli.review_command import figure_lines, summary
from server.flying.review import recording_of, review
from server.flying.review_curves import STRETCHES, thinned
from server.flying.review_flight import placed_flight
from server.flying.review_task import _scene
from server.scene.geometry.mark_shapes import line_node
from server.schemas.flight_docs import RecordingDoc
from telemetry.recording.frame_facts import SentTarget
from telemetry.recording.recorded_flight import FlightLog, track_of
from telemetry.topics.messages import CommandRecord, PlanRecord
from telemetry.topics.obstacles import ObstacleAlert
from tests.server.flight_logs import PLAIN, ROUTE, START_UTC_S, degrees, log_of, mission, plain, positions

RECORDING = RecordingDoc(
    id="x", name="x", kind="hedgehop", started_utc="2027-01-15T08:00:00.000Z", duration_s=1.0, bytes=1
)
FLOWN = mission(ROUTE)


def reviewed(log: FlightLog, **options):
    return review(log, RECORDING, **options)


def figures(log: FlightLog, **options):
    found = reviewed(log, **options).figures
    assert found is not None
    return found


def with_plan(log: FlightLog, *, certificate: str = "", sha256: str = PLAIN.sha256) -> FlightLog:
    plan = PlanRecord(
        t_utc_s=START_UTC_S,
        name="Orchard",
        mission_wpl=write_wpl(FLOWN),
        digest="d",
        firmware="ardupilot",
        terrain_id="t",
        terrain_name="Hill",
        terrain_sha256=sha256,
        home_alt_dsm_m=100.0,
        vertical_datum=None,
        profile_toml=dump_profile(replace(load_profile("generic-quad"), max_speed_m_s=4.0, mean_speed_m_s=3.0)),
        certificate_json=certificate,
    )
    return replace(log, mission=None, plan=plan)


def test_a_flight_as_planned() -> None:
    doc = reviewed(log_of(positions(), flown=FLOWN), dsm=PLAIN)
    found = doc.figures
    assert found is not None
    assert found.completed
    assert found.cross_track_max_m == pytest.approx(0.0, abs=0.02)
    assert found.height_error_max_m == pytest.approx(0.0, abs=0.05)
    assert found.duration_s == pytest.approx(50.0, abs=0.5)
    assert found.min_distance_m == pytest.approx(12.0, abs=0.05)
    assert found.min_vertical_m == pytest.approx(12.0, abs=0.05)
    assert found.min_distance_way_home_m == pytest.approx(20.4, abs=0.5)
    assert found.min_distance_lat_deg == pytest.approx(degrees([(200.0, 150.0)])[0, 0], abs=3e-5)
    assert doc.first_waypoint_t_s == pytest.approx(10.0, abs=0.3)
    assert doc.last_waypoint_t_s == pytest.approx(60.0, abs=0.6)
    assert doc.histogram is not None
    assert sum(doc.histogram.counts) == found.positions


def test_beside_and_above_the_line() -> None:
    off = [(x, y - 0.7, z + 0.4) if z == 20.0 else (x, y, z) for x, y, z in positions()]
    found = figures(log_of(off, flown=FLOWN), dsm=PLAIN)
    assert found.cross_track_p95_m == pytest.approx(0.7, abs=0.02)
    assert found.height_error_mean_m == pytest.approx(0.4, abs=0.02)


def test_without_a_mission_there_are_curves_and_no_figures() -> None:
    doc = reviewed(log_of(positions()), dsm=PLAIN)
    assert doc.figures is None
    assert doc.histogram is None
    assert min(d for d in doc.series.distance_to_dsm_m if d is not None) == pytest.approx(0.0, abs=0.01)
    assert set(doc.series.cross_track_m) == {None}
    assert any("no mission" in note for note in doc.notes)


def test_without_a_surface_model_there_are_errors_and_no_distances() -> None:
    doc = reviewed(log_of(positions(), flown=FLOWN))
    assert doc.figures is not None
    assert doc.figures.min_distance_m is None
    assert doc.figures.cross_track_max_m == pytest.approx(0.0, abs=0.02)
    assert set(doc.series.distance_to_dsm_m) == {None}
    assert set(doc.series.ground_rel_home_m) == {None}
    assert any("no surface model" in note for note in doc.notes)


def test_heights_count_from_the_vehicles_own_home() -> None:
    """Ten metres beside the planned home the ground is 3 m higher: the vehicle flies 3 m higher."""
    cells = np.array(PLAIN.elevation_m)
    cells[145:155, 35:45] += 3.0
    doc = reviewed(log_of(positions(), flown=FLOWN, home=(40.0, 150.0)), dsm=PLAIN.with_elevation(cells))
    assert doc.figures is not None
    assert doc.figures.height_error_mean_m == pytest.approx(3.0, abs=0.1)
    assert any("10.0 m from the plan's, where the surface is 3.00 m higher" in note for note in doc.notes)


def test_curves_are_relative_to_the_plans_home_and_equally_long() -> None:
    series = reviewed(log_of(positions(), flown=FLOWN), dsm=PLAIN).series
    lengths = {len(curve) for curve in series.model_dump().values()}
    assert len(lengths) == 1
    flying = [k for k, s in enumerate(series.s_m) if s is not None]
    assert [series.reference_alt_rel_home_m[k] for k in flying] == pytest.approx([20.0] * len(flying), abs=0.05)
    assert series.ground_rel_home_m[0] == pytest.approx(0.0)
    assert series.cross_track_m[0] is None  # the take-off is not judged


def test_a_delayed_flight_lies_behind_the_plan_by_its_own_clock() -> None:
    series = reviewed(log_of(positions(), flown=FLOWN), dsm=PLAIN).series
    planned = [alt_m for alt_m in series.planned_alt_rel_home_m if alt_m is not None]
    assert planned == pytest.approx([20.0] * len(planned), abs=0.05)
    assert planned


def test_where_nothing_was_recorded_no_line_is_drawn_and_that_is_said() -> None:
    whole = log_of(positions(), flown=FLOWN)
    from_s, until_s = 40.0, 44.1
    states = tuple(each for each in whole.states if not from_s < each[0] - START_UTC_S < until_s)
    log = replace(whole, states=states, track=track_of(states))
    doc = reviewed(log, dsm=PLAIN)
    assert not [event for event in reviewed(whole, dsm=PLAIN).events if event.kind == "gap"]
    (gap,) = [event for event in doc.events if event.kind == "gap"]
    assert gap.t_s == pytest.approx(from_s)
    assert "No position was recorded for 4.2 s" in gap.text
    inside = [k for k, t_s in enumerate(doc.series.t_s) if from_s < t_s < until_s]
    assert len(inside) == 1
    curves = doc.series.model_dump()
    assert {name: curves[name][inside[0]] for name in curves if name != "t_s"} == dict.fromkeys(curves.keys() - {"t_s"})
    assert all(step >= 0 for step in np.diff(doc.series.t_s))

    placed = placed_flight(log, dsm=PLAIN)
    assert placed is not None
    flown_m = _scene(placed.track, None, None, None).flown_m
    line = line_node("/flown", flown_m, (1, 2, 3), width_px=1.0)
    assert len(line.props["points"]) == len(placed.track.t_s) - 2
    assert np.isfinite(line.props["points"]).all()
    assert len(line.props["colors"]) == len(line.props["points"])


def test_a_long_flight_is_thinned_and_keeps_its_peaks() -> None:
    n = 40_000
    peaky = np.zeros(n)
    peaky[[17_003, 17_004, 39_998]] = [5.0, -6.0, 7.0]
    kept = thinned(n, (peaky, np.full(n, np.nan)))
    assert len(kept) <= STRETCHES * 3 + 2
    assert {0, 17_003, 17_004, 39_998, n - 1} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)


def test_events_in_the_order_of_time() -> None:
    log = log_of(positions(), flown=FLOWN)
    log = replace(log, reached=((START_UTC_S + 0.5, 2),), commands=(CommandRecord(START_UTC_S + 0.2, "Ann", "arm"),))
    found = reviewed(log, dsm=PLAIN).events
    assert [event.t_s for event in found] == sorted(event.t_s for event in found)
    assert {event.kind for event in found} == {"mode", "arm", "item", "text", "command"}
    warning = next(event for event in found if event.kind == "text")
    assert (warning.text, warning.severity) == ("Wind is strong", 4)


def test_alerts_are_among_the_events_where_they_begin_and_where_they_end() -> None:
    begins = ObstacleAlert("a", "radar", "obstacle", "begins", 1.0, START_UTC_S + 0.3, 1.1, "A crane, 8 m ahead")
    ends = replace(begins, phase="ends", t_utc_s=START_UTC_S + 0.6)
    found = reviewed(replace(log_of(positions(), flown=FLOWN), alerts=(begins, ends)), dsm=PLAIN).events
    alerts = [(event.text, event.severity) for event in found if event.kind == "alert"]
    assert alerts == [("A crane, 8 m ahead", 4), ("Over: A crane, 8 m ahead", 6)]


def test_a_recorded_plan_brings_its_mission_profile_and_certificate() -> None:
    log = with_plan(log_of(positions()), certificate=json.dumps({"min_distance_m": 11.9}))
    doc = reviewed(log, dsm=PLAIN)
    assert doc.plan_name == "Orchard"
    assert doc.figures is not None
    assert doc.figures.certified_distance_m == 11.9
    assert doc.figures.predicted_s == pytest.approx(54, abs=3)
    assert doc.notes == ["The vehicle did not say what it reached: waypoints count where the track is nearest to them."]
    other = reviewed(with_plan(log_of(positions()), sha256="b" * 64), dsm=PLAIN)
    assert "another surface model, one with SHA-256" in other.other_surface
    assert '"Hill" (SHA-256' in other.other_surface
    assert other.notes[0] == other.other_surface
    assert figure_lines(other)[0] == summary(other)["other_surface"] == other.other_surface
    own = reviewed(with_plan(log_of(positions())), dsm=PLAIN)
    assert (own.other_surface, summary(own)["other_surface"]) == ("", None)


def test_a_broken_certificate_and_plan_do_not_stop_the_review() -> None:
    log = with_plan(log_of(positions(), flown=FLOWN), certificate="{")
    assert log.plan is not None
    assert figures(log, dsm=PLAIN).certified_distance_m is None
    broken = replace(log, mission=FLOWN, plan=replace(log.plan, mission_wpl="rubbish", profile_toml="=", name="x"))
    doc = reviewed(broken, dsm=PLAIN)
    assert doc.figures is not None
    assert any("cannot be read" in note for note in doc.notes)


def test_another_mission_can_be_chosen() -> None:
    beside = mission([(x, y + 2.0, z) for x, y, z in ROUTE])
    assert figures(log_of(positions(), flown=FLOWN), dsm=PLAIN, mission=beside).cross_track_p95_m == pytest.approx(
        2.0, abs=0.02
    )


def test_a_flight_that_broke_off() -> None:
    places = positions()[:110]
    log = log_of(places, flown=FLOWN)
    log = replace(log, modes=((START_UTC_S, "AUTO"), (START_UTC_S + 20.0, "RTL")))
    doc = reviewed(log, dsm=PLAIN)
    assert doc.figures is not None
    assert not doc.figures.completed
    assert doc.last_waypoint_t_s is None
    assert doc.figures.duration_s == pytest.approx(10.0, abs=0.5)
    assert any("not reached" in note for note in doc.notes)


def test_waypoints_of_another_mission_are_not_used() -> None:
    log = replace(log_of(positions(), flown=FLOWN), reached=((START_UTC_S + 1.0, 3), (START_UTC_S + 2.0, 4)))
    doc = reviewed(log, dsm=PLAIN)
    assert any("another mission" in note for note in doc.notes)
    assert doc.figures is not None
    assert doc.figures.completed


def test_waypoints_handed_over_one_at_a_time() -> None:
    sent = degrees([(x, y) for x, y, _ in ROUTE[:2]])
    targets = tuple(
        SentTarget(START_UTC_S + 10.0 + k, float(lat), float(lon), 20.0, 6) for k, (lat, lon) in enumerate(sent)
    )
    log = replace(
        log_of([p for p in positions() if p[0] <= 154.0 and p[2] <= 20.0][:200], flown=FLOWN),
        targets=targets,
        modes=((START_UTC_S, "GUIDED"), (START_UTC_S + 36.0, "RTL")),
    )
    doc = reviewed(log, dsm=PLAIN)
    assert doc.figures is not None
    assert not doc.figures.completed
    assert doc.figures.cross_track_max_m == pytest.approx(4.0, abs=0.9)  # on past the last one
    assert any("up to item 3 of 5" in note for note in doc.notes)


def test_truth_that_nobody_recorded() -> None:
    doc = reviewed(log_of(positions(), flown=FLOWN), dsm=PLAIN, truth=True)
    assert any("no true positions" in note for note in doc.notes)
    assert doc.figures is not None


def test_a_log_without_a_position() -> None:
    doc = reviewed(log_of([], flown=FLOWN), dsm=PLAIN)
    assert doc.figures is None
    assert doc.series.t_s == []
    assert any("no position" in note for note in doc.notes)


def test_a_flight_elsewhere_than_its_mission() -> None:
    far = replace(FLOWN, home=Home(48.0, 10.0, 100.0))
    away = tuple(replace(item, lat_deg=item.lat_deg + 5.0) if item.lat_deg else item for item in far.items)
    doc = reviewed(log_of(positions(), flown=replace(far, items=away)), dsm=PLAIN)
    assert doc.figures is None
    assert doc.notes


def test_a_recording_outside_the_library(tmp_path) -> None:
    path = tmp_path / "made.mcap"
    path.write_bytes(b"1234")
    doc = recording_of(with_plan(log_of(positions())), path)
    assert (doc.id, doc.bytes, doc.vehicle, doc.plan_name) == ("made.mcap", 4, "ardupilot", "Orchard")
    assert doc.started_utc == "2027-01-15T08:00:00.000Z"
    assert plain().sha256 == PLAIN.sha256


def test_a_simulation_that_ran_ten_times_as_fast() -> None:
    log = log_of(positions(), flown=FLOWN, rate_hz=50.0)
    speed = np.full(len(log.track), 4.0)
    along = np.isin(np.arange(len(log.track)), np.flatnonzero(np.abs(np.diff(log.track.lon_deg, prepend=0)) > 1e-6))
    log = replace(log, track=replace(log.track, v_north_m_s=0.0 * speed, v_east_m_s=np.where(along, speed, 0.0)))
    doc = reviewed(log, dsm=PLAIN)
    assert doc.figures is not None
    assert doc.figures.duration_s == pytest.approx(50.0, abs=0.5)
    assert doc.first_waypoint_t_s == pytest.approx(1.0, abs=0.1)  # of the recording, as all curves are
    assert any("ran 10 times as fast" in note for note in doc.notes)


LOW = 13.0
"""Metres above home of a flight that was planned at 20 m, 8 m of tower below: 5 m are left."""


def low_flight(required_m: float, *, following_m: float | None = None, sink_to_m: float = LOW) -> FlightLog:
    """The flight that sinks over the tower, and what its recorded certificate demanded."""
    certificate: dict[str, object] = {"min_distance_m": 12.0, "required_clearance_m": required_m}
    if following_m is not None:
        certificate["tube"] = {"radius_m": following_m}
    low = [(x, y, sink_to_m) if z == 20.0 and 190.0 < x < 210.0 else (x, y, z) for x, y, z in positions()]
    return with_plan(log_of(low), certificate=json.dumps(certificate))


def test_a_flight_below_its_required_clearance_says_so_first() -> None:
    doc = reviewed(low_flight(6.5), dsm=PLAIN)
    assert doc.figures is not None
    assert doc.figures.required_distance_m == 6.5
    assert doc.figures.below_required == doc.notes[0]
    assert "came within 4.99 m" in doc.notes[0] or "came within 5.00 m" in doc.notes[0]
    assert "on the mission, 6.50 m were required, 1.5" in doc.notes[0]
    assert "following" not in doc.notes[0]


@pytest.mark.parametrize(
    ("following_m", "words"), [(2.0, "It stayed within the 2.00 m"), (1.0, "more than the 1.00 m")]
)
def test_it_says_whether_the_flight_left_the_tube(following_m: float, words: str) -> None:
    below = figures(low_flight(6.5, following_m=following_m), dsm=PLAIN).below_required
    assert below is not None
    assert words in below


def test_a_flight_that_kept_its_clearance_is_not_accused() -> None:
    kept = figures(low_flight(4.9), dsm=PLAIN)
    assert (kept.required_distance_m, kept.below_required) == (4.9, None)
    unknown = figures(log_of(positions(), flown=FLOWN), dsm=PLAIN)
    assert (unknown.required_distance_m, unknown.below_required) == (None, None)


def test_the_way_home_is_judged_too() -> None:
    log = low_flight(6.5, sink_to_m=20.0)
    back = [(x, y, 14.0) if k > 160 and z == 30.0 else (x, y, z) for k, (x, y, z) in enumerate(positions())]
    assert log.plan is not None
    flown = replace(log_of(back), plan=log.plan, mission=None)
    below = figures(flown, dsm=PLAIN).below_required
    assert below is not None
    assert "on the way home, 6.50 m were required" in below


def test_landing_elsewhere_is_no_lack_of_clearance() -> None:
    """The way home never came home: the vehicle was landed on the ground where it was."""
    log = low_flight(6.5, sink_to_m=20.0)
    along = [place for place in positions() if place[2] <= 20.0][: 50 + 251]
    down = [(250.0, 150.0, float(z)) for z in np.arange(20.0, 0.0, -0.4)]
    assert figures(replace(log_of([*along, *down]), plan=log.plan), dsm=PLAIN).below_required is None


def test_the_missions_own_file_tells_what_was_required() -> None:
    planned = replace(FLOWN, planned_for=PlannedFor(load_profile("mapper-rtk"), required_clearance_m=15.0))
    found = figures(log_of(positions(), flown=planned), dsm=PLAIN)
    assert found.required_distance_m == 15.0
    assert found.below_required is not None
    # Of a model that tells its error more is required.
    planned = replace(FLOWN, planned_for=PlannedFor(load_profile("mapper-rtk")))
    own, told = (figures(log_of(positions(), flown=planned), dsm=dsm) for dsm in (PLAIN, replace(PLAIN, rms_m=0.4)))
    assert own.required_distance_m is not None
    assert told.required_distance_m == pytest.approx(own.required_distance_m + 3 * (0.4 - 0.023))
