"""From samples to the alert of what comes near: another drone head-on over level ground, followed by its echoes."""

from __future__ import annotations

import math

import pytest

from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.sensors import radar_sensor
from telemetry.topics.vehicle import SimTruth
from tests.telemetry import perception_flights as flights
from tests.telemetry.moving_flights import T0_MONO_S, T0_UTC_S, Flight, heading_rad

START_M, SPEED_M_S, RADAR_HZ = 70.0, 4.0, 10
DRONE = {
    "type": "box",
    "path": {"points_m": [[0.0, START_M], [0.0, -100.0]], "speed_m_s": SPEED_M_S},
    "base_m": flights.UP_M,
    "size_m": [0.9, 0.9, 0.4],
    "material": "metal",
}


def truth(t_s: float) -> SimTruth:
    """Where the vehicle of ``perception_flights`` is, in the simulation's terms."""
    return SimTruth(
        t_mono_s=T0_MONO_S + t_s,
        t_utc_s=T0_UTC_S + t_s,
        t_sim_s=t_s,
        home_lat_deg=flights.HOME[0],
        home_lon_deg=flights.HOME[1],
        home_alt_amsl_m=flights.HOME[2],
        position_enu_m=(0.0, flights.SPEED_M_S * t_s, flights.UP_M),
        velocity_enu_m_s=(0.0, flights.SPEED_M_S, 0.0),
        roll_rad=0.0,
        pitch_rad=0.02 * math.sin(t_s),
        heading_rad=heading_rad(t_s),
        armed=True,
    )


def test_another_drone_is_followed_and_alerted_from_its_echoes() -> None:
    world = World.parse({"format": "hedgehop-world", "version": 1, "objects": [DRONE]}, frame=NeuFrame(*flights.HOME))
    radar = radar_sensor("iq", world, seed=0)
    flight = Flight()
    for k in range(round(7.0 * RADAR_HZ)):
        t_s = k / RADAR_HZ
        flight.following.perceiver.on_state(flights.state_at(t_s, T0_MONO_S, T0_UTC_S))
        flight.frame(t_s, made=radar.frame(truth(t_s)))
    moving = [track for track in flight.told[-1].status.tracks if track.moving]
    drone = min(moving, key=lambda track: abs(track.velocity_enu_m_s[1] + SPEED_M_S))
    assert drone.velocity_enu_m_s == pytest.approx((0.0, -SPEED_M_S), abs=1.0)
    assert drone.enu_m[1] == pytest.approx(START_M - SPEED_M_S * 6.9, abs=1.5)
    assert drone.dangerous
    begin = next(alert for told in flight.told for alert in told.alerts)
    assert (begin.kind, begin.phase, begin.sensor) == ("approach", "begins", "radar")
    assert START_M / (SPEED_M_S + flights.SPEED_M_S) - (begin.t_mono_s - T0_MONO_S) > 3.0
