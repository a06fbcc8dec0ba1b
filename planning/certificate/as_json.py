"""The certificate as JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from planning.basics.plan_model import finite_or_none
from planning.certificate.certificate_model import Certificate
from planning.margins.words import budget_json, tube_json

WORST_KEYS = ("lat_deg", "lon_deg", "alt_rel_home_m", "leg")


def certificate_json(certificate: Certificate) -> dict[str, Any]:
    """The certificate as plain JSON values; infinite and undefined numbers become null."""
    plain = {
        "certified": certificate.certified,
        "min_distance_m": certificate.min_distance_m,
        "min_vertical_m": certificate.min_vertical_m,
        "required_clearance_m": certificate.required_clearance_m,
        "clearance_budget": budget_json(certificate.budget, certificate.required_clearance_m),
        "tube": tube_json(certificate.following_m, certificate.min_distance_m, certificate.required_clearance_m),
        "worst": {key: getattr(certificate.worst, key) for key in WORST_KEYS},
        "rtl_height_needed_m": certificate.rtl_height_needed_m,
        "home_column_clear": certificate.home_column_clear,
        "home": None if certificate.home is None else asdict(certificate.home),
        "fence": None if certificate.fence is None else asdict(certificate.fence),
        "max_height_above_ground_m": certificate.max_height_above_ground_m,
        "reasons": [asdict(reason) for reason in certificate.reasons],
        "legs": [asdict(leg) for leg in certificate.legs],
        "trend": {"s_m": certificate.trend_s_m, "distance_m": certificate.trend_distance_m},
        "assumptions": certificate.assumptions,
    }
    return {key: _jsonable(value) for key, value in plain.items()}


def _jsonable(value: object) -> Any:
    if isinstance(value, dict):
        return {str(key): _jsonable(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray):
        return _jsonable(value.tolist())
    if isinstance(value, list | tuple):
        return [_jsonable(inner) for inner in value]
    if isinstance(value, np.generic):
        return _jsonable(value.item())
    return finite_or_none(value) if isinstance(value, float) else value
