"""What the numbers of a plan may be; what they are when nobody says stands in ``plan_model``, each once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from planning.errors import ParameterError

LARGEST = 1e6
"""Metres, seconds or m/s beyond any flight: past it a number is a slip, and rounding would eat centimetres."""
LONGEST_LOITER_S = 3600.0
LARGEST_SEED = 10_000
"""Of whatever is simulated."""
FEWEST_ITEMS = 4
"""Take-off, two waypoints and the return."""


@dataclass(frozen=True, slots=True)
class Limit:
    """Of one number: from zero, or above it, to ``LARGEST``."""

    name: str
    """As errors call it."""
    unit: str
    zero: bool = False
    """Zero makes sense."""

    def check(self, value: float) -> None:
        """Raises ParameterError."""
        if (value >= 0 if self.zero else value > 0) and value <= LARGEST:
            return
        least = "zero or more" if self.zero else "above zero"
        raise ParameterError(
            f"{self.name} is {value:g} {self.unit}.", advice=f"It must be {least}, at most {LARGEST:,.0f}."
        )


PROFILE = {
    "radius_m": Limit("Vehicle radius", "m"),
    "endurance_s": Limit("Endurance", "s"),
    "rtl_height_m": Limit("RTL height", "m", zero=True),
    "position_error_m": Limit("Position error", "m", zero=True),
    "dsm_rms_m": Limit("Accuracy of the surface model", "m", zero=True),
    "following_m": Limit("Following error", "m", zero=True),
    "downwash_m": Limit("Rotor downwash", "m", zero=True),
    "mass_kg": Limit("Mass", "kg"),
    "rotor_diameter_m": Limit("Rotor diameter", "m"),
    "rotors": Limit("Number of rotors", ""),
}
"""By the names of ``VehicleProfile``'s fields; of those below by those of their parameters'."""
SURFACE = {
    "radius_m": Limit("Radius R", "m"),
    "height_m": Limit("Height H", "m"),
    "smooth_sigma_m": Limit("Smoothing", "m", zero=True),
    "fill_hole_area_m2": Limit("Largest hole to fill", "m2", zero=True),
}
PATH = {
    "mean_speed_m_s": Limit("Mean speed", "m/s"),
    "max_speed_m_s": Limit("Maximum speed", "m/s"),
    "max_climb_m_s": Limit("Climb limit", "m/s"),
    "max_descent_m_s": Limit("Descent limit", "m/s"),
    "max_accel_m_s2": Limit("Acceleration limit", "m/s2"),
    "step_m": Limit("Sampling step", "m"),
}
MISSION = {"excess_height_m": Limit("Excess height", "m", zero=True)}
DEMANDS = {
    "required_clearance_m": Limit("Required clearance", "m"),
    "max_height_above_ground_m": Limit("Maximum height above ground", "m"),
}


def check(params: object, limits: Mapping[str, Limit]) -> None:
    """Raises ParameterError, naming the first field that no flight can have; None is no number."""
    for key, limit in limits.items():
        value = getattr(params, key)
        if value is not None:
            limit.check(value)


def speeds_agree(mean_m_s: float, max_m_s: float) -> bool:
    """Whether the timing law can reach the mean without passing the maximum."""
    return mean_m_s < max_m_s <= 2 * mean_m_s
