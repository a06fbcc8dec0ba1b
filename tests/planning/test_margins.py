"""The terms of the required clearance: what each comes to, how they add, and what a smaller one leaves out."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.basics.plan_model import VehicleProfile
from planning.margins.budget import TERM_NAMES, ClearanceBudget, Term
from planning.margins.downwash import far_wake, felt_below_m, induced_speed_m_s
from planning.margins.following_error import FIRMWARE_NAMES, MEASURED, WAY_NAMES, Firmware, Way, following_error_m
from planning.margins.words import budget_json, tube_words, uncovered_words
from planning.missions.vehicle_profile import load_profile
from planning.missions.vehicle_terms import budget_of

PAPER = load_profile("f450-paper")
QUAD = VehicleProfile("quad")
LENGTHS = st.floats(0.0, 10.0)


def budget(*values_m: float) -> ClearanceBudget:
    return ClearanceBudget(tuple(Term(code, v, "test") for code, v in zip(TERM_NAMES, values_m, strict=True)))


def test_the_papers_rotor_blows_5_m_s_and_is_not_felt_half_a_metre_below() -> None:
    # Melita 2020, section 6.1 and fig. 8: rotor 0.24 m, induced velocity 5 m/s, the wake vanishes 0.5 m below.
    induced = induced_speed_m_s(mass_kg=PAPER.mass_kg, rotors=PAPER.rotors, rotor_diameter_m=PAPER.rotor_diameter_m)
    assert induced == pytest.approx(5.0, abs=0.005)
    assert felt_below_m(induced_m_s=5.0, rotors=4, rotor_diameter_m=0.24) == pytest.approx(0.5, abs=1e-9)
    assert budget_of(PAPER).value_m("downwash") == pytest.approx(0.5, abs=0.001)


def test_the_far_wake_keeps_momentum_and_flux() -> None:
    """Through half the area at twice the speed: the flux of the disc, and the thrust rho A v_i (2 v_i)."""
    mass_kg, diameter_m = 2.0, 0.254
    induced = induced_speed_m_s(mass_kg=mass_kg, rotors=4, rotor_diameter_m=diameter_m)
    speed, radius = far_wake(induced_m_s=induced, rotor_diameter_m=diameter_m)
    disc_m2, wake_m2 = math.pi * (diameter_m / 2) ** 2, math.pi * radius**2
    assert wake_m2 * speed == pytest.approx(disc_m2 * induced)
    assert 1.225 * disc_m2 * induced * speed == pytest.approx(mass_kg * 9.80665 / 4)


@given(st.floats(0.2, 20.0), st.floats(1.01, 3.0))
def test_a_heavier_vehicle_is_felt_farther_below(mass_kg: float, times: float) -> None:
    light, heavy = (replace(QUAD, mass_kg=mass_kg * k) for k in (1.0, times))
    # Induced velocity grows with the root of the thrust, the height with the root of that.
    assert budget_of(heavy).value_m("downwash") == pytest.approx(budget_of(light).value_m("downwash") * times**0.25)


@pytest.mark.fact("A4", "P9")
def test_following_is_what_was_measured_and_grows_beyond_it() -> None:
    assert set(MEASURED) == {(firmware, way) for firmware in FIRMWARE_NAMES for way in WAY_NAMES}
    for (firmware, way), row in MEASURED.items():
        assert following_error_m(firmware, way, row.speed_m_s / 2) == row.worst_m
        assert following_error_m(firmware, way, row.speed_m_s) == row.worst_m
        assert following_error_m(firmware, way, 2 * row.speed_m_s) == pytest.approx(4 * row.worst_m)
    # Measured on the real autopilots' code: 0.89 m below, 1.05 m beside; GUIDED 1.72 m; PX4 0.99 m and 1.12 m.
    least: dict[tuple[Firmware, Way], float] = {
        ("ardupilot", "auto"): 1.05,
        ("ardupilot", "guided"): 0.3,
        ("px4", "auto"): 0.99,
        ("px4", "guided"): 1.12,
    }
    assert all(MEASURED[key].worst_m >= worst_m for key, worst_m in least.items())


def test_every_term_can_be_set_and_says_where_it_comes_from() -> None:
    profile = replace(QUAD, following_m=0.4, downwash_m=0.2, dsm_rms_m=0.1, position_error_m=0.3, radius_m=0.6)
    found = {term.code: (term.value_m, term.source) for term in budget_of(profile).terms}
    assert {code: value for code, (value, _) in found.items()} == pytest.approx(
        {"vehicle_radius": 0.6, "position_error": 0.3, "following": 0.4, "dsm_accuracy": 0.3, "downwash": 0.2}
    )
    assert found["following"][1] == found["downwash"][1] == "set by hand"
    assert "3 x RMS error of 0.1 m" in found["dsm_accuracy"][1]
    measured = {term.code: term.source for term in budget_of(QUAD, "guided").terms}
    assert "ArduPilot in GUIDED" in measured["following"]
    assert "4 rotors of 0.254 m carry 2 kg" in measured["downwash"]


@given(st.tuples(*6 * [LENGTHS]), st.floats(0.0, 60.0))
def test_a_smaller_clearance_says_all_that_it_leaves_out(values_m: tuple[float, ...], required_m: float) -> None:
    terms = budget(*values_m)
    assert terms.total_m == pytest.approx(sum(values_m))
    missing_m = sum(part.missing_m for part in terms.uncovered_by(required_m))
    assert missing_m == pytest.approx(max(0.0, sum(values_m) - required_m), abs=1e-6)


def test_contact_comes_before_ground_effect() -> None:
    terms = budget(0.35, 0.1, 1.0, 0.07, 0.0, 0.5)
    assert [(part.code, pytest.approx(part.missing_m)) for part in terms.uncovered_by(1.3)] == [
        ("following", 0.15),
        ("dsm_accuracy", 0.07),
        ("downwash", 0.5),
    ]
    words = uncovered_words(terms, 1.3)
    assert words is not None
    assert "1.30 m was set by hand" in words
    assert "does not cover 0.15 m of following the line, 0.07 m of accuracy" in words
    assert uncovered_words(terms, terms.total_m) is None
    assert uncovered_words(terms, 9.0) is None
    assert uncovered_words(None, 0.1) is None


def test_words_and_json() -> None:
    terms = budget(0.35, 2.5, 1.1, 0.069, 0.0, 0.593)
    answer = budget_json(terms, 5.0)
    assert answer is not None
    assert (answer["set_by_hand"], answer["uncovered"]) == (True, [])
    assert answer["total_m"] == pytest.approx(4.612)
    assert "worse end" in answer["rule"]
    assert budget_json(None, 5.0) is None
    assert "everything within 1.10 m of the line" in tube_words(1.1, 5.0)
    assert "at least 3.90 m" in tube_words(1.1, 5.0)
    assert "is touched" in tube_words(1.1, 1.0)
    assert "line alone" in tube_words(0.0, 5.0)
