"""A plan in numbers, as plain JSON-able dictionaries: what ``hedgehop plan --json`` prints."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from planning.basics.plan_model import finite_or_none
from planning.certificate.certificate_model import Certificate
from planning.certificate.clearance import certificate_json
from planning.missions.feasibility import feasibility_json
from planning.planner.plan import Plan
from planning.route.survey_coverage import SurveyCoverage
from planning.terrain.dsm import Dsm, SurfaceModel

_CERTIFICATE_KEYS = (
    "certified",
    "min_distance_m",
    "min_vertical_m",
    "required_clearance_m",
    "clearance_budget",
    "tube",
    "worst",
    "rtl_height_needed_m",
    "home_column_clear",
    "home",
    "fence",
    "max_height_above_ground_m",
    "reasons",
)


def certificate_summary(certificate: Certificate) -> dict[str, Any]:
    """The certificate's headline keys, without legs, trend and assumptions."""
    whole = certificate_json(certificate)
    return {key: whole[key] for key in _CERTIFICATE_KEYS}


def dsm_summary(source: SurfaceModel, part: Dsm, *, holes_filled: int) -> dict[str, Any]:
    """Identity and size of the surface model, and what was unknown in the part looked at (before holes were filled).

    Of a catalogue in the cells of the part.
    """
    west, south, east, north = source.bounds_m
    cell_m = part.resolution_m
    return {
        "sha256": source.sha256,
        "crs": crs_name(source),
        "vertical_datum": source.vertical_datum,
        "width": round((east - west) / cell_m),
        "height": round((north - south) / cell_m),
        "resolution_m": cell_m,
        "part": {"width": part.width_px, "height": part.height_px},
        "unknown_share": unknown_share(part),
        "holes_filled": holes_filled,
    }


def plan_summary(plan: Plan, source: SurfaceModel) -> dict[str, Any]:
    """Every figure of a plan that an operator or a script asks for; ``source`` is the model as read."""
    request = plan.request
    return {
        **certificate_summary(plan.certificate),
        **feasibility_json(plan.feasibility),
        "home": _home(plan),
        "rtl_height_m": request.profile.rtl_height_m,
        "length_m": float(plan.path.s_m[-1]),
        "duration_s": plan.predicted.total_s,
        "lspb_duration_s": float(plan.timing.t_s[-1]),
        "endurance_s": request.profile.endurance_s,
        "usable_endurance_s": request.profile.usable_endurance_s,
        "samples": len(plan.path.s_m),
        "waypoints": plan.built.waypoints,
        "items": len(plan.mission.items),
        "max_items": request.mission.max_items,
        "excess_height_m": plan.built.excess_height_m,
        "detours": [asdict(detour) for detour in plan.detours],
        "dsm": dsm_summary(source, plan.ground, holes_filled=plan.holes.count),
        "survey": None if plan.coverage is None else survey_summary(plan.coverage),
        "warnings": list(plan.warnings),
    }


def survey_summary(coverage: SurveyCoverage) -> dict[str, Any]:
    """What a survey's photos see, and what is wrong with it; an overlap below every image is null."""
    figures = {
        key: finite_or_none(value) if isinstance(value, float) else value for key, value in asdict(coverage).items()
    }
    return {**figures, "faults": list(coverage.faults())}


def _home(plan: Plan) -> dict[str, Any] | None:
    """Where home is, whether it was chosen for want of one, and how high a vehicle may really stand there."""
    home, stand = plan.mission.home, certificate_json(plan.certificate)["home"]
    if stand is None:
        return None
    place = {"lat_deg": home.lat_deg, "lon_deg": home.lon_deg, "chosen": plan.request.home_lat_lon_deg is None}
    return place | stand


def crs_name(dsm: SurfaceModel) -> str:
    """ "EPSG:2193" where the system has such a code, its name otherwise."""
    authority = dsm.crs.to_authority()
    return ":".join(authority) if authority else dsm.crs.name


def unknown_share(dsm: Dsm) -> float:
    """Share of unknown cells, counted row block by row block (a model may be larger than spare memory)."""
    rows = max(1, 4_000_000 // dsm.width_px)
    unknown = sum(int(np.count_nonzero(np.isnan(dsm.elevation_m[r : r + rows]))) for r in range(0, dsm.height_px, rows))
    return unknown / dsm.elevation_m.size
