"""The files of a finished plan, by name, as text."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any, Literal, get_args

import numpy as np

from planning.certificate.clearance import certificate_json
from planning.formats import geojson, kml, qgc_plan, trajectory_csv, wpl
from planning.planner.plan import Plan, plan_trade
from planning.planner.request import effective_profile
from planning.report.report_page import ReportInput, TradeRow, render_report
from planning.report.summary import plan_summary
from planning.route.camera import gsd_cm
from planning.terrain.dsm import SurfaceModel

FileName = Literal[
    "trajectory.csv",
    "trajectory.kml",
    "mission.waypoints",
    "mission.plan",
    "mission.geojson",
    "certificate.json",
    "report.html",
]
FILES: tuple[FileName, ...] = get_args(FileName)


def export_file(
    name: str,
    plan: Plan,
    source: SurfaceModel,
    *,
    title: str = "Mission",
    created_utc: str | None = None,
    seconds: Mapping[str, float] | None = None,
) -> str:
    """One of ``FILES`` as text (UTF-8), certified or not: ``plan.certificate`` says which.

    ``source`` is the surface model as read. ``created_utc`` is ISO 8601, None: now; ``seconds`` are what each step of
    the computation took, for the report. Raises KeyError for another name.
    """
    if created_utc is None:
        created_utc = datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    seconds = dict(seconds or {})
    writers: dict[str, Callable[[], str]] = {
        "trajectory.csv": lambda: trajectory_csv.write_trajectory(plan.path, plan.timing, plan.mission.home, plan.dsm),
        "trajectory.kml": lambda: kml.write_kml(plan.path, plan.mission, plan.dsm, title=title),
        "mission.waypoints": lambda: wpl.write_wpl(plan.mission),
        "mission.plan": lambda: qgc_plan.write_plan(plan.mission),
        "mission.geojson": lambda: geojson.write_geojson(
            plan.path, plan.mission, plan.dsm, summary=_plain(plan_summary(plan, source))
        ),
        "certificate.json": lambda: json.dumps(
            {
                **certificate_json(plan.certificate),
                **plan_summary(plan, source),
                "seconds": seconds,
                "created_utc": created_utc,
            },
            indent=2,
            allow_nan=False,
        ),
        "report.html": lambda: render_report(report_input(plan, title=title, created_utc=created_utc, seconds=seconds)),
    }
    return writers[name]()


def report_input(plan: Plan, *, title: str, created_utc: str, seconds: dict[str, float]) -> ReportInput:
    """What the HTML report shows."""
    request, camera = plan.request, plan.request.profile.camera
    above_m = plan.path.alt_dsm_m - plan.path.ground_alt_dsm_m
    return ReportInput(
        title=title,
        dsm=plan.dsm,
        path=plan.path,
        timing=plan.timing,
        mission=plan.mission,
        line=plan.line,
        certificate=plan.certificate,
        profile=effective_profile(request.profile, request.path),
        surface=request.surface,
        feasibility=plan.feasibility,
        predicted_duration_s=plan.predicted.total_s,
        max_items=request.mission.max_items,
        created_utc=created_utc,
        gsd_cm=None if camera is None else gsd_cm(camera, float(np.nanmax(above_m))),
        coverage=plan.coverage,
        trade=[
            TradeRow(
                waypoints=choice.waypoints,
                excess_height_m=choice.excess_height_m,
                duration_s=choice.duration_s,
                chosen=choice.excess_height_m == request.mission.excess_height_m,
            )
            for choice in plan_trade(plan)
        ],
        warnings=plan.warnings,
        seconds=seconds,
    )


def _plain(summary: dict[str, Any]) -> dict[str, Any]:
    """Only the numbers and words; nested parts stay in the certificate."""
    return {key: value for key, value in summary.items() if not isinstance(value, dict | list)}
