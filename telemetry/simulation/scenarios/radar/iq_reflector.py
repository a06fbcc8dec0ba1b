"""Scenario: a corner reflector from samples on: how exactly the chain places it, and when it tells two apart."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.radar.chain import RadarChain
from mapping.radar.detections import Detections
from mapping.radar.fft import Window
from planning.errors import ParameterError
from telemetry.simulation.scenarios.stage.result import Figure, FlightResult, ScenarioRequest, ScenarioResult, measured
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, Series, series
from telemetry.simulation.simulator.sensors.iq import noise
from telemetry.simulation.simulator.sensors.iq_model import AWR1843_IQ, POSITION2GO_IQ, IqModel
from telemetry.simulation.simulator.sensors.iq_synthesis import Returns, sampled

NAME = "iq-reflector"
SNR_DB, PLACES = 15.0, 300
PAIR_SNR_DB, PHASES = 25.0, 180
"""Noise decides little then: what counts is how the two echoes add up."""
PAIRS: tuple[tuple[Window, float, float | None], ...] = (
    ("rectangular", 1.5, 0.95),
    ("rectangular", 1.0, None),
    ("hann", 2.0, 0.95),
    ("hann", 1.5, None),
    ("hann", 1.0, None),
)
"""Window, range cells between the two, and the least share of phases in which both must be seen."""
NEAREST_M = 3.0
FASTEST = 0.9
"""Of what the radar measures without ambiguity."""
OWN_CELLS = 2.0
"""A detection so near to the reflector's range is its own."""


@dataclass(frozen=True, slots=True)
class Sensor:
    title: str
    model: IqModel
    side_rad: float
    """The reflector stands within so much of the boresight."""
    azimuth_most_deg: float | None
    printed: str
    range_paper: str
    azimuth_paper: str


SENSORS = (
    Sensor("AWR1843", AWR1843_IQ, math.radians(45.0), 1.0, "", "cells of 0.5 m", ""),
    Sensor(
        "Position2Go",
        POSITION2GO_IQ,
        math.radians(20.0),
        None,
        "printed for the Position2Go: 0.15 m, 2 degrees inside 20 degrees; two antennas cannot do better at 15 dB",
        "0.15 m",
        "2 deg inside 20 deg",
    ),
)


def run(wanted: ScenarioRequest) -> ScenarioResult:
    """Raises ParameterError for a world or a recording: nothing is flown."""
    if wanted.world is not None or wanted.record is not None:
        raise ParameterError(
            "Nothing is flown in this scenario, and its reflectors stand in no world.",
            where=NAME,
            advice="Leave --world and --record out.",
        )
    parts = []
    for sensor in SENSORS:
        wanted.report(sensor.title, len(parts) / len(SENSORS))
        parts.append(measure(sensor, wanted.seed))
    return ScenarioResult(NAME, wanted.seed, tuple(parts))


def measure(sensor: Sensor, seed: int, *, places: int = PLACES, phases: int = PHASES) -> FlightResult:
    errors = errors_of(sensor.model, sensor.side_rad, np.random.default_rng([seed, 21]), places)
    figures = _error_figures(sensor, errors)
    shares: list[tuple[Window, float, float]] = []
    for number, (window, cells, least) in enumerate(PAIRS):
        share = resolved(sensor.model, window, cells, np.random.default_rng([seed, 22, number]), phases)
        words = f"{sensor.title}: two alike {cells:g} range cells apart, {window} window, resolved in"
        shares.append((window, cells, 100 * share))
        figures.append(Figure(words, 100 * share, least=None if least is None else 100 * least, unit=" % of phases"))
    notes = (sensor.printed,) if sensor.printed else ()
    return measured(sensor.title, tuple(figures), notes, (_errors_chart(sensor, errors), _pairs_chart(sensor, shares)))


def _errors_chart(sensor: Sensor, errors: Errors) -> Chart:
    """What share of the places lies within each error."""

    def curve(name: str, found: F64) -> Series:
        return series(name, np.sort(np.abs(found)), 100.0 * np.arange(1, len(found) + 1) / max(1, len(found)))

    curves = (curve("range, m", errors.range_m), curve("speed, m/s", errors.speed_m_s))
    title = f"{sensor.title}: errors at {SNR_DB:g} dB"
    return Chart(title, "error", "places within, %", (*curves, curve("azimuth, deg", errors.azimuth_deg)))


def _pairs_chart(sensor: Sensor, shares: list[tuple[Window, float, float]]) -> Chart:
    windows = list(dict.fromkeys(window for window, _, _ in shares))
    lines = [
        series(
            f"{window} window", *zip(*[(cells, share) for name, cells, share in shares if name == window], strict=True)
        )
        for window in windows
    ]
    return Chart(
        f"{sensor.title}: two alike told apart", "apart, range cells", "of phases, %", tuple(lines), y_span=(0.0, 104.0)
    )


