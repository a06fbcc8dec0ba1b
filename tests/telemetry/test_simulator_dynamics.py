"""Motion of the simulated multirotor."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2, Airframe, Demand, Multirotor

STEP_S = 0.005
STILL = (0.0, 0.0, 0.0)
accelerations = st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(-30, 30))


def flown(demand: Demand | None, seconds: float, wind: tuple[float, float, float] = STILL) -> Multirotor:
    body = Multirotor(Airframe())
    for _ in range(round(seconds / STEP_S)):
        body.step(demand, wind, STEP_S)
    return body


def test_hovers_where_nothing_is_asked() -> None:
    body = flown(Demand(STILL, 0.0), 10)
    assert np.hypot(*body.p_neu[:2]) == 0
    assert abs(body.v_neu[2]) < 0.05


def test_falls_with_its_motors_off() -> None:
    body = flown(None, 1)
    assert -GRAVITY_M_S2 < body.v_neu[2] < -0.8 * GRAVITY_M_S2


def test_leans_into_the_acceleration_and_the_nose_goes_down_forward() -> None:
    body = flown(Demand((2.0, 0.0, 0.0), 0.0), 1)
    roll, pitch, _ = body.attitude_rad
    assert pitch == pytest.approx(-math.atan2(2.0, GRAVITY_M_S2), abs=0.01)
    assert abs(roll) < 1e-6
    sideways = flown(Demand((0.0, 2.0, 0.0), 0.0), 1)
    assert sideways.attitude_rad[0] > 0.15


def test_wind_carries_it_away_until_it_moves_with_the_air() -> None:
    assert flown(Demand(STILL, 0.0), 60, (0.0, 5.0, 0.0)).v_neu[1] == pytest.approx(5.0, abs=0.05)


@settings(deadline=None, max_examples=30)
@given(accelerations, st.floats(-10, 10))
def test_never_exceeds_what_the_airframe_can_do(accel: tuple[float, float, float], heading: float) -> None:
    airframe = Airframe()
    body = Multirotor(airframe)
    for _ in range(400):
        body.step(Demand(accel, heading), STILL, STEP_S)
        # The attitude loop is critically damped: it does not overshoot what was asked.
        assert math.hypot(*body.lean) <= GRAVITY_M_S2 * math.tan(airframe.max_tilt_rad) * 1.001
        assert abs(body.yaw_rate_rad_s) <= airframe.max_yaw_rate_rad_s * 1.001
        assert -GRAVITY_M_S2 * 1.5 < body.accel_neu[2] < airframe.max_thrust_m_s2
        assert 0 <= body.heading_rad <= 2 * math.pi


def test_turns_the_short_way() -> None:
    body = flown(Demand(STILL, math.radians(350)), 1)
    assert 180 < math.degrees(body.heading_rad) < 360
    assert flown(Demand(STILL, math.radians(350)), 10).heading_rad == pytest.approx(math.radians(350), abs=0.01)
