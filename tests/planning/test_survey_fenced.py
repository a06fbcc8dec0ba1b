"""A survey's lines within a fence: what is left may be flown, and what may be flown is left, by dense samples."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planning.basics.plan_model import Poi
from planning.errors import PoiError
from planning.fence.fence_model import Fence, circle
from planning.fence.grown_zones import ROUNDING_M, Flat
from planning.ground.demo_hillside import demo_dsm, demo_survey_polygon
from planning.missions.vehicle_profile import load_profile, path_params
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest, survey_request
from planning.route.around_fence import Kept
from planning.route.poi import MIN_APART_M
from planning.route.survey import survey_lines
from planning.route.survey_fenced import fenced_lines, lines_m
from tests.planning.test_around_fence import FLAT, HOME, HOME_XY_M, MARGIN_M, at, disc, ring
from tests.reference.fence import nearest_m, plane_about, swept_places, xy_of

STEP_M, SLACK_M = 2.0, 0.5


def lines(*ends_m: tuple[float, float]) -> tuple[Poi, ...]:
    return tuple(Poi(*at(*end), f"end {k}") for k, end in enumerate(ends_m))


def left(fence: Fence, pois: tuple[Poi, ...], *, ways_back: bool = True) -> tuple[Poi, ...]:
    return fenced_lines(FLAT, pois, Kept(fence, HOME, (), MARGIN_M, 3.0), ways_back=ways_back)


def places_m(pois: tuple[Poi, ...]) -> np.ndarray:
    return FLAT.xy_from_lat_lon(np.array([(poi.lat_deg, poi.lon_deg) for poi in pois])) - HOME_XY_M


def test_lines_that_the_fence_lets_be_stay_to_the_bit() -> None:
    pois = lines((-40, 30), (40, 30), (40, 40), (-40, 40))
    assert left(Fence(circles=(disc(0.0, -60.0, 10.0),)), pois) == pois


def test_a_line_through_an_exclusion_is_parted_and_keeps_its_direction_and_names() -> None:
    fence = Fence((ring((-5, 20), (5, 20), (5, 40), (-5, 40)),))
    got = left(fence, lines((40, 30), (-40, 30)), ways_back=False)
    assert [poi.name for poi in got] == ["end 0", "end 1"] * 2
    assert places_m(got)[:, 0] == pytest.approx([40.0, 5.0 + MARGIN_M, -5.0 - MARGIN_M, -40.0], abs=0.1)


def test_what_home_does_not_see_past_the_exclusion_is_left_out_too() -> None:
    fence = Fence((ring((-5, 20), (5, 20), (5, 25), (-5, 25)),))
    pois = lines((-40, 60), (40, 60))
    assert left(fence, pois, ways_back=False) == pois
    seen = places_m(left(fence, pois))
    reach_m = 60.0 * (5.0 + MARGIN_M) / (20.0 - MARGIN_M)
    assert len(seen) == 4
    assert seen[1, 0] < -0.7 * reach_m
    assert seen[2, 0] > 0.7 * reach_m


def test_lines_end_at_an_inclusion_circle() -> None:
    got = places_m(left(Fence(circles=(disc(0.0, 0.0, 40.0, inclusion=True),)), lines((-60, 10), (60, 10))))
    reach_m = math.sqrt((40.0 * 0.993 - MARGIN_M) ** 2 - 10.0**2)
    assert got[:, 0] == pytest.approx([-reach_m, reach_m], abs=0.1)


def test_a_fence_that_leaves_nothing_is_told() -> None:
    with pytest.raises(PoiError, match="leaves nothing of the survey"):
        left(Fence(circles=(disc(0.0, 40.0, 30.0),)), lines((-10, 40), (10, 40)))


def test_against_dense_samples_nothing_forbidden_is_left_and_nothing_free_is_lost() -> None:
    plane, kept_parts = plane_about(HOME), 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        shapes = tuple(
            disc(float(east), float(north), float(rng.uniform(2, 12))) for east, north in rng.uniform(-50, 50, (3, 2))
        )
        inclusion = ring((-70, -60), (75, -65), (70, 70), (5, 30), (-65, 68), inclusion=True)
        fence = Fence((inclusion,) if rng.random() < 0.5 else (), shapes)
        ends_m = rng.uniform(-60.0, 60.0, (4, 2))
        if nearest_m(fence, np.zeros((1, 2)), plane) < MARGIN_M + SLACK_M:
            continue
        try:
            got = left(fence, lines(*map(tuple, ends_m)))
        except PoiError:
            got = ()
        parts = xy_of(plane, [(poi.lat_deg, poi.lon_deg) for poi in got]).reshape(-1, 2, 2)
        for a, b in parts:
            assert nearest_m(fence, swept_places(np.stack([a, b]), np.zeros((1, 2)), STEP_M), plane) >= MARGIN_M, seed
        kept_parts += len(parts)
        for a, b in ends_m.reshape(-1, 2, 2):
            for share in np.linspace(0.02, 0.98, 25):
                place = xy_of(plane, [at(*(a + share * (b - a)))])
                way = swept_places(np.repeat(place, 2, axis=0), np.zeros((1, 2)), 0.3)
                on_part = [_between(place[0], p, q) for p, q in parts]
                if nearest_m(fence, way, plane) > MARGIN_M + 2.0:
                    assert any(on_part), (seed, share)
    assert kept_parts > 60


def _between(place: np.ndarray, p: np.ndarray, q: np.ndarray) -> bool:
    return bool(np.linalg.norm(place - p) + np.linalg.norm(place - q) < np.linalg.norm(q - p) + 0.01)


def test_a_survey_around_a_kept_out_place_is_certified_and_says_what_it_loses() -> None:
    dsm, profile = demo_dsm(), load_profile("mapper-rtk")
    pattern = survey_lines(
        demo_survey_polygon(), dsm, camera=profile.camera, gsd_cm=1.0, side_overlap=0.7, front_overlap=0.8
    )
    request = survey_request(PlanRequest(pois=(), profile=profile, path=path_params(profile)), pattern)
    ends = np.array([(poi.lat_deg, poi.lon_deg) for poi in pattern.pois])
    middle = tuple(float(each) for each in ends.mean(axis=0))
    exclusion = circle(middle[0], middle[1], 8.0, inclusion=False, where="test")
    plan = plan_mission(dsm, replace(request, fence=Fence(circles=(exclusion,))))
    assert plan.certificate.fence is not None
    assert plan.certificate.fence.keeps
    assert plan.detours
    left_m, whole_m = lines_m(dsm, plan.request.pois), lines_m(dsm, pattern.pois)
    assert left_m < whole_m
    assert any(f"leaves {left_m:.0f} m of the survey's {whole_m:.0f} m" in said for said in plan.warnings)
    assert plan.coverage is not None


def test_a_line_that_only_grazes_what_is_forbidden_is_parted_into_ends_that_can_be_told_apart() -> None:
    """The corner of a square that stands on it, with a margin of nothing."""
    fence, cuts_m = Fence((ring((0, 30), (8, 38), (0, 46), (-8, 38)),)), []
    for north_m in np.linspace(30.0 - ROUNDING_M - 0.01, 30.1, 60).tolist():
        pois = lines((-40, north_m), (40, north_m))
        got = fenced_lines(FLAT, pois, Kept(fence, HOME, (), 0.0, 3.0), ways_back=False)
        apart_m = np.linalg.norm(np.diff(places_m(got), axis=0), axis=1).tolist()
        assert sum(apart_m) == pytest.approx(80.0, abs=0.01)
        cuts_m += apart_m[1:2]
    assert len(cuts_m) > 40
    assert 0.1 < cuts_m[0] < 0.2
    assert min(cuts_m) > MIN_APART_M


def test_every_part_of_all_lines_is_held_against_a_shape_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    room_m = Flat.room_m

    def counted(flat: Flat, places: np.ndarray) -> np.ndarray:
        asked.append(len(places))
        return room_m(flat, places)

    shapes = (disc(0.0, 30.0, 3.0), disc(20.0, 40.0, 3.0))
    pois = lines((-40, 30), (40, 30), (40, 40), (-40, 40), (-40, 50), (40, 50))
    monkeypatch.setattr(Flat, "room_m", counted)
    got = left(Fence(circles=shapes), pois, ways_back=False)
    assert len(got) == 10
    assert asked[-2:] == [5, 5]
    assert 1 not in asked[-len(shapes) :]
