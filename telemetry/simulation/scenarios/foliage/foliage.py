"""Scenario: a UWB radar clears foliage from a traversability map, beside what the paper measured (Ahtiainen)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from affine import Affine
from pyproj import CRS

from mapping.uwb.thresholds import Thresholds
from mapping.uwb.uwb_params import UwbParams
from planning.errors import ParameterError
from planning.ground.traversable import UwbScans
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import write_dsm
from telemetry.sensors.uwb_log import write_uwb_log
from telemetry.simulation.scenarios.foliage.foliage_calibration import PRINTED, fig_6, lawn_thresholds, table_ii
from telemetry.simulation.scenarios.foliage.foliage_drive import lawn_drive
from telemetry.simulation.scenarios.foliage.foliage_figures import (
    PAPERS_RULE,
    Drive,
    Rates,
    cleared_by,
    driven,
    rates,
    seconds_per_scan,
)
from telemetry.simulation.scenarios.foliage.foliage_roc import echoes_m2, roc_chart, rocs
from telemetry.simulation.scenarios.foliage.foliage_rural import route
from telemetry.simulation.scenarios.foliage.foliage_trials import (
    BRANCHES_WIDE_M,
    CELL_M,
    TRIAL_1,
    TRIAL_2,
    Printed,
    trial_site,
)
from telemetry.simulation.scenarios.stage.result import Figure, FlightResult, ScenarioRequest, ScenarioResult, measured
from telemetry.simulation.simulator.sensors.uwb import UwbModel

NAME, ROC = "foliage", "ROC"
SPARSE = (1, "c")
STRONG_WITHIN, SMALL_WITHIN = 0.003, 0.015
"""Of Table II: the five things that reflect well, and the small ones. T_max is a maximum over chance: it moves both."""
SMALL = ("2 bricks", "Stone", "Cardboard box")
SWEEP_P_O, SWEEP_P_C2 = (0.6, 0.7, 0.8, 0.9), (0.1, 0.2, 0.3)
HZ_BUDGET_S = 0.1
SITE_UTM = (55, 332_000.0, 6_250_000.0)
"""Zone (south), easting and northing of the recorded site's middle."""


def run(wanted: ScenarioRequest) -> ScenarioResult:
    """All trials of the paper. Raises ParameterError for a world of one's own and for a record of another kind."""
    if wanted.world is not None:
        raise ParameterError("This scenario brings its own sites.", where="--world", advice="Leave --world away.")
    if wanted.record is not None and wanted.record.suffix != ".npz":
        what = f"The radar's log cannot be kept as {wanted.record.name}."
        raise ParameterError(what, where="--record", advice="Give a name that ends with .npz.")
    thresholds = lawn_thresholds(wanted.seed)
    sparse = driven(trial_site(*SPARSE), lawn_drive(), wanted.seed)
    if wanted.record is not None:
        record(sparse, wanted.record)
    results = [_calibration(thresholds)]
    trials = [(1, *row) for row in TRIAL_1.items()] + [(2, *row) for row in TRIAL_2.items()]
    for number, (trial, letter, (_, printed)) in enumerate(trials):
        wanted.report(f"Trial {trial} {letter}", number / (len(trials) + 2))
        results.append(_trial(trial, letter, printed, wanted.seed))
    if wanted.charts:
        wanted.report("Drawing the ROC", len(trials) / (len(trials) + 2))
        results.append(_roc(wanted.seed))
    return ScenarioResult(NAME, wanted.seed, (*results, _sweep(sparse), _rural(wanted.seed), _cost(sparse)))


def _roc(seed: int) -> FlightResult:
    return measured(ROC, (), charts=tuple(roc_chart(roc) for roc in rocs(seed)))


def record(there: Drive, log: Path) -> None:
    """The radar log of a drive, and beside it, as .tif, the surface model it was taken on."""
    zone, east_m, north_m = SITE_UTM
    half_m = there.site.side_m / 2.0
    corner = Affine.translation(east_m - half_m, north_m + half_m) @ Affine.scale(CELL_M, -CELL_M)
    dsm = Dsm(there.elevation_m, corner, CRS.from_epsg(32700 + zone), None, "")
    write_dsm(log.with_suffix(".tif"), dsm)
    xy_m = np.array([[east_m + pose.x_m, north_m + pose.y_m] for pose in there.poses])
    north_deg = dsm.lat_lon_from_xy(xy_m + np.array([0.0, 1.0])) - dsm.lat_lon_from_xy(xy_m)
    turn_rad = np.arctan2(north_deg[:, 1] * np.cos(np.deg2rad(dsm.lat_lon_from_xy(xy_m)[:, 0])), north_deg[:, 0])
    heading_rad = np.array([pose.heading_rad for pose in there.poses]) + turn_rad
    t_s = np.array([pose.t_s for pose in there.poses])
    write_uwb_log(log, UwbScans(t_s, dsm.lat_lon_from_xy(xy_m), heading_rad, there.scans, UwbModel().geometry))


