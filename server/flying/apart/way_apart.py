"""A guided way against the other vehicles in the air, by its predicted times and what is known of theirs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.following.separation import TimedLine, nearest
from server.flying.apart.nearness import AHEAD_S, NEAR_M, STANDS_M_S, Flown, both_ways, line_of
from server.heard.plan_follower import Ahead
from server.schemas import ReasonDoc
from telemetry.topics.vehicle import VehicleState

Others = Callable[[], Sequence[Flown]]
"""The other vehicles in the air, of this station and of others, as they are when it is called."""
NEARER_M = 0.5
"""Who begins too near may leave: a way is refused only where it leads nearer than it begins by that."""


@dataclass(frozen=True, slots=True)
class Apart:
    """What speaks against a way, and what is to be said of it."""

    reasons: tuple[ReasonDoc, ...] = ()
    """It would lead near others of this station: these can be held or led away first."""
    notes: tuple[str, ...] = ()
    """Of what nobody here can hold, or can tell where it will be."""


def way_apart(
    state: VehicleState,
    places: Sequence[tuple[float, float, float]],
    t_s: F64,
    others: Sequence[Flown],
    now_mono_s: float,
) -> Apart:
    """As if it were begun now, and the vehicle stayed where it ends for as long as others are looked ahead.

    ``places``: (K,) lat_deg, lon_deg, alt_rel_home_m; ``t_s``: (K,) seconds until it is there.
    """
    lat_lon_deg = np.array([place[:2] for place in places])
    ahead = Ahead(lat_lon_deg, np.array([place[2] for place in places]), np.asarray(t_s, dtype=float))
    begins = {} if state.lat_deg is not None else {"lat_deg": places[0][0], "lon_deg": places[0][1]}
    mine = Flown("", replace(state, **begins), ahead)
    until_s = float(t_s[-1]) + AHEAD_S
    reasons, notes = list[ReasonDoc](), list[str]()
    for other in others:
        name, is_own = other.name, not other.key
        met = min((it for way in both_ways(other) if (it := _met(mine, way, until_s, now_mono_s))), default=None)
        if met is not None:
            distance_m, in_s = met
            text = f"It may come within {distance_m:.0f} m of {name} {'now' if in_s < 1.5 else f'in {in_s:.0f} s'}"
            if is_own:
                mend = f"Choose another way, or lead {name} away or land it first."
                reasons.append(ReasonDoc(code="others", text=f"{text}.", mend=mend))
            else:
                notes.append(f"{text}: call the other station.")
        elif other.is_silent:
            notes.append(f"{name} is not heard any more, and may be where this way leads.")
        elif is_own and other.ahead is None and not _stands(other.state):
            notes.append(f"{name} is in the air, and no plan tells where it will be.")
    return Apart(tuple(reasons), tuple(notes))


def _met(mine: Flown, other: Flown, until_s: float, now_s: float) -> tuple[float, float] | None:
    """(metres between both, seconds from now); None: it does not come too near, or no nearer than it begins."""
    origin_deg = mine.state.lat_deg or 0.0, mine.state.lon_deg or 0.0
    flat = any(each.state.alt_amsl_m is None for each in (mine, other)) or mine.state.home_alt_amsl_m is None
    one, two = (line_of(each, origin_deg, now_s, flat=flat, ahead_s=until_s) for each in (mine, other))
    met = nearest(one, two, since_s=now_s)
    if met is None or met.distance_m >= NEAR_M:
        return None
    begins_m = float(np.linalg.norm(one.points_enu_m[0] - two.points_enu_m[0]))
    if begins_m < NEAR_M + one.radius_m + two.radius_m:
        least = nearest(_bare(one), _bare(two), since_s=now_s)
        if least is None or least.distance_m > begins_m - NEARER_M:
            return None
    return met.distance_m, max(0.0, met.t_s - now_s)


def _bare(line: TimedLine) -> TimedLine:
    """Where it is said to be, without the ball around it."""
    return replace(line, radius_m=0.0, spread_m_s=0.0)


def _stands(state: VehicleState) -> bool:
    speeds_m_s = state.v_east_m_s, state.v_north_m_s, state.v_down_m_s
    return float(np.linalg.norm([speed or 0.0 for speed in speeds_m_s])) < STANDS_M_S
