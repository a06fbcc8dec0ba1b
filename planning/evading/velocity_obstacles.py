"""Velocities that lead into obstacles, and the nearest one that leads into none (Wessendorp 2021, III-C)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64, I64, Bools
from planning.errors import ParameterError
from planning.evading.velocity_choice import Forbidden, Limits, within

__all__ = ["Approach", "Cone", "Limits", "Obstacles", "Proposal", "approaches", "cones", "proposal_of", "propose"]


MOST_EXACT = 40
"""With more cones in the way than this, the velocity is searched on a grid."""
STILL_M_S = 1e-6
"""Slower than this relative to each other nothing meets within a flight."""
SPARE_M, SPARE_M_S = 1e-3, 1e-3
"""What is proposed keeps so much from a cone's edge and apex, so that rounding never puts it inside."""


@dataclass(frozen=True, slots=True)
class Obstacles:
    """Discs that go straight on, as the vehicle at ``position_enu_m`` sees them, all in the plane.

    Their radii are the obstacles' own, grown by the vehicle's and by whatever else must be kept: the vehicle itself
    is a point (the paper's configuration space).
    """

    position_enu_m: F64
    """(2,) Of the vehicle."""
    obstacles_enu_m: F64
    """(N, 2)"""
    velocities_enu_m_s: F64
    """(N, 2) Over ground."""
    radius_m: F64
    """(N,)"""

    @classmethod
    def of(
        cls,
        position_enu_m: ArrayLike,
        obstacles_enu_m: ArrayLike,
        velocities_enu_m_s: ArrayLike,
        *,
        radius_m: ArrayLike,
    ) -> Obstacles:
        """``radius_m``: one for all, or (N,). Raises ParameterError for what is no number."""
        places = np.asarray(obstacles_enu_m, np.float64).reshape(-1, 2)
        velocities = np.asarray(velocities_enu_m_s, np.float64).reshape(-1, 2)
        if len(velocities) != len(places):
            raise ParameterError(
                f"There are {len(places)} obstacles but {len(velocities)} velocities.", where="velocities_enu_m_s"
            )
        radius = np.broadcast_to(np.asarray(radius_m, np.float64), (len(places),))
        own = np.asarray(position_enu_m, np.float64).reshape(2)
        for name, values in (
            ("position_enu_m", own),
            ("obstacles_enu_m", places),
            ("velocities_enu_m_s", velocities),
            ("radius_m", radius),
        ):
            if not np.isfinite(values).all():
                raise ParameterError(
                    f"{values[~np.isfinite(values)].flat[0]} is no number to avoid by.",
                    where=name,
                    advice="Leave out what is not known.",
                )
        if (radius < 0).any():
            raise ParameterError(f"{radius.min():g} m is no radius.", where="radius_m", advice="Give 0 or more.")
        return cls(own, places, velocities, radius)

    def nearest(self) -> Obstacles:
        """Only the nearest one, as the paper's vehicle did."""
        return self.some(np.argsort(self.range_m, kind="stable")[:1])

    def some(self, which: I64 | Bools) -> Obstacles:
        return Obstacles(
            self.position_enu_m, self.obstacles_enu_m[which], self.velocities_enu_m_s[which], self.radius_m[which]
        )

    @property
    def offset_enu_m(self) -> F64:
        """(N, 2) From the vehicle."""
        return self.obstacles_enu_m - self.position_enu_m

    @property
    def range_m(self) -> F64:
        return np.hypot(*self.offset_enu_m.T)


@dataclass(frozen=True, slots=True)
class Cone:
    """The vehicle's velocities over ground that come nearer to one obstacle than its radius: a velocity obstacle."""

    apex_enu_m_s: tuple[float, float]
    """The obstacle's own velocity."""
    axis_rad: float
    """Towards the obstacle, clockwise from north."""
    half_angle_rad: float
    """asin(radius / range); a right angle where the obstacle is inside the radius: whatever gets nearer."""


