"""What the flight lane's worker does with a guided way that is asked for: lays and judges it over the surface model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from planning.errors import ParameterError
from planning.fence.fence_model import RallyPoint
from planning.guided.guided_model import Back, GoTo, GuidedWay, Look, Orbit, Rally, TakeOff, ToHome, Wish
from server.scene.mirror import Voxels
from server.schemas import PlanDoc, WayBody
from server.work.jobs import Progress
from telemetry.flight.home_watch import HomePlace, home_of
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.onboard_lists import PlacesOnboard
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from planning.terrain.dsm import Dsm

AT_PLACE = ("to", "look", "orbit")
_ANY_RALLY = RallyPoint(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class WayAsked:
    """All that a way is judged by, of one moment."""

    body: WayBody
    terrain: Path
    document: PlanDoc
    """Whose vehicle, demands and fence count, and what was seen and taken into its surface model."""
    state: VehicleState
    now_mono_s: float
    parameters: dict[str, float | None]
    aboard: PlacesOnboard
    maps: tuple[Voxels, ...]
    """What sensors have seen in this flight."""
    flown: tuple[tuple[float, float, float], ...]
    """(lat_deg, lon_deg, alt_rel_home_m) since the take-off."""
    took_off: HomePlace | None
    """The home that the flight began with; None: not known."""


@dataclass(frozen=True, slots=True)
class WayJudged:
    way: GuidedWay
    wish: Wish
    speed_m_s: float
    most_m_s: float
    has_seen: bool
    rally_deg: tuple[tuple[float, float], ...]
    """(lat_deg, lon_deg) of the rally points on board: ways to them are certified with it."""


def judge_way(asked: WayAsked, *, report: Progress) -> WayJudged:
    """Raises NotAllowedError, MissionError, ParameterError and PlanningError."""
    from planning.fence.fence_model import within_both
    from planning.formats.fence_items import fence_of, rally_of
    from server.library.documents import demands_from_doc
    from server.library.fences import fence_from_doc
    from server.library.terrains import load_terrain
    from telemetry.flight.certified_way import Flown, judged_way, nearest_rally, part_for
    from telemetry.flight.home_height import home_off_m
    from telemetry.mavlink.items import mission_items

    report("Judging the way", None)
    demands = replace(demands_from_doc(asked.document), way="guided")
    fence = within_both(
        fence_from_doc(asked.document)[0], fence_of(mission_items(asked.aboard.fence), "the fence on board", [])
    )
    rally = rally_of(mission_items(asked.aboard.rally), "the rally points on board")
    wish = wish_of(asked.body, asked.flown)
    if isinstance(wish, Rally):
        wish = replace(wish, point=nearest_rally(rally, asked.state))
    speed_m_s = asked.body.speed_m_s or demands.profile.mean_speed_m_s
    ground = load_terrain(asked.terrain)
    flies = is_in_the_air(asked.state)
    took_off = asked.took_off if flies else home_of(asked.state)  # on the ground the last take-off's is of no matter
    off_m = home_off_m(ground, took_off, asked.state) if flies else 0.0
    seen = with_seen(ground, asked.terrain, asked.document.seen_id, asked.maps, asked.state, took_off)
    way = judged_way(
        part_for(ground, asked.state, wish, rally),
        None if seen is None else part_for(seen, asked.state, wish, rally),
        asked.state,
        wish,
        Flown(
            demands.profile,
            demands.clearance(),
            asked.parameters,
            fence,
            rally,
            off_m,
        ),
        speed_m_s=speed_m_s,
        now_s=asked.now_mono_s,
    )
    rally_deg = tuple((point.lat_deg, point.lon_deg) for point in rally)
    return WayJudged(way, wish, speed_m_s, demands.profile.max_speed_m_s, seen is not None, rally_deg)


def with_seen(
    ground: Dsm,
    terrain: Path,
    seen_id: str | None,
    maps: tuple[Voxels, ...],
    state: VehicleState,
    took_off: HomePlace | None,
) -> Dsm | None:
    """None where nothing was seen, neither in this flight nor in the plan. Raises NotAllowedError as ``burned``."""
    from server.library.seen_columns import load_planned_terrain
    from server.obstacles.coming_down_task import burned

    if seen_id is None and not any((~voxels.explained).any() for voxels in maps):
        return None
    planned = ground if seen_id is None else load_planned_terrain(terrain, seen_id)
    return burned(planned, maps, state, took_off)


def wish_of(body: WayBody, flown: tuple[tuple[float, float, float], ...]) -> Wish:
    """The rally point of "rally" is not known yet: any stands for it. Raises ParameterError."""
    place = None if body.place is None else (body.place.lat_deg, body.place.lon_deg)
    if (place is not None) != (body.action in AT_PLACE):
        what = "The way needs a place." if place is None else "This way takes no place."
        raise ParameterError(what, where="place", advice="Give one for to, look and orbit only.")
    match body.action:
        case "take_off":
            return TakeOff(body.height_m)
        case "home":
            return ToHome(body.height_m)
        case "rally":
            return Rally(_ANY_RALLY, body.height_m)
        case "back":
            return Back(flown)
    if place is None:
        return GoTo(body.height_m)
    if body.action == "look":
        return Look(place)
    if body.action == "to":
        return GoTo(body.height_m, place)
    return Orbit(place, body.radius_m, body.height_m, body.laps, body.clockwise)
