"""The points of a plan in the order of the shortest route."""

from __future__ import annotations

import numpy as np

from planning.dsm import Dsm
from planning.errors import PoiError
from server import tasks
from server.errors import ConflictError
from server.jobs import Lane
from server.schemas import PlanDoc

MOST_POINTS = 1000
"""Beyond, finding the order takes minutes, and no vehicle holds so many."""


async def shortest(lane: Lane, document: PlanDoc, dsm: Dsm | None) -> list[str]:
    """Ids of the points in the shortest order that keeps the first. Raises PoiError."""
    if dsm is None or len(document.pois) < 3:
        raise PoiError("There is nothing to reorder.", advice="Choose a surface model and add three points or more.")
    if len(document.pois) > MOST_POINTS:
        raise PoiError(f"{len(document.pois)} points are too many to reorder: at most {MOST_POINTS}.")
    xy_m = dsm.xy_from_lat_lon(np.array([(poi.lat_deg, poi.lon_deg) for poi in document.pois]))
    if not np.isfinite(xy_m).all():
        raise PoiError("Some points are nowhere near the surface model.", advice="Move or delete them first.")
    order = await lane.call(tasks.order_points, xy_m)
    return [document.pois[i].id for i in order]


def reordered(document: PlanDoc, poi_ids: list[str]) -> PlanDoc:
    """Raises ConflictError when points have come or gone meanwhile."""
    by_id = {poi.id: poi for poi in document.pois}
    if len(document.pois) != len(poi_ids) or set(by_id) != set(poi_ids):
        raise ConflictError("The points have changed meanwhile.", advice="Order them again.")
    return document.model_copy(update={"pois": [by_id[poi_id] for poi_id in poi_ids]})
