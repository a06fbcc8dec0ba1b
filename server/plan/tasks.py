"""What the workers do: whole jobs, called by name in a process of their own.

Each takes ``report(step, share)``. Surface models are opened by directory and kept open, because the next
edit asks about the same one.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from planning import __version__
from planning.basics.plan_model import Poi, VehicleProfile, finite_or_none
from planning.evading.seen import columns_from_voxels
from planning.ground.demo_hillside import small_hill
from planning.planner.plan import Plan, plan_mission, plan_trade
from planning.planner.request import PlanRequest
from planning.report.exports import export_file
from planning.report.summary import plan_summary
from planning.route.camera import gsd_cm
from planning.route.visiting_order import shortest_order
from planning.terrain.dsm import Dsm
from server.errors import NotReadyError
from server.library.documents import request_from_doc
from server.library.orthophotos import load_orthophoto
from server.library.planned_on import other_model
from server.library.seen_columns import (
    SeenColumns,
    check_home_stands_on_ground,
    load_planned_terrain,
    load_seen,
    store_seen,
)
from server.library.terrains import load_terrain
from server.plan.cloud_points import read_points
from server.plan.profile_chart import chart
from server.scene.geometry.payload import PlanScene, PointsScene, TerrainScene
from server.scene.geometry.relief import kept_within, relief
from server.scene.geometry.terrain_payload import Shading, build_points_scene, build_terrain_scene
from server.scene.mirror import Voxels
from server.schemas import (
    BetterHomeDoc,
    DetourDoc,
    FenceVerdictDoc,
    HomeDoc,
    PlanDoc,
    ReasonDoc,
    ResultDoc,
    SurveyResult,
    TradeRow,
    WorstDoc,
)
from server.work.clocks import READ_STEP, StepTimer
from server.work.jobs import Progress
from telemetry.topics.vehicle import HomePlace, VehicleState

PATH_TOLERANCE_M = 0.02
"""Between the path and the line that is drawn."""
PRODUCT_VERSION = __version__


def warm_up(*, report: Progress) -> None:
    """Loads, or compiles for the first time, what the first edit and the first picture would wait for."""
    report("Getting ready", None)
    dsm = small_hill()
    west, south, _, _ = dsm.bounds_m
    places = dsm.lat_lon_from_xy(np.array([(west + 30, south + 30), (west + 90, south + 80)]))
    pois = tuple(Poi(lat, lon) for lat, lon in places.tolist())
    plan_scene(plan_mission(dsm, PlanRequest(pois=pois, profile=VehicleProfile("warm-up"))))
    build_terrain_scene("warm-up", dsm, shading="height", orthophoto=None)


def order_points(xy_m: F64, *, report: Progress) -> list[int]:
    """The shortest order of points (N, 2): minutes of work for hundreds of them."""
    report("Ordering the points", None)
    return shortest_order(xy_m)


class _LastPlan:
    """The plan made last: its trade table and its files are asked for right after it."""

    def __init__(self) -> None:
        self._key: tuple[Path, PlanDoc] | None = None
        self._made: tuple[Plan, Dsm, dict[str, float]] | None = None

    def of(self, directory: Path, document: PlanDoc, report: Progress) -> tuple[Plan, Dsm, dict[str, float]]:
        """(plan, surface model, seconds per step)"""
        if self._made is None or self._key != (directory, document):
            # Dropped first: two plans over a model of 132 Mpx would take twice the memory.
            self._key = self._made = None
            self._made, self._key = _plan(directory, document, report), (directory, document)
        return self._made


last_plan = _LastPlan()
"""Of this worker: whoever needs the very plan that is on show asks here."""


@lru_cache(maxsize=2)
def _terrain(directory: Path) -> Dsm:
    return load_terrain(directory)


@lru_cache(maxsize=1)
def _terrain_with_seen(directory: Path, seen_id: str) -> tuple[Dsm, int]:
    return load_planned_terrain(directory, seen_id), load_seen(directory, seen_id).count


@lru_cache(maxsize=8)
def _check_home(directory: Path, seen_id: str, home_lat_lon_deg: tuple[float, float]) -> None:
    """Once for each home: it reads the model as it came."""
    check_home_stands_on_ground(directory, _terrain_with_seen(directory, seen_id)[0], home_lat_lon_deg)


def compute_plan(directory: Path, document: PlanDoc, *, report: Progress) -> tuple[ResultDoc, PlanScene]:
    """The answer to an edit, without the trade table."""
    plan, source, seconds = last_plan.of(directory, document, report)
    seen = 0 if document.seen_id is None else _terrain_with_seen(directory, document.seen_id)[1]
    answer = result_doc(plan, source, seconds, seen)
    return answer.model_copy(update={"other_surface": other_model(document, source)}), plan_scene(plan)


def compute_trade(directory: Path, document: PlanDoc, *, report: Progress) -> list[TradeRow]:
    """Waypoints, items and duration for a ladder of excess heights."""
    plan, _, _ = last_plan.of(directory, document, report)
    report("Comparing", None)
    return [
        TradeRow(
            excess_height_m=choice.excess_height_m,
            waypoints=choice.waypoints,
            items=choice.items,
            duration_s=choice.duration_s,
        )
        for choice in plan_trade(plan)
    ]


def export_plan(
    directory: Path, document: PlanDoc, names: list[str], created_utc: str, *, report: Progress
) -> dict[str, bytes]:
    """The files of the plan, computed from the very document that is exported."""
    plan, source, seconds = last_plan.of(directory, document, report)
    report("Exporting", None)
    return {
        name: export_file(name, plan, source, title=document.name, created_utc=created_utc, seconds=seconds).encode()
        for name in names
    }


def draw_terrain(
    terrain_id: str, directory: Path, photo_directory: Path | None, shading: Shading, *, report: Progress
) -> TerrainScene:
    """The surface model as the 3D view draws it."""
    photo = None if photo_directory is None else load_orthophoto(photo_directory)
    return build_terrain_scene(terrain_id, _terrain(directory), shading=shading, orthophoto=photo, report=report)


def draw_points(terrain_id: str, directory: Path, low_m: float, high_m: float, *, report: Progress) -> PointsScene:
    """The points of a surface model's cloud as the 3D view draws them."""
    report("Drawing the points", None)
    return build_points_scene(terrain_id, _terrain(directory), read_points(directory), low_m=low_m, high_m=high_m)


