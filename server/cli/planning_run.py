"""What ``plan`` and ``survey`` share: reading, planning, writing, answering."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import typer

from planning.dsm import Dsm
from planning.errors import ParameterError
from planning.exports import FILES, export_file
from planning.geotiff import read_dsm_reported
from planning.model import VehicleProfile
from planning.plan import Plan, plan_mission
from planning.request import PlanRequest
from planning.summary import plan_summary
from planning.vehicle_profile import load_profile
from server.cli.output import DONE, FAILED, end_progress, print_json, progress, say, verdict_lines, write_files
from server.clock import utc_now
from server.stopwatch import READ_STEP, StepTimer


def read_model(
    path: Path, timer: StepTimer, *, crs: str | None, z_scale: float | None, vertical_datum: str | None
) -> Dsm:
    """The surface model; what is remarkable about it goes to stderr."""
    timer(READ_STEP, 0.0)
    dsm, report = read_dsm_reported(
        path,
        crs=crs,
        z_scale=z_scale,
        vertical_datum=vertical_datum,
        progress=lambda stage, share: timer(READ_STEP, share),
    )
    end_progress()
    for warning in report.warnings:
        say(f"Note: {warning}")
    for spike in report.spikes:
        say(
            f"Note: isolated {spike.kind} of {spike.height_m:.1f} m, {spike.size_m:.1f} m wide, "
            f"at {spike.lat_deg:.7f}, {spike.lon_deg:.7f}: kept as terrain."
        )
    return dsm


def profile_with(name: str, **overrides: float | int | None) -> VehicleProfile:
    """The named profile with the options that were given."""
    return replace(load_profile(name), **{key: value for key, value in overrides.items() if value is not None})


def parse_home(text: str | None) -> tuple[float, float] | None:
    """ "LAT,LON" in degrees."""
    if text is None:
        return None
    try:
        lat_deg, lon_deg = (float(part) for part in text.split(","))
    except ValueError:
        raise ParameterError(f"Home {text!r} is no place.", where="--home", advice="Give LAT,LON in degrees.") from None
    return lat_deg, lon_deg


def run(
    dsm_file: Path,
    out: Path,
    request_for: Callable[[Dsm], PlanRequest],
    *,
    title: str,
    as_json: bool,
    crs: str | None,
    z_scale: float | None,
    vertical_datum: str | None,
) -> None:
    """Plans, writes every file, says what came of it, and ends with 0 (certified) or 1."""
    timer = StepTimer(progress)
    source = read_model(dsm_file, timer, crs=crs, z_scale=z_scale, vertical_datum=vertical_datum)
    plan = plan_mission(source, request_for(source), report=timer)
    seconds = timer.seconds()
    end_progress()
    created_utc = utc_now()
    write_files(
        out,
        {
            name: export_file(name, plan, source, title=title, created_utc=created_utc, seconds=seconds)
            for name in FILES
        },
    )
    _answer(plan, source, out, seconds, as_json=as_json)
    raise typer.Exit(DONE if plan.certificate.certified else FAILED)


def _answer(plan: Plan, source: Dsm, out: Path, seconds: dict[str, float], *, as_json: bool) -> None:
    summary = {**plan_summary(plan, source), "seconds": seconds}
    for warning in plan.warnings:
        say(f"Note: {warning}")
    if as_json:
        print_json(summary)
        return
    typer.echo("\n".join(verdict_lines(summary)))
    typer.echo(
        f"  {summary['length_m']:.0f} m, {summary['duration_s']:.0f} s of {summary['usable_endurance_s']:.0f} s, "
        f"{summary['items']} of {summary['max_items']} items"
    )
    typer.echo(f"Written to {out}: {', '.join(FILES)}")
