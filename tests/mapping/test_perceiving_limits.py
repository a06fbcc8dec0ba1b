"""Settings that do not fit are refused before anything is made; the counts are those of what would be made."""

import math

import numpy as np
import pytest

from mapping.errors import CapacityError, ParameterError
from mapping.perceiving.corridor import tube_points
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.perception import LONGEST_CORRIDOR_M
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.settings_limits import check_settings, corridor_points

LONGEST = np.array([[0.0, 0.0, 0.0], [0.0, LONGEST_CORRIDOR_M, 0.0]])


@pytest.mark.parametrize("radius_m", [0.5, 0.8, 1.5])
@pytest.mark.parametrize("resolution_m", [0.5, 1.0])
@pytest.mark.parametrize("reach_down", [0.0, RadarPerception.reach_down(Settings())])
def test_the_corridor_is_never_larger_than_counted(radius_m: float, resolution_m: float, reach_down: float) -> None:
    made = len(tube_points(LONGEST, radius_m=radius_m, step_m=resolution_m / 2, reach_down=reach_down))
    assert made <= corridor_points(radius_m, resolution_m, reach_down) <= 3 * made


def test_a_corridor_too_fine_is_refused_and_what_is_advised_is_not() -> None:
    with pytest.raises(CapacityError, match="A corridor 120 m long") as caught:
        check_settings(Settings(resolution_m=0.1), reach_m=None, reach_down=0.0)
    advised_m = float(caught.value.advice.split()[1])
    assert 0.1 < advised_m < 0.3
    check_settings(Settings(resolution_m=advised_m), reach_m=None, reach_down=0.0)


def test_memory_and_region_are_checked_as_the_map_checks_them() -> None:
    with pytest.raises(CapacityError, match="One look out to 40 m"):
        check_settings(Settings(resolution_m=0.05), reach_m=40.0, reach_down=0.0)
    with pytest.raises(CapacityError, match="A region 120 m deep"):
        check_settings(Settings(depth_m=120.0, fov_rad=3.0, height_m=100.0), reach_m=None, reach_down=0.0)


@pytest.mark.parametrize(
    ("low_deg", "high_deg", "azimuth_deg", "words"),
    [
        (0, 4, 45, "from 0 to 4 degrees"),
        (3, 20, 45, "does not see what stands"),
        (0, 90, 45, "0 to 90"),
        (0, 20, 0, "0 degrees wide"),
    ],
)
def test_a_gate_that_lets_nothing_through_is_refused(
    low_deg: float, high_deg: float, azimuth_deg: float, words: str
) -> None:
    gate = Settings(
        gate_low_rad=math.radians(low_deg),
        gate_high_rad=math.radians(high_deg),
        gate_azimuth_rad=math.radians(azimuth_deg),
    )
    with pytest.raises(ParameterError, match=words):
        check_settings(gate, reach_m=None, reach_down=0.0)
