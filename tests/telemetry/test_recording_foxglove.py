"""Standard messages: what a viewer shows is where the vehicle was and how it lay in the air."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod
from scipy.spatial.transform import Rotation

from telemetry.recording.mcap_files.foxglove import (
    Standards,
    east_north_up_m,
    enu_from_body_quaternion,
    standard_schema,
)
from telemetry.topics.messages import VehicleText
from tests.telemetry.recordings import HOME, STATE, state_at

ANGLES = st.floats(-math.pi, math.pi)
NED_TO_ENU = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FLU_TO_FRD = np.diag([1, -1, -1])


@given(ANGLES, st.floats(-1.5, 1.5), st.floats(0, math.tau))
def test_the_attitude_is_the_autopilots(roll: float, pitch: float, heading: float) -> None:
    """Against the aeronautical convention: yaw, pitch, roll turn forward-right-down into north-east-down."""
    R_ned_frd = Rotation.from_euler("ZYX", [heading, pitch, roll]).as_matrix()
    R_enu_flu = Rotation.from_quat(enu_from_body_quaternion(roll, pitch, heading)).as_matrix()
    np.testing.assert_allclose(R_enu_flu, NED_TO_ENU @ R_ned_frd @ FLU_TO_FRD, atol=1e-9)


@given(st.floats(-0.01, 0.01), st.floats(-0.01, 0.01))
def test_the_offset_from_home_is_right_to_half_a_percent(north_deg: float, east_deg: float) -> None:
    state = replace(state_at(0), lat_deg=HOME[0] + north_deg, lon_deg=HOME[1] + east_deg)
    offset = east_north_up_m(state)
    assert offset is not None
    distance_m = Geod(ellps="WGS84").inv(HOME[1], HOME[0], state.lon_deg, state.lat_deg)[2]
    assert math.hypot(*offset[:2]) == pytest.approx(distance_m, rel=0.005, abs=0.01)
    assert offset[2] == 10.0
    assert offset[0] * east_deg >= 0
    assert offset[1] * north_deg >= 0


def test_a_position_is_written_once() -> None:
    standards = Standards()
    first, again, turned = state_at(1.0), state_at(1.0), replace(state_at(1.0), attitude_t_mono_s=999.0)
    assert [s.schema_name for s in standards.of(first)] == ["foxglove.LocationFix", "foxglove.FrameTransform"]
    assert list(standards.of(again)) == []
    assert [s.schema_name for s in standards.of(turned)] == ["foxglove.FrameTransform"]


def test_a_vehicle_without_position_or_home_is_not_placed_anywhere() -> None:
    assert list(Standards().of(STATE)) == []
    homeless = replace(state_at(1.0), home_lat_deg=None, home_lon_deg=None)
    assert [s.schema_name for s in Standards().of(homeless)] == ["foxglove.LocationFix"]


@pytest.mark.parametrize(("severity", "level"), [(0, 5), (3, 4), (4, 3), (6, 2), (7, 1), (9, 0), (-1, 0)])
def test_texts_become_log_entries(severity: int, level: int) -> None:
    (log,) = Standards().of(VehicleText(12.25, severity, "Low battery"))
    content = json.loads(log.data)
    assert (content["level"], content["message"]) == (level, "Low battery")
    assert content["timestamp"] == {"sec": 12, "nsec": 250_000_000}


def test_messages_hold_the_fields_of_their_schemas() -> None:
    standards = [*Standards().of(state_at(3.0)), *Standards().of(VehicleText(1.0, 6, "hi"))]
    assert len({standard.topic for standard in standards}) == 3
    for standard in standards:
        schema = json.loads(standard_schema(standard.schema_name))
        assert schema["title"] == standard.schema_name
        assert json.loads(standard.data).keys() == schema["properties"].keys()
