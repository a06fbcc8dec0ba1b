"""Radar frames in, tracks and approach alerts out."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapping.perceiving.ground import ground_grid
from planning.missions.vehicle_profile import dump_profile, load_profile
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.tracking.approach import FOLLOWED_AFRESH, LANDED
from telemetry.tracking.object_tracking import KEEP_S, MOST_TRACKS
from tests.telemetry import perception_flights as flights
from tests.telemetry.moving_flights import T0_MONO_S, Flight, Thing, frame, shows_nothing, straight

HEAD_ON = straight((0.0, 80.0), (0.0, -4.0))


def test_what_comes_head_on_is_followed_told_and_alerted_in_time() -> None:
    flight = Flight()
    told = flight.fly(0.0, 8.0, HEAD_ON)
    (track,) = told.status.tracks
    assert track.moving
    assert track.dangerous
    assert track.velocity_enu_m_s == pytest.approx((0.0, -4.0), abs=0.6)
    assert track.range_m == pytest.approx(80.0 - 7.0 * 7.9, abs=1.0)
    assert track.enu_m == pytest.approx((0.0, 80.0 - 4.0 * 7.9, flights.UP_M), abs=1.0)
    place = flights.FRAME.to_enu(track.lat_deg, track.lon_deg, flights.HOME[2])[0]
    assert place[:2] == pytest.approx(track.enu_m[:2], abs=0.05)
    assert track.updates > 60
    assert track.age_s == pytest.approx(7.9, abs=0.5)
    begin = next(alert for told in flight.told for alert in told.alerts)
    assert (begin.kind, begin.phase, begin.sensor) == ("approach", "begins", "radar")
    assert begin.text.startswith("Moving object ")
    assert 4.0 < 80.0 / 7.0 - (begin.t_mono_s - T0_MONO_S) <= 8.0
    assert told.status.state == "running"
    assert told.status.velocity_enu_m_s == pytest.approx((0.0, 3.0))
    assert told.status.cones[0].track_id == track.id
    assert told.status.cones[0].apex_enu_m_s == track.velocity_enu_m_s


def test_a_proposal_stands_while_it_is_needed_and_keeps_the_limits() -> None:
    flight = Flight()
    flight.following.on_plan(
        replace(flights.mission(), profile_toml=dump_profile(replace(load_profile("generic-quad"), max_speed_m_s=4.0)))
    )
    told = flight.fly(0.0, 7.0, HEAD_ON)
    proposal = told.status.proposal
    assert proposal is not None
    assert told.status.max_speed_m_s == 4.0
    assert math.hypot(*proposal.velocity_enu_m_s) <= 4.0 + 1e-6
    assert proposal.closest_m > told.status.safety_radius_m
    assert "m/s" in proposal.text
    away = flight.fly(7.0, 11.0, straight((30.0, 90.0), (0.0, -4.0)))
    assert away.status.proposal is None


def test_what_passes_beside_is_followed_and_not_alerted() -> None:
    flight = Flight()
    told = flight.fly(0.0, 8.0, straight((14.0, 80.0), (0.0, -4.0)))
    assert [track.moving for track in told.status.tracks] == [True]
    assert told.status.tracks[0].closest_m == pytest.approx(14.0, abs=2.5)
    assert not flight.alerts


def test_what_stands_still_is_never_said_to_move() -> None:
    things = [straight((east, 60.0 + abs(east)), (0.0, 0.0)) for east in range(-24, 25, 6)]
    flight = Flight()
    flight.fly(0.0, 12.0, *things)
    seen = [track for told in flight.told for track in told.status.tracks]
    assert len(seen) > 100
    assert not any(track.moving for track in seen)
    assert not flight.alerts


def test_what_crosses_at_right_angles_on_a_collision_course_is_alerted() -> None:
    """Its radial speed is that of what stands still, all the way: only its place tells."""
    flight = Flight()
    crossing = Thing(lambda t_s: (36.0 - 3.0 * t_s, 36.0))  # at every moment as far east as north of the vehicle
    flight.fly(0.0, 9.0, crossing)
    begins = [alert for told in flight.told for alert in told.alerts if alert.phase == "begins"]
    assert begins
    assert 12.0 - (begins[0].t_mono_s - T0_MONO_S) > 4.0


def test_an_approach_ends_once_when_it_turns_away() -> None:
    def turning(t_s: float) -> tuple[float, float]:
        return (0.0, 70.0 - 4.0 * t_s) if t_s < 6.0 else (5.0 * (t_s - 6.0), 46.0 + 4.0 * (t_s - 6.0))

    flight = Flight()
    flight.fly(0.0, 10.0, Thing(turning))
    assert flight.phases[0] == "begins"
    assert flight.phases[-1] == "ends"
    assert flight.phases.count("begins") == flight.phases.count("ends") == 1
    assert len({alert.id for told in flight.told for alert in told.alerts}) == 1
    times = [alert.t_mono_s for told in flight.told for alert in told.alerts if alert.phase != "ends"]
    assert min(np.diff(times)) > 0.9


def test_what_is_seen_to_turn_away_is_said_to_be_out_of_the_way() -> None:
    flight = Flight()
    flight.fly(0.0, 9.0, Thing(lambda t_s: (max(0.0, t_s - 4.0) ** 2, 80.0 - 4.0 * t_s)))
    assert (flight.phases[-1], flight.texts[-1]) == ("ends", "Moving object: not on a collision course any more")


def test_what_is_lost_from_sight_is_not_said_to_be_out_of_the_way() -> None:
    flight = Flight()
    flight.fly(0.0, 7.0, HEAD_ON)
    flight.fly(7.0, 10.0)
    assert flight.phases[-1] == "ends"
    assert flight.texts[-1] == "Moving object no longer in sight: look out, last 31 m ahead"


def test_an_approach_ends_with_the_landing_and_says_so() -> None:
    flight = Flight()
    flight.fly(0.0, 7.0, HEAD_ON)
    flight.fly(7.0, 7.2, HEAD_ON, landed="on_ground")
    assert (flight.phases[-1], flight.texts[-1]) == ("ends", LANDED)


def test_on_the_ground_nothing_alarms() -> None:
    flight = Flight()
    flight.fly(0.0, 8.0, HEAD_ON, landed="on_ground")
    assert any(told.status.tracks for told in flight.told)
    assert not flight.alerts


def test_a_new_flight_begins_afresh_with_ids_that_were_never_used() -> None:
    flight = Flight()
    first = flight.fly(0.0, 7.0, HEAD_ON).status.tracks[0].id
    flight.following.perceiver.on_state(flights.state_at(7.0, T0_MONO_S, 1_700_000_000.0, armed=False))
    assert flight.fly(7.05, 7.15, HEAD_ON).status.tracks == ()
    assert (flight.phases[-1], flight.texts[-1]) == ("ends", FOLLOWED_AFRESH)
    second = flight.fly(7.15, 9.0, HEAD_ON).status.tracks[0].id
    assert second > first


def test_without_frames_tracks_are_shown_for_a_moment_and_alerts_end() -> None:
    flight = Flight()
    flight.fly(0.0, 8.0, HEAD_ON)
    for after_s in (0.5, KEEP_S, 1.2, 2.5):
        flight.following.perceiver.on_state(flights.state_at(8.0 + after_s, T0_MONO_S, 1_700_000_000.0))
        flight.told.append(flight.following.tick(lambda after_s=after_s: T0_MONO_S + 8.0 + after_s))
    early, later, *_, last = [told.status for told in flight.told[-4:]]
    assert early.tracks
    assert later.state == "running"
    assert shows_nothing(later)
    assert last.state == "stale"
    assert shows_nothing(last)
    assert "Check the sensor" in last.text
    assert last.t_mono_s == pytest.approx(T0_MONO_S + 7.9)
    assert flight.phases[-1] == "ends"
    assert "no longer in sight" in flight.texts[-1]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"gnss_fix": "no_fix"}, "No GNSS position"),
        ({"v_east_m_s": None}, "own velocity is unknown"),
    ],
)
def test_without_its_own_position_or_velocity_nothing_is_followed(changes: dict[str, Any], why: str) -> None:
    status = Flight().fly(0.0, 3.0, HEAD_ON, **changes).status
    assert status.state == "frozen"
    assert why in status.text
    assert status.tracks == ()


def test_a_thousand_objects_in_a_frame_are_bounded() -> None:
    random = np.random.default_rng(5)
    places = np.column_stack([random.uniform(-40, 40, 1000), random.uniform(45, 110, 1000)]).tolist()
    things = [straight((e, n), (random.uniform(-5, 5), -3.0), snr_db=60.0) for e, n in places]
    status = Flight().fly(0.0, 1.5, *things).status
    assert status.state == "running"
    assert status.detections <= 150
    assert len(status.tracks) <= MOST_TRACKS
    assert len(status.tracks) + status.hidden <= 400
    assert len(status.cones) <= 8
    assert [track.range_m for track in status.tracks] == sorted(track.range_m for track in status.tracks)


def test_garbage_is_counted_and_the_rest_goes_on() -> None:
    flight = Flight()
    flight.fly(0.0, 4.0, HEAD_ON)
    good = frame(4.0, 0, [HEAD_ON])
    for made in (
        replace(good, number=901, snr_db=os.urandom(7)),
        replace(good, number=902, t_mono_s=math.nan),
        replace(good, number=903, t_mono_s=T0_MONO_S - 60.0),
        replace(good, number=904, t_mono_s=T0_MONO_S + 3.96, xyz_m=np.full(3, np.nan, "<f4").tobytes()),
    ):
        flight.frame(4.0, made=made)
    dropped = {count.what: count.count for count in flight.told[-1].status.dropped}
    assert dropped["broken frame"] == 1
    assert dropped["time not finite"] == 1
    assert dropped["too late"] == 1
    assert dropped["points: not finite"] == 1
    flight.number = 904
    assert flight.fly(4.05, 6.0, HEAD_ON).status.tracks[0].moving


def test_settings_count_at_once() -> None:
    flight = Flight()
    flight.following.perceiver.on_settings(PerceptionSettings(safety_radius_m=16.0))
    told = flight.fly(0.0, 8.0, straight((14.0, 80.0), (0.0, -4.0)))
    assert told.status.safety_radius_m == 16.0
    assert "begins" in flight.phases


def test_close_to_known_ground_nothing_is_followed() -> None:
    flight = Flight()
    flight.fly(0.0, 0.2)
    ground = ground_grid(np.full((400, 400), flights.UP_M - 1.0, np.float32), [[0.0, -1.0, 200.0], [1.0, 0.0, 200.0]])
    flight.following.perceiver.set_ground(ground)
    assert flight.fly(0.2, 4.0, HEAD_ON).status.tracks == ()
