"""``hedgehop survey``: a back-and-forth flight over a polygon, hugging the terrain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import typer
from typer import Argument, Option

from planning.errors import ParameterError, PoiError
from planning.formats.poi_files import read_pois
from planning.formats.safe_text import clean_name
from planning.planner.request import PlanRequest, survey_request
from planning.route.survey import MAX_LINES, SurveyPlan, survey_lines
from planning.terrain.dsm import SurfaceModel
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.fence_given import fence_given
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import say_notes
from server.cli.shared.planning_run import request_of, run, vehicle_of
from server.cli.surveys.planned_parts import AUTO, PartsOrder, plan_parts
from server.schemas.plan_docs import SurveyDoc
from server.work.cluster import check_where

_SURVEY = SurveyDoc()
_DEFAULTS = o.PlanOptions(vehicle=o.PlannedVehicle(profile="mapper-rtk"))


@dataclass(frozen=True, slots=True)
class PatternOptions:
    """The lines over the area."""

    PANEL: ClassVar = "Pattern"
    gsd_cm: Annotated[
        float | None, Option(help=f"Ground sampling distance; sets the height. Default {_SURVEY.gsd_cm:g} cm.")
    ] = None
    height_m: Annotated[float | None, Option(help="Height above the surface instead.")] = None
    side_overlap: Annotated[float, Option(help="Share between lines.")] = _SURVEY.side_overlap
    front_overlap: Annotated[float, Option(help="Share between photos.")] = _SURVEY.front_overlap
    angle_deg: Annotated[
        float | None, Option(help="Direction of the lines from grid north; default: fewest turns.")
    ] = None


@command
def survey(
    dsm: o.DsmFile,
    polygon: Annotated[Path, Argument(metavar="POLYGON", help="Area: GeoJSON or KML polygon.")],
    *,
    out: o.Out,
    parts: Annotated[
        str | None,
        Option(
            metavar="N|auto",
            help="Plan it in so many parts, each a flight of its own with its own proof; auto: as few as battery and "
            "items allow.",
        ),
    ] = None,
    cluster: o.Cluster = None,
    as_json: o.AsJson = False,
    pattern: PatternOptions,
    options: Annotated[o.PlanOptions, Without("height_m")] = _DEFAULTS,
) -> None:
    """Plan a back-and-forth survey of an area and prove its clearance.

    With --parts each part is a certified flight in a folder of its own, from take-off to landing: at --home, or where
    its own first line begins. --cluster plans the parts side by side.
    """
    number = _number(parts, cluster)
    vehicle = vehicle_of(options)
    if vehicle.camera is None:
        raise ParameterError(
            f"The profile {clean_name(vehicle.name)} has no camera.",
            where="--profile",
            advice="Use one with a [camera] table.",
        )
    camera = vehicle.camera
    request = request_of(options, vehicle)
    fence, rally = fence_given(options.fence.fence, None)
    request = replace(request, fence=fence, rally=rally)
    corners = _corners(polygon)

    def request_for(model: SurfaceModel) -> PlanRequest:
        lines = survey_lines(
            corners,
            model,
            camera=camera,
            gsd_cm=_SURVEY.gsd_cm if pattern.gsd_cm is None and pattern.height_m is None else pattern.gsd_cm,
            height_m=pattern.height_m,
            side_overlap=pattern.side_overlap,
            front_overlap=pattern.front_overlap,
            angle_deg=pattern.angle_deg,
        )
        _say_pattern(lines)
        return survey_request(request, lines)

    if number is None:
        run(dsm, out, request_for, title=polygon.stem, as_json=as_json, model=options.model)
        return
    order = PartsOrder(dsm, out, options.model, polygon.stem, number, cluster)
    done = plan_parts(order, request_for, as_json=as_json)
    raise typer.Exit(DONE if done else FAILED)


def _number(parts: str | None, cluster: str | None) -> int | None:
    """Of parts; ``AUTO``: as many as are needed; None: it is one flight."""
    if parts is None:
        if cluster is not None:
            raise ParameterError(
                "One flight is planned here.", where="--cluster", advice="Give --parts, or leave --cluster away."
            )
        return None
    if cluster is not None:
        check_where(cluster)
    if parts == "auto":
        return AUTO
    if not (parts.isascii() and parts.isdigit() and 1 <= int(parts) <= MAX_LINES):
        raise ParameterError(
            f"{clean_name(parts)!r} is no number of parts.",
            where="--parts",
            advice=f"Give 1 to {MAX_LINES:,}, or auto.",
        )
    return int(parts)


def _corners(polygon: Path) -> np.ndarray:
    """(N, 2) latitude and longitude in degrees."""
    area = read_pois(polygon.name, read_small(polygon))
    if area.polygon is None:
        raise PoiError(
            "There is no polygon in it.", where=clean_name(polygon.name), advice="Draw the area as one polygon."
        )
    say_notes(*area.warnings)
    return np.array(area.polygon)


def _say_pattern(lines: SurveyPlan) -> None:
    pattern = f"{lines.lines} lines {lines.line_spacing_m:.1f} m apart" if lines.lines > 1 else "one line"
    say_notes(
        f"{pattern}, {lines.height_m:.1f} m above the surface, {lines.gsd_cm:.2f} cm per pixel, "
        f"a photo every {lines.trigger_distance_m:.1f} m."
    )