def _plan(directory: Path, document: PlanDoc, report: Progress) -> tuple[Plan, Dsm, dict[str, float]]:
    timer = StepTimer(report)
    timer(READ_STEP, 0.0)
    if document.seen_id is None:
        source, columns = _terrain(directory), 0
    else:
        source, columns = _terrain_with_seen(directory, document.seen_id)
    request = request_from_doc(document, source)
    if document.seen_id is not None and request.home_lat_lon_deg is not None:
        _check_home(directory, document.seen_id, request.home_lat_lon_deg)
    plan = plan_mission(source, request, report=timer)
    if document.seen_id is not None and request.home_lat_lon_deg is None:
        _check_home(directory, document.seen_id, (plan.mission.home.lat_deg, plan.mission.home.lon_deg))
    return (plan if not columns else with_seen(plan, columns)), source, timer.seconds()


def with_seen(plan: Plan, columns: int) -> Plan:
    """Says so wherever the plan's warnings go: console, report and exported files."""
    text = f"The surface model was raised at {columns} places by what radar and camera saw in flight."
    return replace(plan, warnings=(text, *plan.warnings))


def result_doc(plan: Plan, source: Dsm, seconds: dict[str, float], seen_columns: int = 0) -> ResultDoc:
    """A plan's figures as the console shows them."""
    certificate, summary = plan.certificate, plan_summary(plan, source)
    worst = summary["worst"]
    gsd_min, gsd_max = _gsd_range_cm(plan)
    return ResultDoc(
        **{key: summary[key] for key in _SUMMARY_KEYS},
        worst=None if worst is None else WorstDoc(**worst, s_m=certificate.worst.s_m),
        max_height_above_ground_m=finite_or_none(certificate.max_height_above_ground_m),
        reasons=[ReasonDoc(code=r.code, text=r.text, mend=r.mend) for r in certificate.reasons],
        fence=None if summary["fence"] is None else FenceVerdictDoc(**summary["fence"]),
        detours=[DetourDoc(**each) for each in summary["detours"]],
        survey=None if summary["survey"] is None else SurveyResult(**summary["survey"]),
        gsd_min_cm=gsd_min,
        gsd_max_cm=gsd_max,
        home=_home_doc(plan),
        home_alt_dsm_m=plan.line.home_alt_dsm_m,
        vertical_datum=source.vertical_datum,
        seen_columns=seen_columns,
        trade=[],
        chart=chart(plan),
        seconds=seconds,
    )


