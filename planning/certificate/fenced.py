"""The certificate's rows of fence and rally points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planning.basics.plan_model import FlownLine
from planning.certificate.certificate_model import ClearanceParams, Reason
from planning.certificate.home_stand import ground_at
from planning.certificate.pyramid import MaxPyramid
from planning.certificate.ways_home import near_return, return_height
from planning.fence.judge import FencedFlight, FenceVerdict, judge_fence
from planning.margins.words import rounded_up
from planning.terrain.cells.cells import Layout
from planning.terrain.dsm import Dsm, SurfaceModel

FENCE_MEND = (
    "Move the route, home or the return height so that the line and the ways back keep inside the fence, or correct"
    " the fence."
)


RETURN_MEND = (
    "The line itself keeps to the fence. Move home to where the straight ways back pass beside the zone, or leave out"
    " what lies behind it: a guided way leads there and home around the zone, once its own return is accepted."
)


def fence_verdict(dsm: Dsm, line: FlownLine, params: ClearanceParams) -> FenceVerdict | None:
    """None: there is no fence."""
    if not line.fence:
        return None
    home_lat_deg, home_lon_deg = dsm.lat_lon_from_xy(np.array([line.home_xy_m]))[0]
    rally_m, rtl_m = max((max(0.0, point.alt_rel_home_m) for point in line.rally), default=0.0), params.rtl_height_m
    flight = FencedFlight(
        line_lat_lon_deg=dsm.lat_lon_from_xy(line.points_m[:, :2]),
        line_rel_home_m=line.points_m[:, 2] - line.home_alt_dsm_m,
        home_lat_lon_deg=(float(home_lat_deg), float(home_lon_deg)),
        rally_lat_lon_deg=tuple((point.lat_deg, point.lon_deg) for point in line.rally),
        # Before a way back begins the line may stand as high as it is.
        return_rel_home_m=rtl_m + rally_m if line.returns_above_rally else max(rtl_m, rally_m),
        margin_m=params.fence_margin_m,
    )
    return judge_fence(line.fence, flight)


def fence_reason(verdict: FenceVerdict | None) -> Reason | None:
    if verdict is None or verdict.keeps:
        return None
    return Reason("fence", " ".join(verdict.faults), RETURN_MEND if verdict.is_of_ways_back else FENCE_MEND)


def rally_reasons(
    dsm: Dsm, ground: SurfaceModel, pyramid: MaxPyramid, layout: Layout, line: FlownLine, params: ClearanceParams
) -> Iterator[Reason]:
    """Of each rally point: ways to it are flown as those home are, and its column is one of landing."""
    for number, point in enumerate(line.rally, start=1):
        x, y = dsm.xy_from_lat_lon(np.array([(point.lat_deg, point.lon_deg)]))[0]
        if not np.isfinite([x, y, point.alt_rel_home_m]).all():
            yield _rally_reason(number, "lies where the surface model's CRS has no places")
            continue
        obstacle = ground_at(ground, (float(x), float(y)), params).obstacle
        if obstacle is not None:
            yield _rally_reason(number, f"is no place to land: {obstacle}")
        # PX4 counts the return height from the rally point: one below home makes the way lower.
        down_m = min(0.0, point.alt_rel_home_m)
        to_rally = replace(line, home_xy_m=(float(x), float(y)), home_alt_dsm_m=line.home_alt_dsm_m + down_m)
        needed_m, from_m = return_height(pyramid, layout, to_rally, params)
        if params.rtl_height_m >= needed_m:
            needed_m, from_m = near_return(pyramid, layout, to_rally, params)
        if from_m is not None:
            yield _rally_reason(number, _way_words(needed_m + down_m, from_m, dsm, params))


def _way_words(needed_m: float, from_m: np.ndarray, dsm: Dsm, params: ClearanceParams) -> str:
    lat_deg, lon_deg = dsm.lat_lon_from_xy(from_m[None, :2])[0]
    place = f"{lat_deg:.7f}, {lon_deg:.7f}"
    if not np.isfinite(needed_m):
        return f"cannot be reached: the straight way from {place} passes unknown terrain or the model's edge"
    return (
        f"cannot be reached safely: the straight way from {place} needs {rounded_up(needed_m)} m above home;"
        f" the return height is {params.rtl_height_m:.2f} m, and close to the point autopilots climb less"
    )


def _rally_reason(number: int, what: str) -> Reason:
    mend = "Move the rally point to open ground that the surface model knows, raise the return height, or remove it."
    return Reason("rally", f"Rally point {number} {what}.", mend)
