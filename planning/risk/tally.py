"""What many flights say: how often the hull touched the surface, between which bounds that lies, and where."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from planning.errors import ParameterError
from planning.risk.flights import Closest, RiskGround
from planning.terrain.dsm import Dsm

PLACE_M = 5.0
"""Contacts so near each other along the line are at one place."""
PERCENTILES = (0.1, 1.0, 5.0, 50.0)


@dataclass(frozen=True, slots=True)
class Share:
    """How often something happened, and how often it may happen at all."""

    hits: int
    flights: int
    low: float
    high: float
    """Clopper-Pearson; without hits the one-sided upper bound."""
    confidence: float

    @property
    def estimate(self) -> float:
        return self.hits / self.flights


@dataclass(frozen=True, slots=True)
class WorstPlace:
    """Where most contacts were; without contacts, where the nearest of all flights was nearest."""

    lat_deg: float
    lon_deg: float
    s_m: float
    alt_dsm_m: float
    contacts: int
    """Within ``PLACE_M`` along the line."""
    planned_m: float
    """Distance to the surface model there, without errors."""


@dataclass(frozen=True, slots=True)
class Risk:
    contact: Share
    hull_m: dict[float, float]
    """Percentile of flights: at least how near the hull came to the surface on them; negative within."""
    nearest_hull_m: float
    worst: WorstPlace


def share_of(hits: int, flights: int, confidence: float = 0.95) -> Share:
    """The exact interval of Clopper and Pearson 1934; of none the bound 1 - (1 - confidence)^(1 / flights)."""
    if not (0.0 < confidence < 1.0 and 0 <= hits <= flights and flights > 0):
        raise ParameterError(
            f"{hits} of {flights} flights have no bounds of {confidence:g} confidence.",
            where="--confidence",
            advice="Give a share between 0 and 1, such as 0.95.",
        )
    if hits == 0:
        return Share(0, flights, 0.0, -math.expm1(math.log1p(-confidence) / flights), confidence)
    beside = (1.0 - confidence) / 2
    low = float(beta.ppf(beside, hits, flights - hits + 1))
    high = 1.0 if hits == flights else float(beta.ppf(1.0 - beside, hits + 1, flights - hits))
    return Share(hits, flights, low, high, confidence)


def risk_of(closest: Closest, ground: RiskGround, dsm: Dsm, radius_m: float, confidence: float = 0.95) -> Risk:
    """Of all flights together; a hull that just touches the surface has touched it."""
    hull_m = closest.distance_m - radius_m
    touched = hull_m <= 0.0
    return Risk(
        contact=share_of(int(touched.sum()), len(hull_m), confidence),
        hull_m={p: float(np.percentile(hull_m, p, method="lower")) for p in PERCENTILES},
        nearest_hull_m=float(hull_m.min()),
        worst=_worst(closest, touched, ground, dsm),
    )


def _worst(closest: Closest, touched: np.ndarray, ground: RiskGround, dsm: Dsm) -> WorstPlace:
    piece, contacts = int(closest.piece[np.argmin(closest.distance_m)]), 0
    if touched.any():
        at = np.floor(ground.s_m[closest.piece] / PLACE_M).astype(np.int64)
        counts = np.bincount(at[touched])
        contacts = int(counts.max())
        here = np.flatnonzero(touched & (at == np.argmax(counts)))
        piece = int(closest.piece[here[np.argmin(closest.distance_m[here])]])
    x_m, y_m, alt_dsm_m = (ground.places_m[piece] + ground.places_m[piece + 1]) / 2
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[x_m, y_m]]))[0]
    s_m = float(ground.s_m[piece] + ground.s_m[piece + 1]) / 2
    return WorstPlace(float(lat_deg), float(lon_deg), s_m, float(alt_dsm_m), contacts, float(ground.planned_m[piece]))