def _home_doc(plan: Plan) -> HomeDoc | None:
    stand, home = plan.certificate.home, plan.mission.home
    if stand is None:
        return None
    return HomeDoc(
        lat_deg=home.lat_deg,
        lon_deg=home.lon_deg,
        chosen=plan.request.home_lat_lon_deg is None,
        drop_m=finite_or_none(stand.drop_m),
        reach_m=stand.reach_m,
        min_distance_m=finite_or_none(stand.min_distance_m),
        better=None if stand.better is None else BetterHomeDoc(**asdict(stand.better)),
    )


_SUMMARY_KEYS = (
    "certified",
    "feasible",
    "feasibility",
    "min_distance_m",
    "min_vertical_m",
    "required_clearance_m",
    "clearance_budget",
    "tube",
    "rtl_height_needed_m",
    "rtl_height_m",
    "home_column_clear",
    "warnings",
    "length_m",
    "duration_s",
    "lspb_duration_s",
    "endurance_s",
    "usable_endurance_s",
    "samples",
    "waypoints",
    "items",
    "max_items",
    "excess_height_m",
)


def _gsd_range_cm(plan: Plan) -> tuple[float | None, float | None]:
    """Ground sampling distance from the lowest to the highest place above ground (eq 1)."""
    camera = plan.request.profile.camera
    above_m = (plan.path.alt_dsm_m - plan.path.ground_alt_dsm_m)[np.isfinite(plan.path.ground_alt_dsm_m)]
    if camera is None or above_m.size == 0:
        return None, None
    return gsd_cm(camera, float(above_m.min())), gsd_cm(camera, float(above_m.max()))


def plan_scene(plan: Plan) -> PlanScene:
    path, line, worst = plan.path, plan.line, plan.certificate.worst
    around_m = np.column_stack([path.xy_m, path.alt_dsm_m])[path.vertex[plan.detour_vertices]]
    keep = kept_within(path.s_m, path.alt_dsm_m, PATH_TOLERANCE_M, must_keep=path.vertex)
    return PlanScene(
        safe_surface=relief(plan.surfaces, path),
        path_m=np.column_stack([path.xy_m[keep], path.alt_dsm_m[keep]]),
        path_s_m=path.s_m[keep],
        path_ground_alt_dsm_m=path.ground_alt_dsm_m[keep],
        flown_m=line.points_m,
        flown_distance_m=np.array([leg.min_distance_m for leg in plan.certificate.legs]),
        worst_m=np.array([worst.x_m, worst.y_m, worst.alt_dsm_m]),
        required_clearance_m=plan.certificate.required_clearance_m,
        home_m=np.array([*line.home_xy_m, line.home_alt_dsm_m]),
        takeoff_alt_dsm_m=line.takeoff_alt_dsm_m,
        around_m=around_m,
        around=tuple(detour.shape for detour in plan.detours),
    )


def keep_seen(
    directory: Path,
    maps: list[Voxels],
    state: VehicleState | None = None,
    took_off: HomePlace | None = None,
    *,
    report: Progress,
) -> str:
    """Makes columns of what the maps do not explain; the id under which they are kept beside the model.

    ``state``: of the vehicle that has seen it, ``took_off``: home that its flight began with; without a vehicle maps
    were begun under a home on the ground. Raises NotReadyError, and NotAllowedError where nobody knows how high it is.
    """
    from telemetry.flight.home_height import home_on_ground, up_zero_m

    report("Taking in what was seen", None)
    dsm = load_terrain(directory)
    origins = [voxels.origin for voxels in maps if voxels.origin is not None]
    home = None if state is None else home_on_ground(origins, took_off, state)
    columns = []
    for voxels in maps:
        origin = voxels.origin
        assert origin is not None
        under = home or HomePlace(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
        home_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([[under.lat_deg, under.lon_deg]])))[0])
        if not np.isfinite(home_m):
            raise NotReadyError(
                "The vehicle took off where this plan's surface model knows nothing.",
                advice="Open the plan that is flown.",
            )
        frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
        centres = voxels.centres_enu_m[~voxels.explained]
        zero_m = up_zero_m(dsm, under, origin)
        columns.append(columns_from_voxels(centres, voxels.resolution_m, frame=frame, dsm=dsm, home_alt_dsm_m=zero_m))
    return store_seen(directory, SeenColumns(tuple(columns)))
