"""The one place where a vehicle's terms of the required clearance are computed."""

from __future__ import annotations

from planning.basics.plan_model import VehicleProfile
from planning.margins.budget import ClearanceBudget, Term
from planning.margins.downwash import felt_below_m, induced_speed_m_s
from planning.margins.following_error import Way, following_error_m, following_source
from planning.terrain import BOUND_RMS

BY_HAND = "set by hand"


def budget_of(profile: VehicleProfile, way: Way = "auto") -> ClearanceBudget:
    """Every term of a vehicle that is flown this way at its profile's top speed."""
    return ClearanceBudget(
        (
            Term("vehicle_radius", profile.radius_m, "vehicle profile: half the largest extent, rotors included"),
            Term("position_error", profile.position_error_m, "vehicle profile: 2.5 m standalone GNSS, 0.1 m RTK"),
            _following(profile, way),
            Term(
                "dsm_accuracy",
                BOUND_RMS * profile.dsm_rms_m,
                f"{BOUND_RMS:g} x RMS error of {profile.dsm_rms_m:g} m (0.023 m: Melita 2020, section 6.1)",
            ),
            _downwash(profile),
        )
    )


def _following(profile: VehicleProfile, way: Way) -> Term:
    if profile.following_m is not None:
        return Term("following", profile.following_m, BY_HAND)
    speed_m_s = profile.max_speed_m_s
    value_m = following_error_m(profile.firmware, way, speed_m_s)
    return Term("following", value_m, following_source(profile.firmware, way, speed_m_s))


def _downwash(profile: VehicleProfile) -> Term:
    if profile.downwash_m is not None:
        return Term("downwash", profile.downwash_m, BY_HAND)
    rotors, diameter_m = profile.rotors, profile.rotor_diameter_m
    induced_m_s = induced_speed_m_s(mass_kg=profile.mass_kg, rotors=rotors, rotor_diameter_m=diameter_m)
    value_m = felt_below_m(induced_m_s=induced_m_s, rotors=rotors, rotor_diameter_m=diameter_m)
    source = (
        f"momentum theory: {rotors} rotors of {diameter_m:g} m carry {profile.mass_kg:g} kg and blow"
        f" {induced_m_s:.1f} m/s (Melita 2020, fig. 8)"
    )
    return Term("downwash", value_m, source)
