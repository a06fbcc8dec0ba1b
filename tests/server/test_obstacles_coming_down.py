"""After a climb: the rest is planned again past what was seen, certified and flown, or it stays higher and says why."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from planning.basics.plan_model import VehicleProfile
from planning.formats.wpl import read_wpl
from planning.terrain.dsm import Dsm
from server.library.documents import doc_from_profile
from server.obstacles import coming_down
from server.obstacles.coming_down import ComingDown
from server.obstacles.coming_down_task import SHADOW_M, RestPlanned, burned, plan_rest, with_shadow
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.obstacle_watch import Watch
from server.scene.mirror import MapMirror
from server.schemas import PlanDoc, SurfaceDoc
from telemetry.errors import NotAllowedError
from telemetry.topics.messages import GuidedTarget, PlanRecord
from telemetry.topics.obstacles import AvoidanceStatus, MapOrigin, PerceptionSettings
from telemetry.topics.requests import FlyRest, Operator
from telemetry.topics.vehicle import HomePlace, VehicleState
from tests.server.fakes import Told
from tests.server.obstacle_messages import delta
from tests.server.test_obstacles_manoeuvre_task import planned, situation  # noqa: F401

Planned = tuple[Dsm, PlanRecord, Path]


def rest_of(there: Situation) -> RestPlanned:
    return plan_rest(there, report=lambda step, share: None)


def underway(there: Situation) -> Situation:
    """Climbed beside the wall, and going on higher."""
    state = replace(there.state, landed="in_air", heading_rad=np.pi / 2, v_east_m_s=3.0, v_north_m_s=0.0)
    document = PlanDoc(
        terrain_id=there.record.terrain_id,
        profile=doc_from_profile(VehicleProfile("quad", position_error_m=0.1)),
        surface=SurfaceDoc(radius_m=4.0, height_m=3.0),
    )
    record = replace(there.record, plan_json=document.model_dump_json())
    took_off = HomePlace(there.origin.lat_deg, there.origin.lon_deg, there.origin.alt_amsl_m)
    return replace(there, state=state, height_offset_m=12.0, record=record, took_off=took_off)


def test_the_rest_is_planned_over_the_wall_and_its_shadow_and_down_to_its_proper_height(planned: Planned) -> None:  # noqa: F811
    there = underway(situation(planned, 6))
    rest = rest_of(there)
    assert rest.why == ""
    model = burned(planned[0], there.maps, there.state, there.took_off)
    mission = read_wpl(there.record.mission_wpl)
    places = model.xy_from_lat_lon(np.array([[t.lat_deg, t.lon_deg] for t in rest.targets]))
    ups = np.array([t.alt_rel_home_m for t in rest.targets])
    required_m = 0.5
    line = np.concatenate(
        [
            np.column_stack([np.linspace(a, b, 200), np.linspace(x, y, 200)])
            for a, b, x, y in zip(places[:-1], places[1:], ups[:-1], ups[1:], strict=True)
        ]
    )
    ground_m = model.elevation_at(line[:, :2]) - mission.home.alt_dsm_m
    assert (line[:, 2] - ground_m).min() > required_m
    raised = model.elevation_m > planned[0].elevation_m + 0.5
    columns = np.flatnonzero(raised.any(axis=0)) * model.resolution_m
    assert columns.max() - columns.min() >= SHADOW_M, "what nobody saw is behind the wall"
    items = [t.item for t in rest.targets]
    assert items == sorted(items)
    assert items[-1] <= len(mission.items)
    assert ups[-1] < ups.max() - 2.0, "behind the wall it is lower again"


def test_what_cannot_be_certified_stays_higher_and_says_why(planned: Planned) -> None:  # noqa: F811
    there = underway(situation(planned, 6))
    on_ground = replace(there, state=replace(there.state, landed="on_ground"))
    assert rest_of(on_ground) == RestPlanned(why="No mission is being flown.")
    unknown = replace(there, record=replace(there.record, plan_json=""))
    assert rest_of(unknown).why == "The plan that is flown is not known here."
    lost = replace(there, state=replace(there.state, lat_deg=0.0, lon_deg=0.0))
    assert rest_of(lost).targets == ()
    assert rest_of(lost).why


HOME_M = 900.0


@pytest.mark.parametrize("home_up_m", [30.0, 1.2, 0.0, -1.2], ids=["set at the vehicle", "up", "as it was", "down"])
def test_what_was_seen_stands_as_high_whichever_home_its_map_was_begun_under(
    planned: Planned,  # noqa: F811
    home_up_m: float,
) -> None:
    """A crane 25 m high. Its map counts from a home that lies so much above the ground, or below it."""
    dsm = planned[0]
    here, there = (dsm.lat_lon_from_xy(np.array([[x, 3_999_945.0]]))[0].tolist() for x in (500_008.0, 500_020.0))
    took_off = HomePlace(here[0], here[1], HOME_M)
    origin = MapOrigin(here[0], here[1], HOME_M + home_up_m)
    crane_xy = np.array([[500_038.5, 3_999_945.5]])
    ground_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([here])))[0])
    mirror = MapMirror("vision")
    top = int(np.floor(24.5 - home_up_m))
    mirror.fold(delta([(30, 0, up) for up in range(top - 5, top + 1)], origin=origin, whole=True))
    state = VehicleState(1, 1, armed=True, landed="in_air", lat_deg=there[0], lon_deg=there[1])
    for now_m in (HOME_M, HOME_M + home_up_m):  # set back since, or not
        now = replace(state, home_lat_deg=here[0], home_lon_deg=here[1], home_alt_amsl_m=now_m)
        model = burned(dsm, (mirror.voxels(),), now, took_off)
        over_m = float(model.elevation_at(crane_xy)[0]) - ground_m
        assert 25.0 <= over_m <= 26.5, f"it stands {over_m:.1f} m high"


def test_how_high_things_stand_that_were_seen_under_another_home_is_refused_where_the_take_off_was_not_heard(
    planned: Planned,  # noqa: F811
) -> None:
    there = underway(situation(planned, 6))
    lat_deg, lon_deg = there.origin.lat_deg, there.origin.lon_deg
    told = {"home_lat_deg": lat_deg, "home_lon_deg": lon_deg, "home_alt_amsl_m": there.origin.alt_amsl_m}
    same = replace(there.state, **told)
    heard = burned(planned[0], there.maps, same, there.took_off)
    assert np.array_equal(burned(planned[0], there.maps, same, None).elevation_m, heard.elevation_m, equal_nan=True)
    moved = replace(same, home_alt_amsl_m=there.origin.alt_amsl_m - 0.6)
    with pytest.raises(NotAllowedError, match="seen under another home"):
        burned(planned[0], there.maps, moved, None)
    assert "seen under another home" in rest_of(replace(there, state=moved, took_off=None)).why
    with pytest.raises(NotAllowedError, match="does not tell its home"):
        burned(planned[0], there.maps, there.state, None)
    with pytest.raises(NotAllowedError, match="no height at the home"):
        burned(planned[0], there.maps, same, HomePlace(lat_deg + 1.0, lon_deg, 900.0))
    assert burned(planned[0], (), there.state, None) is planned[0]


def test_a_shadow_is_as_high_as_what_casts_it_and_lies_ahead() -> None:
    from planning.evading.seen import Columns

    cast = with_shadow(Columns(np.array([[0.0, 0.0]]), np.array([7.0]), 1.0), np.array([0.0, 1.0]))
    assert cast.xy_m[:, 1].max() == pytest.approx(SHADOW_M)
    assert set(cast.top_alt_dsm_m) == {7.0}
    assert np.abs(cast.xy_m[:, 0]).max() == 0.0


TARGETS = (GuidedTarget(2, 37.7, 15.0, 30.0, 3.0), GuidedTarget(3, 37.7, 15.1, 20.0, 3.0))
HIGHER = AvoidanceStatus(enabled=True, state="offset", height_offset_m=9.0)


class Link:
    def __init__(self, watch: Watch, error: Exception | None = None) -> None:
        self.watch, self.error, self.asked = watch, error, list[Any]()

    async def call(self, request: Any) -> Any:
        self.asked.append(request)
        if self.error is not None:
            raise self.error
        self.watch.on_avoidance(replace(HIGHER, height_offset_m=0.0))


def run(
    answer: RestPlanned, *, comes_down: bool = True, error: Exception | None = None, rounds: int = 3
) -> tuple[Watch, list[Any]]:
    """After so many rounds: one in which it stays higher is followed by a long pause."""
    watch = Watch("live", Told())
    watch.on_settings(PerceptionSettings(comes_down=comes_down))
    watch.on_avoidance(HIGHER)
    link, plans = Link(watch, error), list[Any]()

    async def known() -> object:
        return object()

    async def plan(_task: Any, there: Any) -> RestPlanned:
        plans.append(there)
        return answer

    around: Any = SimpleNamespace(watch=watch, situation=known)
    lane: Any = SimpleNamespace(call=plan)
    lease: Any = SimpleNamespace(server_operator=lambda: Operator("server", 3))
    down, said = ComingDown(around, cast(Any, link), lane, lease), list[str]()
    refresh = watch.refresh

    def told() -> None:
        said.append(watch.stays_higher)
        refresh()

    watch.refresh = told  # type: ignore[method-assign]

    async def whole() -> None:
        task = asyncio.ensure_future(down.run())
        async with asyncio.timeout(60):
            while len(said) < rounds:
                await asyncio.sleep(0.01)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(whole())
    return watch, link.asked


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coming_down, "LOOK_S", 0.01)


def test_a_certified_rest_is_flown_once() -> None:
    watch, asked = run(RestPlanned(TARGETS))
    assert asked == [FlyRest(Operator("server", 3), TARGETS)]
    assert watch.state.stays_higher == ""


def test_who_chose_to_stay_higher_does(planned: Planned) -> None:  # noqa: F811
    assert run(RestPlanned(TARGETS), comes_down=False)[1] == []


@pytest.mark.parametrize("error", [None, NotAllowedError("The way ahead is not seen to be clear.")])
def test_why_it_stays_higher_is_told(error: Exception | None) -> None:
    answer = RestPlanned(why="The way ahead is not seen to be clear.") if error is None else RestPlanned(TARGETS)
    watch, asked = run(answer, error=error, rounds=1)
    assert watch.state.stays_higher == "The way ahead is not seen to be clear."
    assert len(asked) == (error is not None)
