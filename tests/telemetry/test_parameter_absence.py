"""Absent parameters of a silent vehicle: told soon over a good link, never wrongly over a bad one."""

from __future__ import annotations

import statistics
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import TransferError
from telemetry.mavlink.parameters.reading import LONGEST_S, LinkEvidence, ParameterRead
from tests.telemetry.lossy import VEHICLE, Faults, Run
from tests.telemetry.parameter_vehicles import KEPT_REQUESTS, ArduPilotParameters, Px4Parameters, ardupilot_table, table

PRESENT = ("P0000", "P0007", "P0011", "P0015")
ABSENT = ("RTL_ALT_M", "WP_SPD")


class SilentPx4(Px4Parameters):
    """As PX4 before PARAM_ERROR."""

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        return [m for m in super().on_message(message, now_s) if m.get_type() != "PARAM_ERROR"]


def read(vehicle: ArduPilotParameters, names: tuple[str, ...], faults: Faults = Faults(), seed: int = 0) -> Run:  # noqa: B008
    machine = ParameterRead(names, target=VEHICLE, bytewise=isinstance(vehicle, Px4Parameters))
    return Run(machine, vehicle, faults, seed=seed).until_end()


def mean_over_all_losses(evidence: LinkEvidence, questions: int) -> float:
    """By sums over 200,000 shares."""
    lost = (np.arange(200_000) + 0.5) / 200_000
    weight = lost**evidence.missed * (1 - lost) ** evidence.answered
    return float(np.sum(weight * lost**questions) / np.sum(weight))


@given(st.integers(0, 40), st.integers(0, 40), st.integers(0, 40))
def test_the_chance_is_the_mean_over_all_shares_of_loss(answered: int, missed: int, questions: int) -> None:
    evidence = LinkEvidence(answered, missed)
    assert evidence.chance_of_silence(questions) == pytest.approx(
        mean_over_all_losses(evidence, questions), rel=1e-4, abs=1e-12
    )


def test_over_a_link_that_loses_a_third_nothing_present_is_called_absent_in_1000_runs() -> None:
    """In each direction, with frames out of order and twice."""
    took_s = list[float]()
    for seed in range(1000):
        make = ArduPilotParameters if seed % 2 else SilentPx4
        vehicle = make(ardupilot_table(16))
        run = read(vehicle, PRESENT + ABSENT, Faults(loss=0.3, reordering=0.1, duplicates=0.05), seed)
        values = run.result
        assert [name for name in PRESENT if values[name] is None] == [], seed
        assert [name for name in ABSENT if values[name] is not None] == [], seed
        took_s.append(run.now_s)
    assert statistics.median(took_s) < 6.0


@pytest.mark.parametrize("make", [ArduPilotParameters, SilentPx4])
def test_over_a_good_link_absence_is_known_within_two_seconds(make: type[ArduPilotParameters]) -> None:
    together = read(make(ardupilot_table(200)), PRESENT + ABSENT)
    alone = read(make(ardupilot_table(200)), ABSENT[:1])
    assert [together.result[name] for name in ABSENT] == [None, None]
    assert alone.result == {ABSENT[0]: None}
    assert together.now_s < 1.5
    assert alone.now_s < 2.0


def test_what_the_vehicle_has_costs_no_question_more() -> None:
    run = read(ArduPilotParameters(ardupilot_table(200)), PRESENT)
    assert sum(direction == "up" for _, direction, _ in run.log) == len(PRESENT)


def test_more_names_than_an_autopilot_keeps_questions_are_all_read() -> None:
    vehicle = ArduPilotParameters(ardupilot_table(200))
    names = tuple(vehicle.table)[: 3 * KEPT_REQUESTS]
    run = read(vehicle, (*names, *ABSENT))
    assert vehicle.dropped == 0
    assert {name for name, value in run.result.items() if value is None} == set(ABSENT)


def test_a_vehicle_that_says_so_is_asked_once() -> None:
    run = read(Px4Parameters(table(20)), ABSENT)
    assert run.result == dict.fromkeys(ABSENT)
    assert sum(direction == "up" for _, direction, _ in run.log) == len(ABSENT)


def test_where_nearly_all_is_lost_nothing_is_called_absent() -> None:
    """One message in six comes through to us: that is an error, and no guess."""
    random = Random(1)
    machine = ParameterRead(ABSENT, target=VEHICLE, bytewise=False)
    vehicle = ArduPilotParameters(ardupilot_table(20))
    run = Run(machine, vehicle, lose=lambda way, *_: way == "down" and random.random() < 5 / 6)
    assert isinstance(run.until_end().error, TransferError)
    assert "Too much is lost to tell whether the vehicle has RTL_ALT_M, WP_SPD" in run.error.what
    assert run.now_s < LONGEST_S + 2.0