@dataclass(frozen=True, slots=True)
class Errors:
    """One row per place at which the reflector was found."""

    range_m: F64
    speed_m_s: F64
    azimuth_deg: F64
    found: float
    """Share of the places."""


def errors_of(model: IqModel, side_rad: float, random: np.random.Generator, places: int) -> Errors:
    """A reflector that sends back ``SNR_DB`` (in one antenna's cell, over the noise), anywhere, at any speed."""
    chain = RadarChain(model.params, model.chain)
    rows: list[tuple[float, float, float]] = []
    for _ in range(places):
        range_m = random.uniform(NEAREST_M, 0.9 * model.params.max_range_m)
        speed_m_s = random.uniform(-FASTEST, FASTEST) * model.params.max_velocity_m_s
        azimuth_rad = random.uniform(-side_rad, side_rad)
        turn = random.uniform(0.0, 2 * math.pi, 1)
        echo = _echoes(model, SNR_DB, np.array([range_m]), turn, speed_m_s, azimuth_rad)
        found = chain.process(sampled(model.params, echo) + noise(model.params.shape, random))
        own = np.flatnonzero(np.abs(found.range_m - range_m) <= OWN_CELLS * model.params.range_resolution_m)
        if len(own):
            rows.append(_error(found, int(own[0]), range_m, speed_m_s, azimuth_rad))
    range_error, speed_error, azimuth_error = np.array(rows).reshape(-1, 3).T
    return Errors(range_error, speed_error, azimuth_error, len(rows) / places)


def _error(
    found: Detections, k: int, range_m: float, speed_m_s: float, azimuth_rad: float
) -> tuple[float, float, float]:
    return (
        float(found.range_m[k]) - range_m,
        float(found.radial_speed_m_s[k]) - speed_m_s,
        math.degrees(float(found.azimuth_rad[k]) - azimuth_rad),
    )


def resolved(model: IqModel, window: Window, cells: float, random: np.random.Generator, phases: int) -> float:
    """Share of the phases, evenly around, in which two equal reflectors one behind the other are both found.

    Both are when each has a detection of its own, not nearer to the other and at most three quarters of a cell away.
    """
    model = replace(model, chain=replace(model.chain, range_window=window))
    params, chain = model.params, RadarChain(model.params, model.chain)
    cell_m = params.range_resolution_m
    both = 0
    for number in range(phases):
        range_m = (random.uniform(10.0, 12.0) + np.array([0.0, cells])) * cell_m
        # The phases are those at the middle of the samples: at 0 the two echoes hide the gap between them best.
        turns = np.array([0.0, 2 * math.pi * number / phases]) - 4 * math.pi * range_m / params.wavelength_m
        cube = sampled(params, _echoes(model, PAIR_SNR_DB, range_m, turns, 0.0, 0.0))
        found = chain.process(cube + noise(params.shape, random))
        both += len(found) > 1 and _apart(found.range_m, range_m, min(0.75, cells / 2) * cell_m)
    return both / phases


def _apart(found_m: F64, true_m: F64, within_m: float) -> bool:
    away_m = np.abs(found_m[:, None] - true_m[None, :])
    first, second = away_m.argmin(axis=0)
    return bool(first != second and away_m.min(axis=0).max() <= within_m)


def _echoes(
    model: IqModel, snr_db: float, range_m: F64, turn_rad: F64, speed_m_s: float, azimuth_rad: float
) -> Returns:
    amplitude = math.sqrt(10 ** (snr_db / 10) / model.gain) * np.exp(1j * turn_rad).astype(np.complex128)
    alike = np.ones(len(range_m))
    return Returns(range_m, speed_m_s * alike, azimuth_rad * alike, 0.0 * alike, amplitude)


def _error_figures(sensor: Sensor, errors: Errors) -> list[Figure]:
    title = f"{sensor.title}, {SNR_DB:g} dB"
    return [
        Figure(f"{title}: reflector found at", 100 * errors.found, least=99.0, unit=" % of places"),
        Figure(f"{title}: range error (RMS)", _rms(errors.range_m), most=0.1, unit=" m", paper=sensor.range_paper),
        Figure(f"{title}: radial speed error (RMS)", _rms(errors.speed_m_s), most=0.1, unit=" m/s"),
        Figure(
            f"{title}: azimuth error (RMS)",
            _rms(errors.azimuth_deg),
            most=sensor.azimuth_most_deg,
            unit=" deg",
            paper=sensor.azimuth_paper,
        ),
        Figure(f"{title}: range error, 95 % within", _p95(errors.range_m), unit=" m"),
        Figure(f"{title}: radial speed error, 95 % within", _p95(errors.speed_m_s), unit=" m/s"),
        Figure(f"{title}: azimuth error, 95 % within", _p95(errors.azimuth_deg), unit=" deg"),
    ]


def _rms(values: F64) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.inf


def _p95(values: F64) -> float:
    return float(np.percentile(np.abs(values), 95.0)) if len(values) else math.inf
