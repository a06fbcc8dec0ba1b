"""Approach alerts: an object, moving or not, whose closest approach will be inside its safety radius, soon."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from telemetry.topics.obstacles import ObstacleAlert
from telemetry.tracking.followed import UNSEEN_S, Followed, Keep

BEGIN_FRAMES = 3
"""So many frames in a row: a single estimate may be off."""
KEEP_RADII, KEEP_TIMES = 1.5, 1.25
"""An approach goes on until it will stay out of so many radii, or lies so many times the alerted time ahead."""
OUT_S = 1.5
FOLLOWED_AFRESH = "Objects are followed afresh: look out"
LANDED = "On the ground: nothing on a collision course is alerted"
TELL_AGAIN_S = 1.0


@dataclass(slots=True)
class _Approach:
    frames: int = 0
    id: str = ""
    """Empty: not alerted yet."""
    coming_s: float = 0.0
    """When it was last on a collision course, seen or foretold."""
    sighted_s: float = 0.0
    """When its last echo came."""
    sighted: str = ""
    """Where that was."""
    what: str = ""
    told_s: float = 0.0
    text: str = ""

    def look(self, one: Followed, heading_rad: float, t_s: float) -> None:
        if one.state.seen:
            self.sighted_s, self.sighted = t_s, _where(one, heading_rad)


class ApproachBook:
    """All approaches that are not over. ``prefix`` begins every id; each run of a node has its own."""

    def __init__(self, prefix: str, utc_minus_mono_s: float) -> None:
        self._prefix, self._utc_minus_mono_s = prefix, utc_minus_mono_s
        self._of: dict[int, _Approach] = {}
        self._count = 0

    def observe(
        self,
        followed: Sequence[Followed],
        *,
        heading_rad: float,
        keep: Keep,
        t_mono_s: float,
        done_t_mono_s: float,
    ) -> list[ObstacleAlert]:
        """After a frame, of what moves and of what stands still."""
        out: list[ObstacleAlert] = []
        for one in followed:
            known = self._of.get(one.id)
            begins = one.is_dangerous(keep)
            goes_on = known is not None and bool(known.id) and _goes_on(one, keep)
            if not begins and not goes_on:
                if known is not None:
                    known.look(one, heading_rad, t_mono_s)
                self._drop_candidate(one.id)
                continue
            if not one.state.seen and (known is None or not known.id):
                continue  # where nothing was seen is a guess, which begins no alert
            known = self._of.setdefault(one.id, _Approach())
            known.look(one, heading_rad, t_mono_s)
            known.frames, known.coming_s, known.text = known.frames + 1, t_mono_s, words(one, heading_rad)
            known.what = what(one)
            out += self._tell(known, t_mono_s, done_t_mono_s)
        for gone in self._of.keys() - {one.id for one in followed}:
            self._drop_candidate(gone)
        return out + self.pass_time(t_mono_s, done_t_mono_s)

    def pass_time(self, t_mono_s: float, done_t_mono_s: float) -> list[ObstacleAlert]:
        """What has not been so for long enough is over."""
        over = [key for key, one in self._of.items() if one.id and t_mono_s - one.coming_s >= OUT_S]
        return self._end(over, t_mono_s, done_t_mono_s)

    def end_all(self, t_mono_s: float, done_t_mono_s: float, why: str) -> list[ObstacleAlert]:
        """For a reason that has nothing to do with the objects, which are as near as they are."""
        return self._end(list(self._of), t_mono_s, done_t_mono_s, why)

    def _tell(self, one: _Approach, t_s: float, done_s: float) -> list[ObstacleAlert]:
        if not one.id:
            if one.frames < BEGIN_FRAMES:
                return []
            self._count += 1
            one.id, one.told_s = f"{self._prefix}-{self._count}", t_s
            return [self._alert(one, "begins", t_s, done_s, one.text)]
        if t_s - one.told_s < TELL_AGAIN_S:
            return []
        one.told_s = t_s
        return [self._alert(one, "goes_on", t_s, done_s, one.text)]

    def _end(self, keys: Sequence[int], t_s: float, done_s: float, why: str = "") -> list[ObstacleAlert]:
        ended = [self._of.pop(key) for key in keys]
        return [self._alert(one, "ends", t_s, done_s, why or _last_words(one, t_s)) for one in ended if one.id]

    def _drop_candidate(self, key: int) -> None:
        if key in self._of and not self._of[key].id:
            del self._of[key]

    def _alert(
        self, one: _Approach, phase: Literal["begins", "goes_on", "ends"], t_s: float, done_s: float, text: str
    ) -> ObstacleAlert:
        t_utc_s = t_s + self._utc_minus_mono_s
        return ObstacleAlert(one.id, "radar", "approach", phase, t_s, t_utc_s, done_s, text)


def _goes_on(one: Followed, keep: Keep) -> bool:
    radius_m, within_s = keep.of(moving=one.moving)
    near = one.closest_m < KEEP_RADII * radius_m and 0.0 < one.closest_in_s <= KEEP_TIMES * within_s
    return near and one.unseen_s <= UNSEEN_S


def _last_words(one: _Approach, t_s: float) -> str:
    """Only what was seen to be off the course just now is no danger: what nobody sees may still be coming."""
    if one.sighted_s > one.coming_s and t_s - one.sighted_s <= UNSEEN_S:
        return f"{one.what}: not on a collision course any more"
    return f"{one.what} no longer in sight: look out, last {one.sighted}"


def words(one: Followed, heading_rad: float) -> str:
    """One line for the pilot."""
    where = _where(one, heading_rad)
    return f"{what(one)} {where}, closest {one.closest_m:.1f} m in {one.closest_in_s:.1f} s"


def what(one: Followed) -> str:
    return "Moving object" if one.moving else "Standing object"


def _where(one: Followed, heading_rad: float) -> str:
    """ "31 m ahead" """
    off = math.remainder(one.bearing_rad - heading_rad, math.tau)
    clock = round(off / (math.pi / 6)) % 12 or 12
    return f"{one.range_m:.0f} m " + ("ahead" if clock == 12 else f"at {clock} o'clock")
