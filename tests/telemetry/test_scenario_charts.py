"""What scenarios draw: maps beside the true surfaces, flights among unknown objects; the numbers that are told."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from telemetry.simulation.scenarios.hugging.encounter_charts import cross_track_m, encounter_charts, following
from telemetry.simulation.scenarios.hugging.encounters import encounters
from telemetry.simulation.scenarios.hugging.long_flight import Look, growth_chart
from telemetry.simulation.scenarios.stage.map_against_world import NEAR_M, MapComparison
from telemetry.simulation.scenarios.stage.map_charts import map_charts, skyline
from telemetry.simulation.scenarios.stage.paper_fields import field
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, Series
from telemetry.simulation.scenarios.stage.scenes import VALLEY
from telemetry.simulation.scenarios.stage.seen_flight import SeenAlert, SeenFlight
from telemetry.simulation.scenarios.stage.world_objects import box, cylinder, tree, world_document
from telemetry.simulation.simulator.scene import World
from telemetry.topics.obstacles import Obstacle, ObstacleAlert, PerceptionSettings
from tests.telemetry.test_scenarios_own_ground import flown_past, plan


def world(*objects: dict[str, object]) -> World:
    return World.parse(world_document("drawn", list(objects)), frame=VALLEY, dsm=field(VALLEY, ()))


def told(t_s: float, away_m: float, north_m: float) -> SeenAlert:
    """Of what stands ``away_m`` ahead, at ``north_m``."""
    where = (0.0, north_m, 5.0)
    obstacle = Obstacle("roi", away_m, 0.0, 0.0, 0.0, None, where, None, None, None, 3, (1.0, 1.0, 1.0))
    alert = ObstacleAlert(f"a{north_m}", "radar", "obstacle", "begins", t_s, t_s, t_s, "!", obstacle)
    return SeenAlert(alert, np.array(where))


def by_name(chart: Chart) -> dict[str, Series]:
    return {one.name: one for one in chart.series}


def test_objects_stand_along_the_way_beside_what_stopping_needs() -> None:
    flown = flown_past()
    near, far = cylinder("near", (0.0, 20.0), 0.2, 9.0), cylinder("far", (0.0, 50.0), 0.2, 11.0)
    # 3 m/s: of the near one 14 m before it, of the far one never; and of something at 35 m, where nothing is.
    flown.told = [told(2.0, 14.0, 20.0), told(8.0, 11.0, 35.0)]
    there = world(near, far)
    found = encounters(flown, there, PerceptionSettings())
    profile, distances, false = encounter_charts(flown, there, found)

    drawn = by_name(profile)
    assert drawn["flown"].x[-1] == pytest.approx(60.0, abs=0.2)
    assert set(drawn["flown"].y) == {5.0}
    assert drawn["surface model"].y == pytest.approx([0.0] * len(drawn["surface model"].y), abs=0.01)
    upright = [one for one in profile.series if one.name in ("what the model does not know", "")]
    assert [one.x[0] for one in upright] == pytest.approx([19.5, 49.5], abs=0.6)
    assert [one.y[1] for one in upright] == pytest.approx([9.0, 11.0], abs=0.05)
    assert drawn["false alarm"].x == pytest.approx([24.0], abs=0.4)

    drawn = by_name(distances)
    passed = {one.name: one for one in found.passed}
    assert drawn["told at"].y == pytest.approx([passed["near"].distance_m, passed["far"].distance_m])
    assert drawn["told at"].y[0] == pytest.approx(13.2, abs=0.5)
    assert drawn["needed to stop"].y == pytest.approx([passed["near"].needed_m, passed["far"].needed_m], abs=1e-4)
    assert drawn["too late or never"].x == pytest.approx([49.5], abs=0.6)
    assert found.missed == 1

    drawn = by_name(false)
    assert drawn["false alarms so far"].y == (0.0, 0.0, 1.0, 1.0)
    assert drawn["at most 1 per km"].y[1] == pytest.approx(0.06, abs=0.001)


def test_nobody_who_has_not_flown_is_drawn() -> None:
    there, hovering = world(), flown_past(to_m=0.0)
    for flown in (hovering, SeenFlight(began_s=0.0, vehicle_radius_m=0.5)):
        found = encounters(hovering, there, PerceptionSettings())
        assert encounter_charts(flown, there, found) == ()
        assert following(flown, plan())[1] == ()


def test_the_line_is_followed_past_its_own_crossing() -> None:
    """Out to the east, a turn, and back through the way out: the nearest leg is not always the one that is flown."""
    line = np.array([[0.0, 0.0, 5.0], [40.0, 0.0, 5.0], [40.0, 20.0, 5.0], [20.0, -20.0, 5.0]])
    along = [line[k] + share * (line[k + 1] - line[k]) for k in range(3) for share in np.linspace(0.0, 1.0, 60)]
    assert cross_track_m(np.array(along), line).max() < 1e-9
    aside = np.array(along[:50]) + np.array([0.0, 0.3, 0.0])
    assert cross_track_m(aside, line) == pytest.approx([0.3] * 50)


def test_what_the_paper_prints_of_following_stands_beside_ours() -> None:
    line = np.array([[0.5, 0.0, 5.0], [0.5, 60.0, 5.0]])
    figures, (chart,) = following(flown_past(), replace(plan(), line_enu_m=line, clearance_m=4.6))
    assert [(one.value, one.paper.split(" m")[0]) for one in figures] == [(4.6, "3.80"), (pytest.approx(0.5), "0.84")]
    printed = next(one for one in chart.series if one.printed)
    assert (printed.drawn, set(printed.y)) == ("line", {0.84})


def test_maps_are_drawn_beside_the_true_surfaces_and_counted() -> None:
    there = world(box("house", (0.0, 30.0), (10.0, 4.0, 6.0)))
    face = np.array([(east, 28.0, 2.5) for east in np.arange(-4.5, 5.0)])
    right, wrong = face + np.array([0.0, 0.5, 0.0]), np.array([[0.0, 10.0, 2.5], [0.5, 28.5, 12.5]])
    voxels = np.vstack([right, wrong])
    away_m = there.surface_distance_m(voxels)
    missed_m = np.array([0.5] * 9 + [3.0])
    radar = MapComparison("radar", voxels, away_m, face, missed_m)
    empty = np.empty((0, 3))
    blind = MapComparison("vision", empty, np.empty(0), empty, np.empty(0))
    above, side, share = map_charts(
        (radar, blind), flown_past(to_m=20.0), there, figures=("fig. 17", "fig. 18"), begins_north_m=28.0
    )
    assert radar.figures.precision == pytest.approx(10 / 12)
    assert radar.figures.recall == pytest.approx(0.9)

    drawn = by_name(above)
    assert (above.is_true, above.title, side.title) == (
        True,
        "Radar map from above (fig. 17)",
        "Radar map from the side (fig. 18)",
    )
    # Of the two above each other one is right, which is what is seen from above.
    assert len(drawn["voxels within 2 m of a surface"].x) == 10
    assert (drawn["voxels farther away"].x, drawn["voxels farther away"].y) == ((0.0,), (10.0,))
    assert drawn["28 m from the start, as printed"].printed

    tops = by_name(side)["top of what stands there"]
    height = dict(zip(tops.x, tops.y, strict=True))
    assert height[30.0] == pytest.approx(6.0, abs=0.01)
    assert height[20.0] == pytest.approx(0.0, abs=0.01)

    drawn = by_name(share)
    counted = drawn["radar: recall"]
    assert dict(zip(counted.x, counted.y, strict=True))[NEAR_M["radar"]] == pytest.approx(90.0)
    assert counted.y[-1] == 100.0
    assert map_charts((blind,), flown_past(), there, figures=("", ""), begins_north_m=None) == ()


def test_a_crown_is_round_and_a_turned_house_is_deeper() -> None:
    there = world(
        tree("tree", (0.0, 10.0), 8.0, 2.0, 2.0),
        box("turned", (0.0, 40.0), (10.0, 2.0, 5.0), heading_deg=90.0),
    )
    top = skyline(there, np.array([10.0, 11.5, 13.0, 36.0, 44.0, 46.0]))
    assert top == pytest.approx([8.0, 5.0 + 3.0 * math.sqrt(1 - 0.75**2), 0.0, 5.0, 5.0, 0.0], abs=0.02)


def test_memory_is_drawn_by_what_is_new() -> None:
    (one,) = growth_chart([Look(0.0, 0, 1_000_000, 0), Look(5.0, 4000, 3_000_000, 0)]).series
    assert (one.x, one.y) == ((0.0, 4.0), (1.0, 3.0))
