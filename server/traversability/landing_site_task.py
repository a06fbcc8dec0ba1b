"""What the plan lane's worker does to find landing sites: the map before clearing, searched around a point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from planning.ground.landing_sites import LandingSite, LandingSites
from planning.ground.traversable import TraversableGround, site_places, sites_near
from server.schemas import LandingSiteDoc, LandingSitesBody
from server.traversability.maps import read_maps
from server.work.jobs import Progress


@dataclass(frozen=True, slots=True)
class FoundSites:
    sites: tuple[LandingSiteDoc, ...]
    no_site: str = ""


def find_sites(source: Path, body: LandingSitesBody, *, report: Progress) -> FoundSites:
    """Best first. Raises PlanningError."""
    report("Looking for landing sites", None)
    ground = read_maps(source).ground
    found = sites_near(ground, (body.lat_deg, body.lon_deg), body.rotor_span_m, body.radius_m)
    return FoundSites(described(ground, found), found.no_site)


def described(ground: TraversableGround, found: LandingSites) -> tuple[LandingSiteDoc, ...]:
    """What is told of each."""
    places = site_places(ground, found).tolist()
    return tuple(_described(site, *place) for site, place in zip(found.sites, places, strict=True))


def _described(site: LandingSite, lat_deg: float, lon_deg: float, alt_dsm_m: float) -> LandingSiteDoc:
    return LandingSiteDoc(
        rank=site.rank,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        alt_dsm_m=alt_dsm_m,
        distance_m=site.distance_m,
        slope_deg=math.degrees(site.slope_rad),
        roughness_m=site.roughness_m,
        obstacle_distance_m=site.obstacle_distance_m,
        reasons=list(site.reasons),
    )
