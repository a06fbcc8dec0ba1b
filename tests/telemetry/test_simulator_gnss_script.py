"""Positions that fail by script, and attitudes that are a little off."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planning.errors import ParameterError
from telemetry.simulation.simulator.airframe.dynamics import AttitudeError
from telemetry.simulation.simulator.airframe.gnss_script import GnssEvent, has_fix, offset_neu, read_event
from tests.telemetry.simulator_bench import Bench


def test_events_are_read_from_words() -> None:
    assert read_event("loss:60:20") == GnssEvent("loss", 60.0, 20.0)
    glitch = read_event("glitch:60:5:100")
    assert (glitch.kind, glitch.start_s, glitch.duration_s) == ("glitch", 60.0, 5.0)
    assert glitch.offset_neu == pytest.approx((0.0, 100.0, 0.0), abs=1e-9)
    assert read_event("glitch:0:5:100:180").offset_neu == pytest.approx((-100.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(
    "text", ["", "loss", "loss:1", "loss:1:2:3", "glitch:1:2", "jam:1:2", "loss:a:b", "loss:nan:2", "loss:1:0"]
)
def test_what_is_no_event_is_refused(text: str) -> None:
    with pytest.raises(ParameterError, match="is no GNSS event"):
        read_event(text)


def test_events_hold_from_their_start_for_their_duration() -> None:
    script = (GnssEvent("loss", 10.0, 5.0), GnssEvent("glitch", 12.0, 2.0, (1.0, 2.0, 3.0)),
              GnssEvent("glitch", 13.0, 2.0, (10.0, 0.0, 0.0)))  # fmt: skip
    assert [has_fix(script, t) for t in (9.9, 10.0, 14.9, 15.0)] == [True, False, False, True]
    assert offset_neu(script, 11.0) == (0.0, 0.0, 0.0)
    assert offset_neu(script, 13.5) == (11.0, 2.0, 3.0)


def test_what_the_vehicle_reports_while_its_fix_is_lost_and_after() -> None:
    bench = Bench(gnss_script=(GnssEvent("loss", 4.0, 2.0),))
    bench.stream(24, 10)
    bench.stream(193, 10)
    bench.advance(8.0)
    heard = [(h.t_s, h.message) for h in bench.heard]
    fixes = [(t, m.fix_type, m.satellites_visible) for t, m in heard if m.get_type() == "GPS_RAW_INT" and t > 2]
    assert {(fix, seen) for t, fix, seen in fixes if 4.1 < t < 5.9} == {(1, 0)}
    assert {(fix, seen) for t, fix, seen in fixes if not 3.9 < t < 6.1} == {(6, 10)}
    flags = [(t, m.flags) for t, m in heard if m.get_type() == "EKF_STATUS_REPORT" and t > 2]
    assert {value & 16 for t, value in flags if 4.1 < t < 5.9} == {0}
    assert {value & 16 for t, value in flags if t > 6.1} == {16}


def test_a_glitch_is_reported_and_not_flown() -> None:
    bench = Bench(gnss_script=(GnssEvent("glitch", 4.0, 2.0, (0.0, 100.0, 0.0)),))
    bench.stream(33, 10)
    bench.advance(8.0)
    _, east_m = bench.vehicle.frame.metres_per_degree
    places = [(h.t_s, (h.message.lon / 1e7 - bench.vehicle.frame.lon_deg) * east_m) for h in bench.heard
              if h.message.get_type() == "GLOBAL_POSITION_INT" and h.t_s > 2]  # fmt: skip
    assert all(east == pytest.approx(100.0 if 4.0 <= t < 6.0 else 0.0, abs=0.05) for t, east in places)
    assert len([t for t, _ in places if 4.0 <= t < 6.0]) > 10
    assert bench.vehicle.estimated_neu == (0.0, 0.0, 0.0)


def test_attitude_errors_keep_to_the_table() -> None:
    drawn = [AttitudeError.drawn(np.random.default_rng(seed)) for seed in range(800)]
    heading = np.degrees([error.heading_rad for error in drawn])
    level = np.degrees([(error.roll_rad, error.pitch_rad) for error in drawn])
    assert np.abs(heading).max() <= 0.5
    assert heading.std() == pytest.approx(1.0 / math.sqrt(12), rel=0.1)
    assert level.std() == pytest.approx(0.2, rel=0.15)


def test_the_vehicle_reports_its_attitude_with_the_error_and_tells_sensors_the_truth() -> None:
    bench = Bench(gnss="rtk", seed=4)
    bench.advance(1.0)
    vehicle = bench.vehicle
    true = vehicle.truth.attitude_rad
    off = [math.remainder(a - b, 2 * math.pi) for a, b in zip(vehicle.attitude_rad, true, strict=True)]
    assert 0 < abs(off[2]) <= math.radians(0.5)
    bench.stream(30, 10)
    bench.advance(1.0)
    said = next(h.message for h in reversed(bench.heard) if h.message.get_type() == "ATTITUDE")
    assert said.roll - true[0] == pytest.approx(vehicle.attitude_error.roll_rad, abs=1e-6)
    told = vehicle.sim_truth(5.0, 6.0)
    assert (told.roll_rad, told.pitch_rad, told.heading_rad) == true
    assert (told.t_mono_s, told.t_utc_s, told.t_sim_s, told.armed) == (5.0, 6.0, vehicle.now_s, False)
    assert Bench().vehicle.attitude_error == AttitudeError()
