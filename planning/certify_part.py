"""The certificate of a mission made anywhere, over the part of a surface model that it needs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planning.clearance import certify
from planning.dsm import F64, SurfaceModel
from planning.flown import flown_line
from planning.formats.commands import has_position
from planning.holes import HoleReport
from planning.model import Certificate, ClearanceParams, FlownLine, Mission
from planning.part import MARGIN_M, Ground, Grounds, was_enough

Judged = tuple[FlownLine, Certificate]


def certify_part(
    model: SurfaceModel,
    mission: Mission,
    params: ClearanceParams,
    *,
    max_hole_m2: float,
    assumptions: Mapping[str, object],
) -> tuple[Ground, Certificate]:
    """The part that it took, and the certificate, which is the one over the whole model with its small holes filled."""

    def judge(ground: Ground) -> tuple[Ground, Judged]:
        line = flown_line(mission, ground.filled)
        made = {**hole_assumptions(ground.holes, max_hole_m2), **assumptions}
        return ground, (line, certify(ground.filled, line, params, ground=model, assumptions=made))

    def is_enough(ground: Ground, found: tuple[Ground, Judged]) -> bool:
        return was_enough(ground, model, *found[1])

    grounds = Grounds(model, max_hole_m2)
    ground, (_, certificate) = grounds.judged(
        mission_places(model, mission), params.required_clearance_m + MARGIN_M, judge, is_enough
    )
    return ground, certificate


def mission_places(model: SurfaceModel, mission: Mission) -> F64:
    """(N, 2) projected places of home and of all items that have one."""
    places = [(item.lat_deg, item.lon_deg) for item in mission.items if has_position(item)]
    home = mission.home
    return model.xy_from_lat_lon(np.array([*places, (home.lat_deg, home.lon_deg)]))


def hole_assumptions(holes: HoleReport, max_hole_m2: float) -> dict[str, object]:
    """What a certificate writes down about unknown cells that were given a height."""
    return {"holes_filled": holes.count, "holes_filled_area_m2": holes.area_m2, "max_hole_m2": max_hole_m2}