@dataclass(frozen=True, slots=True)
class Approach:
    """How near two get that both go straight on."""

    closest_m: F64
    """(N,) Between middles."""
    after_s: F64
    """(N,) 0: it is not getting nearer."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """A velocity that leads into nothing."""

    velocity_enu_m_s: tuple[float, float]
    turn_rad: float
    """Clockwise from the present velocity; 0 where there is none or none is left."""
    hold_s: float
    """Until it has passed everything that it evades."""
    closest_m: float
    """Predicted closest approach of all; infinite without obstacles."""
    evades: tuple[int, ...]
    """Indices of the obstacles that made it what it is; empty: the present velocity, as far as the limits allow."""


def approaches(obstacles: Obstacles, velocity_enu_m_s: ArrayLike) -> Approach:
    """To each obstacle at the vehicle's ``velocity_enu_m_s`` (2,)."""
    offset, rate = obstacles.offset_enu_m, obstacles.velocities_enu_m_s - _velocity(velocity_enu_m_s)
    closing = -(offset * rate).sum(axis=1)
    speed2 = (rate * rate).sum(axis=1)
    nears = (closing > 0.0) & (speed2 > STILL_M_S**2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = np.abs(offset[:, 0] * rate[:, 1] - offset[:, 1] * rate[:, 0]) / np.sqrt(speed2)
        after = closing / speed2
    return Approach(np.where(nears, across, obstacles.range_m), np.where(nears, after, 0.0))


def cones(obstacles: Obstacles) -> list[Cone]:
    """One per obstacle. A radius beyond the range is safe: there is no angle whose sine is more than 1."""
    axis = np.arctan2(*obstacles.offset_enu_m.T)
    half = _half_angle(obstacles.range_m, obstacles.radius_m)  # Wessendorp 2021, fig. 3
    return [
        Cone((float(v[0]), float(v[1])), float(a), float(h))
        for v, a, h in zip(obstacles.velocities_enu_m_s, axis, half, strict=True)
    ]


def propose(
    obstacles: Obstacles, velocity_enu_m_s: ArrayLike, limits: Limits | None = None, *, nearest_only: bool = False
) -> Proposal | None:
    """The velocity nearest to the present one, within the limits, that is in no cone; None where there is none.

    With ``nearest_only`` as in the paper: out of the nearest obstacle's cone over its nearer edge. Otherwise out of
    the union of all cones, to the nearest point of what is left, which is on an edge or where two borders cross.
    Obstacles already inside their radius must be left behind at ``Limits.leave_m_s`` at least. Raises ParameterError.
    """
    limits = limits or Limits()
    velocity = _velocity(velocity_enu_m_s)
    looked_at = obstacles.nearest() if nearest_only else obstacles
    exact, wide = _forbidden(looked_at, limits, 0.0), _forbidden(looked_at, limits, SPARE_M_S)
    active = np.zeros(len(exact), np.bool_)
    while True:
        chosen = within(
            velocity, limits, exact.some(active), wide.some(active), exact_search=active.sum() <= MOST_EXACT
        )
        if chosen is None:
            return None
        hit = exact.contains(chosen[None])[0]
        if not hit.any():
            return _proposal(looked_at, velocity, chosen, active)
        active |= hit


def proposal_of(obstacles: Obstacles, velocity: F64, chosen: F64) -> Proposal:
    """Of a velocity that was chosen by other means: it evades whatever the present one leads into."""
    return _proposal(obstacles, velocity, chosen, _forbidden(obstacles, Limits(), 0.0).contains(velocity[None])[0])


def _proposal(obstacles: Obstacles, velocity: F64, chosen: F64, active: Bools) -> Proposal:
    coming = approaches(obstacles, chosen)
    turn = 0.0
    if velocity.any() and chosen.any():
        turn = math.remainder(math.atan2(*chosen) - math.atan2(*velocity), 2 * math.pi)
    return Proposal(
        velocity_enu_m_s=(float(chosen[0]), float(chosen[1])),
        turn_rad=turn,
        hold_s=float(coming.after_s[active].max(initial=0.0)),
        closest_m=float(coming.closest_m.min(initial=math.inf)),
        evades=tuple(np.flatnonzero(active).tolist()),
    )


def _forbidden(obstacles: Obstacles, limits: Limits, spare_m_s: float) -> Forbidden:
    """The cones; with something to spare they are wider by ``SPARE_M`` and their apexes lie as much further back."""
    range_m = obstacles.range_m
    spare_m = SPARE_M if spare_m_s else 0.0
    inside = range_m < obstacles.radius_m
    away = range_m > 0.0
    towards = np.where(away[:, None], obstacles.offset_enu_m, obstacles.velocities_enu_m_s)
    length = np.hypot(*towards.T)
    unit = np.where(length[:, None] > 0.0, towards / np.where(length > 0.0, length, 1.0)[:, None], [0.0, 1.0])
    back_m_s = np.where(inside, limits.leave_m_s, 0.0) + spare_m_s
    return Forbidden.of(
        obstacles.velocities_enu_m_s - back_m_s[:, None] * unit,
        unit,
        _half_angle(range_m, obstacles.radius_m + spare_m),
    )


def _half_angle(range_m: F64, radius_m: F64) -> F64:
    return np.where(range_m > radius_m, np.arcsin(np.minimum(radius_m / np.maximum(range_m, 1e-12), 1.0)), math.pi / 2)


def _velocity(velocity_enu_m_s: ArrayLike) -> F64:
    velocity = np.asarray(velocity_enu_m_s, np.float64).reshape(2)
    if not np.isfinite(velocity).all():
        raise ParameterError(
            f"The vehicle's velocity is {velocity.tolist()}.", where="velocity_enu_m_s", advice="Wait for a fix."
        )
    return velocity
