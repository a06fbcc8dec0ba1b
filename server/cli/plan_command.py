"""``hedgehop plan``: points of interest and a surface model become a certified mission."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from typer import Argument, Option

from planning.basics.limits import LONGEST_LOITER_S
from planning.basics.plan_model import Poi
from planning.errors import ParameterError, PoiError
from planning.formats.poi_files import read_pois, warn_swapped
from planning.formats.safe_text import clean_name
from planning.planner.request import PlanRequest
from planning.route.poi import check_pois
from planning.route.visiting_order import shortest_order
from planning.terrain.dsm import SurfaceModel
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.fence_given import fence_given
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import say_notes
from server.cli.shared.planning_run import request_of, run, vehicle_of

Heading = Literal["path", "fixed", "point"]


@dataclass(frozen=True, slots=True)
class PointOptions:
    """What is done at the points and between them."""

    PANEL: ClassVar = "Mission"
    shortest_order: Annotated[bool, Option("--shortest-order", help="Visit the points in the shortest order.")] = False
    loiter_s: Annotated[float | None, Option(help="Seconds to wait at each point whose file asks for none.")] = None
    heading: Annotated[
        Heading | None, Option(help="Nose along the path (default), in a fixed direction, or toward a point.")
    ] = None
    heading_deg: Annotated[float | None, Option(help="The fixed direction, clockwise from north.")] = None
    look_at: Annotated[str | None, Option(metavar="LAT,LON", help="The point to look at.")] = None
    gimbal_pitch_deg: Annotated[float | None, Option(help="-90 looks straight down.")] = None
    camera_trigger_m: Annotated[float | None, Option(help="Take a photo every so many metres.")] = None


@command
def plan(
    dsm: o.DsmFile,
    pois: Annotated[
        Path, Argument(metavar="POIS", help="Points of interest: CSV, GeoJSON, KML, KMZ, .waypoints or .plan.")
    ],
    *,
    out: o.Out,
    as_json: o.AsJson = False,
    options: o.PlanOptions,
    at: PointOptions,
) -> None:
    """Plan a terrain-hugging mission over points of interest and prove its clearance."""
    vehicle = vehicle_of(options)
    look_at_deg = o.parse_place(at.look_at, "--look-at")
    request = request_of(
        options,
        vehicle,
        heading=_heading(at.heading, at.heading_deg, look_at_deg),
        heading_deg=at.heading_deg or 0.0,
        look_at=look_at_deg,
        gimbal_pitch_deg=at.gimbal_pitch_deg,
        camera_trigger_m=at.camera_trigger_m,
    )
    points = read_pois(pois.name, read_small(pois))
    if not points.pois:
        raise PoiError(
            "The file holds an area and no points.",
            where=clean_name(pois.name),
            advice="`hedgehop survey` plans lines over an area.",
        )
    waiting = _with_loiter(points.pois, at.loiter_s)
    fence, rally = fence_given(options.fence.fence, points.mission)
    request = replace(request, fence=fence, rally=rally)

    def request_for(model: SurfaceModel) -> PlanRequest:
        say_notes(*points.warnings, *warn_swapped(points.pois, model))
        return replace(request, pois=_in_shortest_order(waiting, model) if at.shortest_order else waiting)

    run(dsm, out, request_for, title=pois.stem, as_json=as_json, model=options.model)


def _heading(heading: Heading | None, heading_deg: float | None, look_at: tuple[float, float] | None) -> Heading:
    """What the nose points at; a direction or a point alone says it already.

    Raises ParameterError when the options contradict each other or one is missing.
    """
    implied = {"fixed": heading_deg is not None, "point": look_at is not None}
    chosen: Heading = heading or ("fixed" if implied["fixed"] else "point" if implied["point"] else "path")
    for kind, option in (("fixed", "--heading-deg"), ("point", "--look-at")):
        if (chosen == kind) != implied[kind]:
            what = f"The heading {chosen!r} " + (f"needs {option}." if chosen == kind else f"takes no {option}.")
            raise ParameterError(what, where=option, advice=f"Give {option} with --heading {kind}, and only then.")
    return chosen


def _with_loiter(pois: Sequence[Poi], loiter_s: float | None) -> tuple[Poi, ...]:
    """The points, those without a waiting time with this one."""
    if loiter_s is None:
        return tuple(pois)
    if not 0 <= loiter_s <= LONGEST_LOITER_S:
        raise ParameterError(
            f"A wait of {loiter_s:g} s is not possible.",
            where="--loiter-s",
            advice=f"Give seconds, at most {LONGEST_LOITER_S:,.0f}.",
        )
    return tuple(poi if poi.loiter_s > 0 else replace(poi, loiter_s=loiter_s) for poi in pois)


def _in_shortest_order(pois: Sequence[Poi], model: SurfaceModel) -> tuple[Poi, ...]:
    """The points in the order of the shortest way that starts at the first."""
    xy_m = np.asarray(check_pois(pois, model))
    return tuple(pois[index] for index in shortest_order(xy_m))
