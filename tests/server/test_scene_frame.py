"""Between the model's coordinates and the scene's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.scene.geometry.scene_frame import LocalFrame

metres = st.floats(-1e5, 1e5)


@given(east=metres, north=metres, up=metres, times=st.floats(1, 5))
def test_there_and_back(east: float, north: float, up: float, times: float) -> None:
    frame = LocalFrame(500_000, 4_000_000, 120.0, times, 500.0)
    point = np.array([500_000 + east, 4_000_000 + north, 120 + up])
    assert np.allclose(frame.model_from_scene(frame.scene_from_model(point)), point, rtol=0, atol=1e-6)


def test_only_heights_are_exaggerated() -> None:
    frame = LocalFrame(500_000, 4_000_000, 120.0, 3.0, 500.0)
    assert frame.scene_from_model(np.array([500_010, 4_000_020, 130])).tolist() == [10, 20, 30]


@given(t=st.floats(0, 100))
def test_a_ray_keeps_its_lengths(t: float) -> None:
    frame = LocalFrame(500_000, 4_000_000, 120.0, 2.5, 500.0)
    origin, ray = np.array([3.0, -4.0, 50.0]), np.array([0.1, 0.2, -0.7])
    on_ray = frame.model_from_scene(origin) + t * frame.model_direction(ray)
    assert frame.scene_from_model(on_ray) == pytest.approx(origin + t * ray, abs=1e-6)
