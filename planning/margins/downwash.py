"""How far below its rotors a hovering multirotor still feels the ground, by momentum theory.

A rotor of disc area A that carries T blows v_i = sqrt(T / (2 rho A)) through its disc. Far below, the stream has
contracted to half the area and twice the speed (radius R / sqrt 2): its flux is still A v_i. The ground stops it,
as a mirror image would that blows the same flux up from 2 z below. Seen from the discs the image is a source of
the flux of all n rotors; at a disc it blows n A v_i / (4 pi (2 z)^2) = n v_i (R / 4 z)^2 back (Cheeseman and
Bennett 1955, for n = 1). Where that is less than ``TOLERATED_M_S``, the ground is not felt.

Melita 2020, fig. 8 puts that at 0.5 m for four rotors of 0.24 m with 5 m/s: ``TOLERATED_M_S`` is what this model
blows back there, so that it gives the paper's figure for the paper's vehicle, and scales it to others.
"""

from __future__ import annotations

import math

AIR_KG_M3 = 1.225
"""At sea level, 15 degrees; at 3000 m the result is 8 % larger."""
GRAVITY_M_S2 = 9.80665
TOLERATED_M_S = 4 * 5.0 * (0.12 / (4 * 0.5)) ** 2
"""0.072 m/s: 4 rotors, 5 m/s, radius 0.12 m, 0.5 m above the ground."""
CONTRACTION = math.sqrt(0.5)
"""Radius of the far wake over the disc's."""


def induced_speed_m_s(*, mass_kg: float, rotors: int, rotor_diameter_m: float, air_kg_m3: float = AIR_KG_M3) -> float:
    """v_i = sqrt(T / (2 rho A)) of each rotor in a hover."""
    thrust_n = mass_kg * GRAVITY_M_S2 / rotors
    return math.sqrt(thrust_n / (2 * air_kg_m3 * math.pi * (rotor_diameter_m / 2) ** 2))


def far_wake(*, induced_m_s: float, rotor_diameter_m: float) -> tuple[float, float]:
    """(speed, radius) of the stream far below: twice as fast through half the area."""
    return 2 * induced_m_s, CONTRACTION * rotor_diameter_m / 2


def felt_below_m(*, induced_m_s: float, rotors: int, rotor_diameter_m: float) -> float:
    """Height of the discs above ground below which what the ground blows back is more than is tolerated."""
    speed_m_s, radius_m = far_wake(induced_m_s=induced_m_s, rotor_diameter_m=rotor_diameter_m)
    flux_m3_s = rotors * math.pi * radius_m**2 * speed_m_s
    return 0.5 * math.sqrt(flux_m3_s / (4 * math.pi * TOLERATED_M_S))  # Melita 2020, fig. 8
