"""Plan flights over your own surface model, and prove their clearance.

    from pathlib import Path
    from planning import FILES, PlanRequest, Poi, export_file, load_profile, path_params, plan_mission, read_dsm

    dsm, profile = read_dsm("hillside.tif"), load_profile("mapper-rtk")
    pois = (Poi(37.7288, 14.9927), Poi(37.7291, 14.9936))
    plan = plan_mission(dsm, PlanRequest(pois=pois, profile=profile, path=path_params(profile)))
    print(plan.certificate.certified, plan.certificate.min_distance_m, "m")
    for name in FILES:
        Path(name).write_text(export_file(name, plan, dsm), encoding="utf-8")

A mission made anywhere: ``read_flight``, ``flown_line``, ``certify``. A survey: ``survey_lines``, ``survey_request``,
``plan_mission``.

The names in ``__all__`` are stable: what they take, return and raise changes only with the version's first number
(below 1.0 with its second), and CHANGELOG.md says so. All else in this package may move with any version.
SI units; degrees for latitude, longitude and where a name says so. Errors are ``PlanningError``s: what is wrong, where,
what to do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mapping import lazily
from mapping.version import __version__

if TYPE_CHECKING:
    from planning.basics.plan_model import MissionParams, Poi, SurfaceParams
    from planning.certificate.certificate_model import Certificate, ClearanceParams
    from planning.certificate.clearance import certify
    from planning.errors import PlanningError
    from planning.formats.detect import read_flight
    from planning.missions.flown import flown_line
    from planning.missions.vehicle_profile import load_profile, path_params
    from planning.planner.plan import Plan, plan_mission
    from planning.planner.request import PlanRequest, survey_request
    from planning.report.exports import FILES, export_file
    from planning.route.survey import survey_lines
    from planning.terrain.dsm import Dsm
    from planning.terrain.geotiff import read_dsm

__all__ = [
    "FILES",
    "Certificate",
    "ClearanceParams",
    "Dsm",
    "MissionParams",
    "Plan",
    "PlanRequest",
    "PlanningError",
    "Poi",
    "SurfaceParams",
    "__version__",
    "certify",
    "export_file",
    "flown_line",
    "load_profile",
    "path_params",
    "plan_mission",
    "read_dsm",
    "read_flight",
    "survey_lines",
    "survey_request",
]

_NAMES = {
    ".basics.plan_model": ("MissionParams", "Poi", "SurfaceParams"),
    ".certificate.certificate_model": ("Certificate", "ClearanceParams"),
    ".certificate.clearance": ("certify",),
    ".errors": ("PlanningError",),
    ".formats.detect": ("read_flight",),
    ".missions.flown": ("flown_line",),
    ".missions.vehicle_profile": ("load_profile", "path_params"),
    ".planner.plan": ("Plan", "plan_mission"),
    ".planner.request": ("PlanRequest", "survey_request"),
    ".report.exports": ("FILES", "export_file"),
    ".route.survey": ("survey_lines",),
    ".terrain.dsm": ("Dsm",),
    ".terrain.geotiff": ("read_dsm",),
}

if not TYPE_CHECKING:
    __getattr__ = lazily(__name__, _NAMES)
