"""Scenarios: what a radar maps (Miccinesi 2022): a corner reflector 68 m ahead and 3 m higher, a wood, and a ruin.

The reflector is seen in lateral flight (figs 10-15); wood and ruined building are figs 16-21.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.perceiving.alerts import AlertParams
from mapping.radar.targets import Gate, Variant, in_gate, polar, to_enu
from mapping.sensor_frames import rows
from telemetry.simulation.scenarios.stage import scenes
from telemetry.simulation.scenarios.stage.map_against_world import (
    clusters_of,
    radar_compared,
    spread,
    vision_compared,
    within,
)
from telemetry.simulation.scenarios.stage.map_charts import map_charts
from telemetry.simulation.scenarios.stage.result import Figure, MapFigures, ScenarioRequest, ScenarioResult
from telemetry.simulation.scenarios.stage.running import flown_of, setup_of
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight, SeenRadarFrame
from telemetry.simulation.simulator.sensors.body import of_truth
from telemetry.simulation.simulator.sensors.radar_model import RadarModel
from telemetry.topics.obstacles import PerceptionSettings

NAME, TITLE = "corner-reflector", "lateral flight"
RANGE_GATE_M, WEAKEST = 1.5, 0.01
"""A return at the reflector's true range and within 20 dB of its strength is its own, side lobes included: the grass
and the hill at that range are weaker than that."""
FAR_M, NEAR_M = (60.0, 76.0), 40.0
LEVEL_WITHIN_M = 0.4
DRAWN_M = 12.0
"""Around the reflector, from above."""
WOOD, RUIN = "wood", "ruined-building"
PRINTED_WOOD_M = 60.0


@dataclass(frozen=True, slots=True)
class ReflectorReturns:
    """The reflector's own, one row each."""

    range_m: F64
    """True distance of the reflector when it was measured."""
    up_m: F64
    """True height of the vehicle then."""
    mapped: dict[Variant, F64]
    """(N, 3) In the world's frame, as each variant of fig. 15 puts it."""


def run_reflector(wanted: ScenarioRequest) -> ScenarioResult:
    scene = scenes.corner_reflector()
    setup = setup_of(scene, wanted, NAME, sensors=("radar",))
    flown = flown_of(setup, wanted)
    world = setup.world
    places = world.reflectors
    if len(places) == 0:
        return ScenarioResult(NAME, wanted.seed, (flown.result(TITLE, notes=("There is no reflector.",)),))
    returns = returns_of(flown, places[0], float(world.placed.corner_m2.max()))
    errors_m = np.hypot(*(returns.mapped["heading_only"] - places[0])[:, :2].T)
    voxels = flown.voxels("radar")
    mine = _holding(voxels, returns.mapped["heading_only"], flown.map_to_world)
    figures = (*_place_figures(returns, errors_m), _cluster_figure(mine), *_spread_figures(returns))
    level = _level(returns)
    radar = MapFigures(
        voxels=len(voxels),
        within_m=within(errors_m),
        vertical_spread_m=spread(returns.mapped["heading_only"][level, 2]),
    )
    note = f"{len(errors_m)} returns of the reflector in {len(flown.radar)} frames, in {len(mine)} voxels"
    charts = _charts(returns, places[0])
    flight = flown.result(TITLE, radar=radar, figures=figures, notes=(note,), charts=charts)
    return ScenarioResult(NAME, wanted.seed, (flight,))


def returns_of(flown: SeenFlight, reflector: F64, cross_section_m2: float) -> ReflectorReturns:
    """Those in the paper's gate whose range and strength fit the reflector."""
    range_m: list[float] = []
    up_m: list[float] = []
    mapped: dict[Variant, list[F64]] = {"heading_only": [], "full_attitude": [], "full_attitude_flat": []}
    for look in flown.radar:
        xyz = _own(look, reflector, cross_section_m2)
        for variant, places in mapped.items():
            found = to_enu(xyz, look.pose.position_enu_m, look.pose.rotation_enu_body, look.pose.heading_rad, variant)
            places.append(found + flown.map_to_world)
        range_m += [float(np.linalg.norm(reflector - look.truth.position_enu_m))] * len(xyz)
        up_m += [look.truth.position_enu_m[2]] * len(xyz)
    stacked: dict[Variant, F64] = {
        name: np.concatenate(places or [np.empty((0, 3))]) for name, places in mapped.items()
    }
    return ReflectorReturns(np.array(range_m), np.array(up_m), stacked)


def _own(look: SeenRadarFrame, reflector: F64, cross_section_m2: float) -> F64:
    """(N, 3) body"""
    xyz = np.array(rows(look.frame.xyz_m, 3), np.float64)
    power = 10 ** (rows(look.frame.snr_db, 1)[:, 0] / 10)
    measured = polar(xyz)
    true = polar((of_truth(look.truth).T @ (reflector - look.truth.position_enu_m))[None])
    full = RadarModel().snr(np.array([cross_section_m2]), true.range_m, true.azimuth_rad, true.elevation_rad)
    own = in_gate(measured, Gate()) & (power >= WEAKEST * full)
    return xyz[own & (np.abs(measured.range_m - true.range_m) <= RANGE_GATE_M)]


