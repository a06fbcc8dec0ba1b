"""What perception takes from the vehicle's state."""

import pytest

from telemetry.perception.whereabouts import is_flying
from telemetry.topics.vehicle import Landed, VehicleState


@pytest.mark.parametrize(
    ("armed", "landed", "alt_rel_home_m", "flying"),
    [
        (True, "in_air", 0.2, True),
        (True, "taking_off", 4.0, False),
        (True, "landing", 4.0, False),
        (True, "on_ground", 4.0, False),
        (False, "in_air", 4.0, False),
        (True, None, 4.0, True),
        (True, None, 0.5, False),
        (True, None, None, False),
    ],
)
def test_alarms_begin_clear_of_the_ground(
    armed: bool, landed: Landed | None, alt_rel_home_m: float | None, flying: bool
) -> None:
    assert is_flying(VehicleState(1, 1, armed=armed, landed=landed, alt_rel_home_m=alt_rel_home_m)) is flying
