"""What ``plan`` and ``survey`` share: reading, planning, writing, answering."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import typer

from planning.missions.vehicle_profile import load_profile
from planning.model import VehicleProfile
from planning.plan import Plan, plan_mission
from planning.report.exports import FILES, export_file
from planning.report.summary import plan_summary
from planning.report.words import duration, metres
from planning.request import PlanRequest
from planning.terrain.dsm import SurfaceModel
from server.cli.shared.files_in_out import check_directory, write_files
from server.cli.shared.output import DONE, FAILED, end_progress, harmless, print_json, progress, say
from server.cli.shared.terrain_given import ModelOptions, open_model
from server.cli.shared.verdict import verdict_lines
from server.work.clocks import StepTimer, utc_now


def profile_with(name: str, **overrides: float | int | None) -> VehicleProfile:
    """The named profile with the options that were given."""
    return replace(load_profile(name), **{key: value for key, value in overrides.items() if value is not None})


def run(
    dsm_file: Path,
    out: Path,
    request_for: Callable[[SurfaceModel], PlanRequest],
    *,
    title: str,
    as_json: bool,
    model: ModelOptions,
) -> None:
    """Plans, writes every file, says what came of it, and ends with 0 (certified and feasible) or 1."""
    check_directory(out)
    timer = StepTimer(progress)
    opened = open_model(dsm_file, timer, model)
    source = opened.model
    plan = plan_mission(source, request_for(source), report=timer, assumptions=opened.made)
    seconds = timer.seconds()
    opened.say_spikes(plan.ground)
    progress("Writing the files", None)
    created_utc = utc_now()
    files = {
        name: export_file(name, plan, source, title=title, created_utc=created_utc, seconds=seconds) for name in FILES
    }
    write_files(out, files)
    end_progress()
    _answer(plan, source, out, seconds, as_json=as_json)
    raise typer.Exit(DONE if plan.certificate.certified and plan.feasibility.feasible else FAILED)


def _answer(plan: Plan, source: SurfaceModel, out: Path, seconds: dict[str, float], *, as_json: bool) -> None:
    summary = {**plan_summary(plan, source), "seconds": seconds}
    for warning in plan.warnings:
        say(f"Note: {warning}")
    if as_json:
        print_json(summary)
        return
    lines = verdict_lines(summary)
    lines.append(
        f"  {metres(summary['length_m'], 0)} long, {duration(summary['duration_s'])} of the "
        f"{duration(summary['usable_endurance_s'])} the battery gives, "
        f"{summary['items']} of {summary['max_items']} items ({summary['waypoints']} waypoints)"
    )
    lines.append(f"Written to {harmless(str(out))}: {', '.join(FILES)}")
    typer.echo("\n".join(lines))