def _charts(returns: ReflectorReturns, reflector: F64) -> tuple[Chart, ...]:
    """From above (fig. 14) by the variant that was chosen, and from the side (fig. 15) by all three."""
    words: dict[Variant, str] = {
        "full_attitude": "measured elevation",
        "full_attitude_flat": "attitude, level",
        "heading_only": "heading only (chosen)",
    }
    east_m, north_m, up_m = reflector.tolist()
    level = _level(returns)
    seen = series("returns", *returns.mapped["heading_only"][:, :2].T, drawn="points")
    above = series("reflector", [east_m], [north_m], drawn="points", printed=True)
    across = [series(name, *returns.mapped[of][level][:, [0, 2]].T, drawn="points") for of, name in words.items()]
    side = series("reflector", [east_m], [up_m], drawn="points", printed=True)
    return (
        Chart(
            "Returns from above, heading only (fig. 14)",
            "east, m",
            "north, m",
            (seen, above),
            x_span=(east_m - DRAWN_M, east_m + DRAWN_M),
            y_span=(north_m - DRAWN_M, north_m + DRAWN_M),
            is_true=True,
        ),
        Chart("The three rotations from the side (fig. 15)", "east, m", "up, m", (*across, side)),
    )


def _place_figures(returns: ReflectorReturns, errors_m: F64) -> tuple[Figure, ...]:
    far = (returns.range_m >= FAR_M[0]) & (returns.range_m <= FAR_M[1])
    near = returns.range_m <= NEAR_M
    return (
        Figure("returns within 3 m at 68 m", _share(errors_m[far] <= 3.0), least=0.9),
        Figure("returns within 1.5 m inside 40 m", _share(errors_m[near] <= 1.5), least=0.9),
    )


def _holding(voxels: F64, places: F64, map_to_world: F64) -> F64:
    """Those believed voxels in which the places lie."""
    edge = PerceptionSettings().radar_resolution_m
    keys = {tuple(key) for key in np.floor((places - map_to_world) / edge).astype(int).tolist()}
    own = [tuple(key) in keys for key in np.floor((voxels - map_to_world) / edge).astype(int).tolist()]
    return voxels[np.array(own, np.bool_)]


def _cluster_figure(voxels: F64) -> Figure:
    """Voxels that one alert would hold together are one cluster."""
    count = len(np.unique(clusters_of(voxels, link_m=AlertParams().same_within_m)))
    return Figure(
        "clusters that the reflector makes", float(count), least=1.0, most=1.0, paper="one, compact (fig. 15)"
    )


def _spread_figures(returns: ReflectorReturns) -> tuple[Figure, ...]:
    level = _level(returns)
    chosen = spread(returns.mapped["heading_only"][level, 2])
    measured = spread(returns.mapped["full_attitude"][level, 2])
    flat = spread(returns.mapped["full_attitude_flat"][level, 2])
    # A map is no finer than its voxels: a spread below one is one.
    ratio = measured / max(chosen, PerceptionSettings().radar_resolution_m)
    return (
        Figure("vertical spread, measured elevation over heading only", ratio, least=3.0, paper="a smear (fig. 15)"),
        Figure("vertical spread, heading only", chosen, unit=" m"),
        Figure("vertical spread, measured elevation", measured, unit=" m"),
        Figure("vertical spread, full attitude but level", flat, unit=" m"),
    )


def _level(returns: ReflectorReturns) -> Bools:
    """Those of the part flown at constant altitude."""
    return np.abs(returns.up_m - scenes.LEVEL_FLIGHT_M) <= LEVEL_WITHIN_M


def _share(hits: Bools) -> float:
    return float(hits.mean()) if len(hits) else 0.0


def run_wood(wanted: ScenarioRequest) -> ScenarioResult:
    """The paper's stood about 60 m from the start (3.2)."""
    return _mapped(WOOD, scenes.wood(wanted.seed), wanted, ("figs 16, 17", "fig. 18"), PRINTED_WOOD_M)


def run_ruin(wanted: ScenarioRequest) -> ScenarioResult:
    return _mapped(RUIN, scenes.ruined_building(wanted.seed), wanted, ("figs 20, 21", "as fig. 18"), None)


def _mapped(
    name: str,
    scene: scenes.ScenarioScene,
    wanted: ScenarioRequest,
    drawn_in: tuple[str, str],
    begins_north_m: float | None,
) -> ScenarioResult:
    setup = setup_of(scene, wanted, name)
    flown = flown_of(setup, wanted)
    maps = radar_compared(flown, setup), vision_compared(flown, setup)
    radar, vision = (one.figures for one in maps)
    own = begins_north_m if wanted.world is None else None
    charts = map_charts(maps, flown, setup.world, figures=drawn_in, begins_north_m=own)
    figures = (
        Figure("contacts", float(flown.contact), most=0.0),
        Figure("precision of the radar map", radar.precision or 0.0),
        Figure("recall of the radar map", radar.recall or 0.0),
    )
    flight = flown.result("mapping flight", radar=radar, vision=vision, figures=figures, charts=charts)
    return ScenarioResult(name, wanted.seed, (flight,))
