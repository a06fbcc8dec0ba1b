"""Going on with a mission that broke off: where, and how to get there from home without touching anything."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Mission, MissionItem
from planning.certificate.certificate_model import Certificate, ClearanceParams, with_accuracy
from planning.certificate.clearance import certify
from planning.certificate.commands import STRAIGHT, stays
from planning.certificate.home_stand import ground_at_home, home_stand
from planning.certificate.pyramid import cells_pyramid
from planning.certificate.returns import return_altitude
from planning.formats.commands import has_position
from planning.missions.flown import AMSL_FRAMES, flown_line
from planning.missions.mission_items import MIN_TAKEOFF_M
from planning.terrain.dsm import Dsm, true_cells
from telemetry.errors import NotAllowedError

HEADROOM_M = 0.1
"""Above what is needed, so that centimetres that the vehicle cuts do not count."""


@dataclass(frozen=True, slots=True)
class Resumption:
    """How a mission goes on. Items count from 1."""

    from_item: int
    climb_to_m: float
    """Above home: up to there over home, then straight and level to the item, then down to it."""
    needed_m: float
    """The smallest height from which that way is clear."""
    certificate: Certificate
    """Of everything from the take-off on."""
    skipped: tuple[int, ...]
    """Items before it that set something (camera, region of interest) and are not carried out again; speeds are."""


def resume_item(mission: Mission, broke_off_at: int) -> int:
    """The item (from 1) to go on at: the one that was flown to, or the next that is a place.

    Waypoints that were passed and holds that are over lie before it. Raises NotAllowedError when none is left.
    """
    if not 1 <= broke_off_at <= len(mission.items):
        raise NotAllowedError(
            f"There is no item {broke_off_at} to go on at; the mission has {len(mission.items)}.",
            advice="Start the mission from its beginning.",
        )
    for number in range(broke_off_at, len(mission.items) + 1):
        item = mission.items[number - 1]
        if item.command in STRAIGHT and has_position(item):
            return number
    raise NotAllowedError(
        f"Nothing is left to fly after item {broke_off_at}.", advice="Start the mission from its beginning."
    )


def plan_resumption(
    mission: Mission, broke_off_at: int, dsm: Dsm, clearance: ClearanceParams, *, climb_to_m: float | None = None
) -> Resumption:
    """The way back into a mission whose home is where the vehicle stands now, ``dsm`` with its small holes filled.

    ``climb_to_m`` None: as high as needed. Raises NotAllowedError when the way is not clear: with the height
    that would be, if there is one.
    """
    clearance = with_accuracy(clearance, dsm)
    number = resume_item(mission, broke_off_at)
    item, where = mission.items[number - 1], f"the way from home to item {number}"
    needed_m, own_m = _heights(mission, item, dsm, clearance)
    if not math.isfinite(needed_m):
        raise NotAllowedError(
            "It leads over terrain that the surface model does not know.",
            where=where,
            advice="Start the mission from its beginning, or from another place.",
        )
    least_m = math.ceil(10 * max(needed_m + HEADROOM_M, own_m, MIN_TAKEOFF_M)) / 10
    height_m = least_m if climb_to_m is None else climb_to_m
    rest = _rest(mission, number, height_m)
    certificate = certify(dsm, flown_line(rest, dsm), clearance)
    if not certificate.certified:
        reason = certificate.reasons[0]
        what = f"It is not clear at {height_m:.1f} m above home: {reason.text}"
        raise NotAllowedError(
            what, where=where, advice=f"Climb to {least_m:.1f} m." if height_m < least_m else reason.mend
        )
    before = enumerate(mission.items[: number - 1], start=1)
    skipped = tuple(k for k, item in before if stays(item.command) and item.command != MavCmd.DO_CHANGE_SPEED)
    return Resumption(number, height_m, max(0.0, needed_m), certificate, skipped)


def _heights(mission: Mission, item: MissionItem, dsm: Dsm, clearance: ClearanceParams) -> tuple[float, float]:
    """Height above home from which the level way to an item is clear wherever home may stand, and the item's own."""
    home, line = mission.home, flown_line(mission, dsm)
    home_alt_m = line.home_alt_dsm_m
    drop_m = home_stand(ground_at_home(dsm, line.home_xy_m, clearance), line, clearance).drop_m
    drop_m = drop_m if math.isfinite(drop_m) else 0.0  # the certificate refuses ground that is not known
    xy_m = dsm.xy_from_lat_lon(np.array([[item.lat_deg, item.lon_deg], [home.lat_deg, home.lon_deg]]))
    cells = true_cells(dsm, xy_m)
    over_m, home_m = cells.layout.in_frame(xy_m)
    place = np.array([[*over_m, -math.inf]])
    altitude_m, _ = return_altitude(cells_pyramid(cells), place, home_m, clearance.required_clearance_m)
    own_m = item.alt_m - home_alt_m if item.frame in AMSL_FRAMES else item.alt_m
    return altitude_m - home_alt_m + drop_m, own_m


def _rest(mission: Mission, number: int, climb_to_m: float) -> Mission:
    """What will be flown: up over home, level to over the item, and the mission from it on."""
    item = mission.items[number - 1]
    up = replace(
        item,
        command=MavCmd.NAV_TAKEOFF,
        frame=MavFrame.GLOBAL_RELATIVE_ALT,
        params=(0.0, 0.0, 0.0, 0.0),
        alt_m=climb_to_m,
    )
    up = replace(up, lat_deg=mission.home.lat_deg, lon_deg=mission.home.lon_deg)
    over = replace(item, frame=MavFrame.GLOBAL_RELATIVE_ALT, alt_m=climb_to_m)
    return replace(mission, items=(up, over, *mission.items[number - 1 :]))
