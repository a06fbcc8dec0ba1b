"""A guided way against the other vehicles in the air, by its predicted times and what is known of theirs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.following.separation import TimedLine, nearest
from server.flying.apart.nearness import AHEAD_S, NEAR_M, STANDS_M_S, Flown, both_ways, line_of
from server.heard.led_way import Places, later_share, latest_s, led_ahead
from server.schemas import ReasonDoc
from telemetry.topics.vehicle import VehicleState

Others = Callable[[], Sequence[Flown]]
"""The other vehicles in the air, of this station and of others, as they are when it is called."""
NEARER_M = 0.5
"""Who begins too near may part: until then a way may come nearer than it begins by that."""
STEP_M = 1.0
"""Where they part is looked for in such steps along the way."""
SILENT_S = 5.0
"""A position that is older is not where the vehicle is."""


@dataclass(frozen=True, slots=True)
class Apart:
    """What speaks against a way, and what is to be said of it."""

    reasons: tuple[ReasonDoc, ...] = ()
    """It would lead near others of this station: these can be held or led away first."""
    notes: tuple[str, ...] = ()
    """Of what nobody here can hold, or can tell where it will be."""
    noted: frozenset[tuple[str, str]] = frozenset()
    """Whom the notes name, and why."""


@dataclass(frozen=True, slots=True)
class _Met:
    distance_m: float
    in_s: float
    begins: bool = False
    """Both begin so near, and the way parts them, or leaves the vehicle where it is."""


def way_apart(state: VehicleState, places: Places, t_s: F64, others: Sequence[Flown], now_mono_s: float) -> Apart:
    """As if it were begun now, at the worse end of its times, and the vehicle stayed where it ends for as long as
    others are looked ahead. ``t_s``: (K,) seconds until it is at each place, as lengths and speeds give them."""
    begins: dict[str, float | None] = {}
    if state.lat_deg is None:
        begins |= {"lat_deg": places[0][0], "lon_deg": places[0][1]}
    if not state.armed and state.alt_amsl_m is not None:
        begins["home_alt_amsl_m"] = state.alt_amsl_m  # it takes its home where it stands when it arms
    later = later_share(len(places))
    mine = Flown("", replace(state, **begins), led_ahead(np.array(places, dtype=float), t_s, later))  # type: ignore[arg-type]
    until_s = latest_s(float(t_s[-1]), later) + AHEAD_S
    reasons, notes, noted = list[ReasonDoc](), list[str](), set[tuple[str, str]]()
    for other in others:
        met = None if other.state.lat_deg is None else _met(mine, other, until_s, now_mono_s)
        if met is not None and not met.begins and not other.key:
            reasons.append(_reason(other, met, now_mono_s))
            continue
        why, words = _note(other, met, now_mono_s)
        if words:
            notes.append(words)
            noted.add((other.name, f"{why} {other.key}".rstrip()))
    return Apart(tuple(reasons), tuple(notes), frozenset(noted))


def _reason(other: Flown, met: _Met, now_s: float) -> ReasonDoc:
    name, mend = other.name, f"Choose another way, or lead {other.name} away or land it first."
    if (silent_s := _silent_s(other, now_s)) > SILENT_S:
        mend = f"Choose another way: {name} was last heard there {silent_s:.0f} s ago."
    return ReasonDoc(code="others", text=f"{_near(name, met)}.", mend=mend)


def _note(other: Flown, met: _Met | None, now_s: float) -> tuple[str, str]:
    """Why, in a word, and the sentence; empty: nothing is to be said."""
    name, silent_s = other.name, _silent_s(other, now_s)
    if met is not None and met.begins:
        return "begins", f"It begins within {met.distance_m:.0f} m of {name}."
    if met is not None:
        return "near", f"{_near(name, met)}: call the other station."
    if other.state.lat_deg is None:
        return "nowhere", f"{name} is in the air, and does not tell where."
    if other.is_silent:
        return "silent", f"{name} is not heard any more, and may be where this way leads."
    if silent_s > SILENT_S:
        return "silent", f"{name} was last heard {silent_s:.0f} s ago, and may be where this way leads."
    if other.ahead is None and other.told is None and not _stands(other.state):
        return "unplanned", f"{name} is in the air, and no plan tells where it will be."
    return "", ""


def _near(name: str, met: _Met) -> str:
    when = "now" if met.in_s < 1.5 else f"in about {met.in_s:.0f} s"
    return f"It may come within {met.distance_m:.0f} m of {name} {when}"


def _met(mine: Flown, other: Flown, until_s: float, now_s: float) -> _Met | None:
    """None: it does not come too near. The nearest of what the other one may fly."""
    found = [at for way in both_ways(other) if (at := _met_on(mine, way, until_s, now_s)) is not None]
    return min(found, key=lambda at: (at.begins, at.distance_m, at.in_s), default=None)


def _met_on(mine: Flown, other: Flown, until_s: float, now_s: float) -> _Met | None:
    origin_deg = mine.state.lat_deg or 0.0, mine.state.lon_deg or 0.0
    heights = [mine.state.alt_amsl_m, mine.state.home_alt_amsl_m, other.state.alt_amsl_m]
    if other.ahead is not None:
        heights.append(other.state.home_alt_amsl_m)
    flat = any(height_m is None for height_m in heights)
    one, two = (line_of(each, origin_deg, now_s, flat=flat, ahead_s=until_s) for each in (mine, other))
    if _balls_apart_m(one, two) >= NEAR_M:
        return None
    begins_m = float(np.linalg.norm(one.points_enu_m[0] - two.points_enu_m[0]))
    near_m = NEAR_M + one.radius_m + two.radius_m
    if begins_m >= near_m or flat:
        return _near_on(one, two, now_s)
    leaving, rest = where_parted(one, two.points_enu_m[0], near_m + NEARER_M)
    if rest is None and np.ptp(one.points_enu_m, axis=0).max() > NEARER_M:
        return _near_on(one, two, now_s)  # it goes about there, and never parts
    least = nearest(_bare(leaving), _bare(two), since_s=now_s)
    if least is not None and least.distance_m < begins_m - NEARER_M:
        return _near_on(leaving, two, now_s)
    met = None if rest is None else _near_on(rest, two, now_s)
    return met or _Met(max(0.0, begins_m - one.radius_m - two.radius_m), 0.0, begins=True)


def _near_on(one: TimedLine, two: TimedLine, now_s: float) -> _Met | None:
    met = nearest(one, two, since_s=now_s)
    if met is None or met.distance_m >= NEAR_M:
        return None
    return _Met(met.distance_m, max(0.0, _when_at(one, np.array(met.at_enu_m)) - now_s))


def _when_at(line: TimedLine, place_enu_m: F64) -> float:
    """When it is as near to a place as it comes, in the middle of what is possible."""
    starts_m, legs_m = line.points_enu_m[:-1], np.diff(line.points_enu_m, axis=0)
    along = np.einsum("ij,ij->i", place_enu_m - starts_m, legs_m) / np.maximum((legs_m**2).sum(axis=1), 1e-9)
    share = np.clip(along, 0.0, 1.0)
    leg = int(np.argmin(np.linalg.norm(starts_m + share[:, None] * legs_m - place_enu_m, axis=1)))
    return float(line.t_s[leg] + share[leg] * (line.t_s[leg + 1] - line.t_s[leg]))


def where_parted(line: TimedLine, from_enu_m: F64, far_m: float) -> tuple[TimedLine, TimedLine | None]:
    """The line up to where it is first so far from a place, and what comes after; None: it never is."""
    for leg, share in _steps(line.points_enu_m):
        at_m = (1.0 - share) * line.points_enu_m[leg] + share * line.points_enu_m[leg + 1]
        if np.linalg.norm(at_m - from_enu_m) >= far_m:
            at_s = (1.0 - share) * line.t_s[leg] + share * line.t_s[leg + 1]
            leaving = replace(
                line,
                points_enu_m=np.vstack([line.points_enu_m[: leg + 1], at_m]),
                t_s=np.append(line.t_s[: leg + 1], at_s),
            )
            rest = replace(
                line,
                points_enu_m=np.vstack([at_m, line.points_enu_m[leg + 1 :]]),
                t_s=np.concatenate([[at_s], line.t_s[leg + 1 :]]),
                early_late_s=line.early_late_s + line.early_late_share * (at_s - line.t_s[0]),
                radius_m=line.radius_m + line.spread_m_s * (at_s - line.t_s[0]),
            )
            return leaving, rest
    return line, None


def _steps(points_m: F64) -> Iterator[tuple[int, float]]:
    """(leg, share of it) along the line."""
    for leg, length_m in enumerate(np.linalg.norm(np.diff(points_m, axis=0), axis=1)):
        steps = max(1, int(np.ceil(length_m / STEP_M)))
        for step in range(1, steps + 1):
            yield leg, step / steps


def _balls_apart_m(one: TimedLine, two: TimedLine) -> float:
    """No balls of both are nearer to each other: at a glance, of many."""
    balls_m = sum(line.radius_m + line.spread_m_s * float(line.t_s[-1] - line.t_s[0]) for line in (one, two))
    return boxes_apart_m(one.points_enu_m, two.points_enu_m) - balls_m


def boxes_apart_m(one_enu_m: F64, other_enu_m: F64) -> float:
    """No places of both are nearer to each other."""
    gap_m = np.maximum(one_enu_m.min(axis=0) - other_enu_m.max(axis=0), other_enu_m.min(axis=0) - one_enu_m.max(axis=0))
    return float(np.linalg.norm(np.maximum(gap_m, 0.0)))


def _bare(line: TimedLine) -> TimedLine:
    """Where it is said to be, without the ball around it."""
    return replace(line, radius_m=0.0, spread_m_s=0.0)


def _silent_s(other: Flown, now_s: float) -> float:
    heard_s = other.state.position_t_mono_s
    return 0.0 if heard_s is None else now_s - heard_s


def _stands(state: VehicleState) -> bool:
    speeds_m_s = state.v_east_m_s, state.v_north_m_s, state.v_down_m_s
    return float(np.linalg.norm([speed or 0.0 for speed in speeds_m_s])) < STANDS_M_S
