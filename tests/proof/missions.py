"""One mission, planned by the product, and what the slow proof finds of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pyproj import CRS, Transformer

from planning.basics.plan_model import Poi, SurfaceParams, VehicleProfile
from planning.errors import PlanningError
from planning.formats import wpl
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm
from tests.proof.models import Model
from tests.reference import proof

PLACES = 400
POINTS = 4


@dataclass(frozen=True)
class Proved:
    """Distances in metres of one mission."""

    certified_m: float
    true_m: float

    @property
    def over_m(self) -> float:
        """How much nearer the line really comes than the certificate says."""
        return self.certified_m - self.true_m


class Prover:
    """A model read twice: by the product, and by the proof."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.dsm: Dsm = read_dsm(model.path, crs=model.crs, z_scale=model.declared_scale)
        self.ground = proof.read_ground(model.path, crs=model.crs, height_scale=model.height_scale)
        self._known = np.argwhere(np.isfinite(self.ground.top_m))

    def prove(self, seed: int) -> Proved | None:
        """A seeded mission; None where its points cannot be planned or it leads over unknown ground anyway."""
        pois = self._points(np.random.default_rng(seed))
        if len(pois) < 2:
            return None
        radius_m = self.model.radius_m
        request = PlanRequest(
            pois=pois,
            profile=VehicleProfile("proof", position_error_m=0.1, rtl_height_m=60.0),
            surface=SurfaceParams(radius_m=radius_m, height_m=min(3.0, radius_m / 2)),
        )
        try:
            plan = plan_mission(self.dsm, request)
        except PlanningError:
            return None
        text = wpl.write_wpl(plan.mission)
        true_m = proof.clearance(self.ground, proof.mission_line(text, self.ground), reach_m=4 * radius_m)
        found = Proved(plan.certificate.min_distance_m, true_m)
        return None if found.true_m == 0.0 == found.certified_m else found

    def _points(self, random: np.random.Generator) -> tuple[Poi, ...]:
        """Points about a leg apart, away from the border, on known cells as the proof reads them."""
        corners = self.ground.corners_m
        cells = self._known[random.integers(0, len(self._known), PLACES)]
        share = random.uniform(0.2, 0.8, (PLACES, 2, 1))
        low, high = corners[cells[:, 0], cells[:, 1]], corners[cells[:, 0] + 1, cells[:, 1] + 1]
        places = low + share[:, 0] * (high - low)
        kept = [places[0]]
        for place in places[1:]:
            away = min(np.hypot(*(place - other)) for other in kept)
            if 0.3 * self.model.leg_m < away < 1.5 * self.model.leg_m and len(kept) < POINTS:
                kept.append(place)
        metres = CRS.from_wkt(self.ground.metres_wkt)
        to_degrees = Transformer.from_crs(metres, CRS.from_epsg(4326), always_xy=True)
        lon_lat = (to_degrees.transform(*(place / self.ground.unit_m)) for place in kept)
        return tuple(Poi(lat, lon) for lon, lat in lon_lat)
