"""The whole trade between clearing foliage and keeping obstacles: a curve over all limits of probability (fig. 9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.uwb.uwb_params import UwbParams
from telemetry.simulation.scenarios.foliage.foliage_drive import lawn_drive
from telemetry.simulation.scenarios.foliage.foliage_figures import (
    PAPERS_RULE,
    Drive,
    cleared_by,
    driven,
    labels,
    placed_cells,
)
from telemetry.simulation.scenarios.foliage.foliage_trials import TRIAL_1, TRIAL_2, trial_site
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from telemetry.simulation.simulator.sensors.uwb import ECHO_M2_PER_M, LAYERS, transmission
from telemetry.simulation.simulator.sensors.uwb_scene import TABLE_II

TRIALS = ((1, "c"), (2, "e"), (2, "f"))
"""Sparse foliage, and the thick that is hardest to tell."""
RULES = {"the paper's rule": PAPERS_RULE, "our rule": UwbParams()}
THINGS = ("3 bricks", "2 bricks", "Stone")


@dataclass(frozen=True, slots=True)
class Curve:
    """What clearing every cell below a limit comes to, for all limits; shares of cells in view for more than 2 s."""

    rule: str
    tnr: F64
    """(K,) of the foliage, ascending"""
    fnr: F64
    """(K,) of the things on the lawn, which the foliage hides: fences, sheds and trees stand free"""
    usual: tuple[float, float]
    """TNR and FNR at the limit in use, 0.5."""


@dataclass(frozen=True, slots=True)
class Roc:
    trial: str
    paper: tuple[float, float]
    """TNR and FNR as printed; the paper's FNR is that of all obstacles."""
    curves: tuple[Curve, ...]


def rocs(seed: int) -> tuple[Roc, ...]:
    """Of the trials that tell most, both rules on the same scans."""
    found = []
    for trial, letter in TRIALS:
        printed = (TRIAL_1 if trial == 1 else TRIAL_2)[letter][1]
        there = driven(trial_site(trial, letter), lawn_drive(), seed)
        curves = tuple(curve(there, name, params) for name, params in RULES.items())
        found.append(Roc(there.site.name, (printed.tnr or 0.0, printed.fnr), curves))
    return tuple(found)


def roc_chart(roc: Roc) -> Chart:
    """In percent, as fig. 9 has it."""
    drawn = [
        one
        for found in roc.curves
        for one in (
            series(found.rule, 100 * found.fnr, 100 * found.tnr),
            series(f"{found.rule}, limit in use", [100 * found.usual[1]], [100 * found.usual[0]], drawn="points"),
        )
    ]
    tnr, fnr = (100 * share for share in roc.paper)
    printed = series("the paper's, whose FNR is of all obstacles", [fnr], [tnr], drawn="points", printed=True)
    return Chart(
        f"ROC, {roc.trial}",
        "FNR of the things on the lawn, %",
        "TNR of the foliage, %",
        (*drawn, printed),
        x_span=(-2.0, 102.0),
        y_span=(-2.0, 102.0),
    )


def curve(there: Drive, rule: str, params: UwbParams) -> Curve:
    result = cleared_by(there, params)[0]
    obstacle, foliage = labels(there)
    leaves = np.sort(result.probability[foliage & result.seen].astype(np.float64))
    things = np.sort(result.probability[obstacle & placed_cells(there.site) & result.seen].astype(np.float64))
    limits = np.unique(np.concatenate([[0.0, 1.1], leaves, things]))
    tnr, fnr = (_below(values, limits) for values in (leaves, things))
    at_half = np.array([0.5])
    return Curve(rule, tnr, fnr, (float(_below(leaves, at_half)[0]), float(_below(things, at_half)[0])))


def _below(values: F64, limits: F64) -> F64:
    return np.searchsorted(values, limits) / max(1, len(values))


def echoes_m2(layers: float, wide_m: float) -> dict[str, float]:
    """What a screen of branches echoes, and what is left of each thing behind it: cross sections in m2.

    From fig. 6 and Table II. A detector that is told no more than power cannot keep what is weaker than what it clears.
    """
    left = float(transmission(np.array([layers]))[0])
    leaves = float(np.interp(layers, LAYERS, ECHO_M2_PER_M)) * wide_m
    return {"branches": leaves, **{name: TABLE_II[name][0] * left for name in THINGS}}