def _calibration(thresholds: Thresholds) -> FlightResult:
    table, layers = table_ii(thresholds), fig_6(thresholds)
    off = {name: abs(table[name] - printed) for name, printed in PRINTED.items()}
    four, five = layers[4], layers[5]
    return measured(
        "the simulated radar beside the real one",
        (
            Figure("Table II, largest deviation of large things", _worst(off, small=False), most=STRONG_WITHIN),
            Figure("Table II, largest deviation of small things", _worst(off, small=True), most=SMALL_WITHIN),
            Figure("Fig. 6, four layers over T_max", four.leaves - four.leaves_limit, least=0.0, unit=" counts"),
            Figure("Fig. 6, bricks behind four layers over T_d", four.bricks, least=1.0, unit=" counts"),
            Figure("Fig. 6, bricks behind five layers over T_d", five.bricks, most=0.5, unit=" counts"),
            *(
                Figure(f"Table II, P(z|occ) of {name}", round(table[name], 4), paper=f"{printed:.4f}")
                for name, printed in PRINTED.items()
            ),
        ),
        [_behind(row.layers) for row in layers if row.layers]
        + [f"{row.layers} layers: foliage {row.leaves:.1f}, bricks {row.bricks:.1f} counts over T_d" for row in layers],
    )


def _behind(layers: int) -> str:
    """Why thick foliage cannot be cleared by power alone without what stands behind it."""
    branches, *things = echoes_m2(layers, BRANCHES_WIDE_M).items()
    behind = ", ".join(f"{name} {m2:.3f}" for name, m2 in things)
    return f"{layers} layers of {BRANCHES_WIDE_M:g} m echo as {branches[1]:.3f} m2; of what stands behind: {behind} m2"


def _worst(off: Mapping[str, float], *, small: bool) -> float:
    return max(value for name, value in off.items() if (name in SMALL) is small)


def _trial(trial: int, letter: str, printed: Printed, seed: int) -> FlightResult:
    there = driven(trial_site(trial, letter), lawn_drive(), seed)
    found = rates(there, cleared_by(there)[0])
    held = (trial, letter) == SPARSE
    theirs = rates(there, cleared_by(there, PAPERS_RULE)[0])
    fnr = _percent(printed.fnr)
    figures: tuple[Figure, ...] = (
        Figure("FNR", found.obstacles.rate, most=0.10 if held else None, paper=fnr),
        Figure("FNR, the paper's rule here", theirs.obstacles.rate, paper=fnr),
    )
    if found.foliage.cells:
        tnr = _percent(printed.tnr)
        figures = (
            Figure("TNR of all foliage", found.foliage.rate, least=0.90 if held else None, paper=tnr),
            Figure("TNR of all foliage, the paper's rule here", theirs.foliage.rate, paper=tnr),
            *figures,
        )
    return measured(there.site.name, figures, [*_rows(printed, theirs, found), *_apart(found)])


def _rows(printed: Printed, theirs: Rates, ours: Rates) -> list[str]:
    """The paper's row of Table III, and what its rule and ours make of the same simulated scans."""
    pairs = [
        (words, found.foliage.rate, found.obstacles.rate)
        for words, found in (("the paper's rule here", theirs), ("our rule", ours))
    ]
    rows = [("paper", printed.tnr, printed.fnr), *pairs]
    return ["; ".join(f"{words}: TNR {_percent(tnr)}, FNR {_percent(fnr)}" for words, tnr, fnr in rows)]


def _apart(found: Rates) -> list[str]:
    """What the two rates average over."""
    notes = []
    if found.foliage.cells:
        notes.append(
            f"{found.foliage.cells} cells of foliage, of which {found.on_clear_spots.cells} lie on clear spots: "
            f"TNR of those alone {_percent(found.on_clear_spots.rate)}"
        )
    if found.placed:
        each = ", ".join(f"{name} {_percent(share.rate)}" for name, share in found.placed.items())
        notes.append(f"{found.obstacles.cells} cells of obstacles; cleared of those of the things on the lawn: {each}")
    return notes


def _sweep(there: Drive) -> FlightResult:
    """Fig. 9: effective clearing against caution, in trial 1 c, by our rule."""
    notes = []
    for most_occupied in SWEEP_P_O:
        for free_before in SWEEP_P_C2:
            params = replace(
                UwbParams(), most_occupied=most_occupied, free_before=free_before, free_behind=free_before + 0.1
            )
            found = rates(there, cleared_by(there, params)[0])
            notes.append(
                f"P_O {most_occupied:.1f}, P_C2 {free_before:.1f}: TNR {_percent(found.foliage.rate)}, "
                f"FNR {_percent(found.obstacles.rate)}"
            )
    return measured("fig. 9, trial 1 c, our rule", (), notes)


def _rural(seed: int) -> FlightResult:
    way = route(seed)
    figures = (
        Figure("route from A to B before clearing", float(way.before), most=0.0),
        Figure("route from A to B after clearing", float(way.after), least=1.0),
        Figure("share of the seen brick piles that still blocks", way.piles_kept, least=0.9),
    )
    return measured("trial 3, rural", figures, [f"{int(way.result.cleared.sum())} cells cleared along the way"])


def _cost(there: Drive) -> FlightResult:
    """Real time at 10 Hz, which the paper's was not."""
    share = seconds_per_scan(there) / HZ_BUDGET_S
    cells = there.map.index.size
    return measured(
        "processor time", (Figure(f"of a scan, {cells:,} cells, at 10 Hz", 100 * share, most=50.0, unit=" %"),), []
    )


def _percent(share: float | None) -> str:
    return "none" if share is None or math.isnan(share) else f"{100 * share:.1f} %"
