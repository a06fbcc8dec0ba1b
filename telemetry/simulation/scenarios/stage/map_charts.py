"""Maps beside the world as it truly is: from above, from the side (Miccinesi 2022, figs 17-21), and voxel by voxel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.simulation.scenarios.stage.map_against_world import MapComparison
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, Series, not_empty, series
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.scene.primitives import BOX, ELLIPSOID

MOST_VOXELS = 3000
"""Of a series: a map with every third voxel left out is another map to the eye."""
SKYLINE_STEP_M, BESIDE_M = 0.5, 5.0
"""Steps of what truly stands there, and how far beyond flight and maps it is shown."""
TOLERANCES_M = np.linspace(0.0, 5.0, 51)


def map_charts(
    maps: Sequence[MapComparison],
    flown: SeenFlight,
    world: World,
    *,
    figures: tuple[str, str],
    begins_north_m: float | None,
) -> tuple[Chart, ...]:
    """``figures``: where the paper shows a radar's map from above and from the side. ``begins_north_m``: how far ahead
    of the start what is mapped begins, where the paper prints it.
    """
    seen = [one for one in maps if len(one.voxels_enu)]
    if not seen:
        return ()
    places: list[Chart] = []
    for one in seen:
        above, side = figures if one.sensor == "radar" else ("", "")
        places.append(_from_above(one, flown, above, begins_north_m))
        places.append(_from_the_side(one, flown, world, side, begins_north_m))
    return (*places, by_distance(seen))


def _from_above(one: MapComparison, flown: SeenFlight, figure: str, begins_north_m: float | None) -> Chart:
    true = series("true surface at its height", *_unique(one.true_enu[:, :2]).T, drawn="points", most=MOST_VOXELS)
    printed = []
    if begins_north_m is not None:
        east = np.concatenate([one.voxels_enu[:, 0], _path(flown)[:, 0]])
        ends = [float(east.min()), float(east.max())]
        printed = [series(_begins(begins_north_m), ends, [begins_north_m] * 2, printed=True)]
    way = series("flown", *_path(flown)[:, :2].T)
    lines = (way, true, *_right_and_wrong(one, one.voxels_enu[:, :2]), *printed)
    return Chart(_title(one, "from above", figure), "east, m", "north, m", lines, is_true=True)


def _from_the_side(
    one: MapComparison, flown: SeenFlight, world: World, figure: str, begins_north_m: float | None
) -> Chart:
    north = np.concatenate([one.voxels_enu[:, 1], _path(flown)[:, 1]])
    along = np.arange(np.floor(north.min()) - BESIDE_M, north.max() + BESIDE_M, SKYLINE_STEP_M)
    top = skyline(world, along)
    printed = []
    if begins_north_m is not None:
        ends = [float(top.min()), float(top.max())]
        printed = [series(_begins(begins_north_m), [begins_north_m] * 2, ends, printed=True)]
    way = series("flown", *_path(flown)[:, 1:].T)
    lines = (way, series("top of what stands there", along, top), *_right_and_wrong(one, one.voxels_enu[:, 1:]))
    return Chart(_title(one, "from the side", figure), "north, m", "above home, m", (*lines, *printed))


def _title(one: MapComparison, seen: str, figure: str) -> str:
    return f"{one.sensor.capitalize()} map {seen}{figure and f' ({figure})'}"


def _right_and_wrong(one: MapComparison, places: F64) -> tuple[Series, ...]:
    """Voxels that fall on one place are one there, and right where any of them is."""
    each, of = np.unique(places.round(3), axis=0, return_inverse=True)
    best_m = np.full(len(each), np.inf)
    np.minimum.at(best_m, of.ravel(), one.away_m)
    right = best_m <= one.near_m
    return not_empty(
        series(f"voxels within {one.near_m:g} m of a surface", *each[right].T, drawn="points", most=MOST_VOXELS),
        series("voxels farther away", *each[~right].T, drawn="points", most=MOST_VOXELS),
    )


def by_distance(seen: Sequence[MapComparison]) -> Chart:
    """Share of voxels that are right, and of true surface that was found, by how near is near enough; a point where it
    is counted."""
    lines: list[Series] = []
    for one in seen:
        shares = {"precision": one.precision, "recall": lambda within_m, one=one: one.recall(within_m) or 0.0}
        for words, share in shares.items():
            if words == "recall" and not len(one.missed_m):
                continue
            lines.append(series(f"{one.sensor}: {words}", TOLERANCES_M, [100 * share(m) for m in TOLERANCES_M]))
            lines.append(series("", [one.near_m], [100 * share(one.near_m)], drawn="points"))
    return Chart(
        "Precision and recall by distance",
        "counted as near, m",
        "share of voxels, %",
        tuple(lines),
        x_span=(0.0, float(TOLERANCES_M[-1])),
        y_span=(0.0, 102.0),
    )


def skyline(world: World, north_m: F64) -> F64:
    """(N,) how high what stands there reaches, as seen from the south; where nothing stands, the ground."""
    ground = world.terrain.ups_m(np.column_stack([np.zeros(len(north_m)), north_m]))
    rows = world.placed.rows
    if len(rows) == 0:
        return ground
    deep = np.abs(rows[:, 5] * rows[:, 8]) + np.abs(rows[:, 6] * rows[:, 7])
    half_m = np.where(rows[:, 0] == BOX, deep, rows[:, 5])
    off = np.abs(north_m[:, None] - rows[:, 2]) / half_m
    tall = (rows[:, 4] - rows[:, 3]) / 2
    crown = rows[:, 3] + tall * (1 + np.sqrt(np.maximum(0.0, 1.0 - off**2)))
    top = np.where(rows[:, 0] == ELLIPSOID, crown, rows[:, 4])
    return np.maximum(ground, np.where(off <= 1.0, top, -np.inf).max(axis=1))


def _begins(north_m: float) -> str:
    return f"{north_m:g} m from the start, as printed"


def _unique(places: F64) -> F64:
    return np.unique(places.round(3), axis=0)


def _path(flown: SeenFlight) -> F64:
    return np.array([truth.position_enu_m for truth in flown.track]).reshape(-1, 3)
