"""The scenario of the reflector from its samples on, with few places and phases."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planning.errors import ParameterError
from telemetry.simulation.scenarios.catalogue import NAMES
from telemetry.simulation.scenarios.radar import iq_reflector
from telemetry.simulation.scenarios.radar.iq_reflector import SENSORS, measure, resolved
from telemetry.simulation.scenarios.stage.result import ScenarioRequest, ScenarioResult
from telemetry.simulation.simulator.sensors.iq_model import AWR1843_IQ

AWR1843, POSITION2GO = SENSORS


@pytest.mark.parametrize(("sensor", "places", "phases"), [(AWR1843, 40, 16), (POSITION2GO, 100, 40)])
def test_figures_are_reached(sensor: iq_reflector.Sensor, places: int, phases: int) -> None:
    result = measure(sensor, 5, places=places, phases=phases)
    assert [figure.words for figure in result.figures if not figure.reached] == []
    assert sum(figure.least is not None or figure.most is not None for figure in result.figures) >= 5


def test_one_cell_apart_two_are_one_in_some_phases() -> None:
    share = resolved(AWR1843_IQ, "rectangular", 1.0, np.random.default_rng(0), 16)
    assert 0.2 < share < 0.9


def test_it_is_in_the_catalogue_and_reads_without_a_flight() -> None:
    assert iq_reflector.NAME in NAMES
    result = ScenarioResult(iq_reflector.NAME, 5, (measure(POSITION2GO, 5, places=3, phases=2),))
    lines = result.lines()
    assert lines[1] == "  Position2Go"
    assert "contact" not in " ".join(lines)
    assert result.as_json()["duration_s"] == 0.0


@pytest.mark.parametrize("name", ["world", "record"])
def test_what_belongs_to_flights_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="Nothing is flown"):
        iq_reflector.run(ScenarioRequest(**{name: tmp_path / "x"}))  # type: ignore[arg-type]
