"""Leads a vehicle from target to target by a feed of position and velocity; after silence from where it is then."""

from __future__ import annotations

import math
from collections.abc import Sequence

from telemetry.flight.guided.feed import FedLeg, Feed, SetPoint, bounds_of
from telemetry.flight.guided.orders import Place
from telemetry.topics.messages import GuidedTarget

PASSING_S = 0.5
"""A corner that is not stood at may be passed so much earlier than at its radius: the vehicle follows a little late."""
SILENT_S = 0.5
EARLY_S = 0.005
"""A clock's ticks are not to the millisecond."""
TURNED_RAD, TURN_S, TURNING_M_S = math.radians(20.0), 8.0, 0.5
"""Until the nose points where it should, and no longer than this, it flies slowly: sensors look ahead."""


class Leading:
    """``go`` to the next target; then ``set_point`` again and again, which says what is to be sent when it is due."""

    def __init__(self, feed: Feed) -> None:
        self.feed = feed
        self._leg: FedLeg | None = None
        self._led_s = self._sent_s = self._turns_until_s = -math.inf

    @property
    def is_over(self) -> bool:
        """The place has come to the leg's end."""
        return self._leg is not None and self._leg.is_over

    @property
    def early_m(self) -> float:
        return 0.0 if self._leg is None else PASSING_S * self._leg.out_m_s

    def go(self, start: Place, left: Sequence[GuidedTarget], now_s: float) -> None:
        """Along the straight line from ``start`` to the first of these targets, with the others in mind."""
        speed_m_s = self._leg.out_m_s if self._leg is not None else 0.0
        bounds = bounds_of(start, left, self.feed)[0]
        self._leg = FedLeg(start, left[0], bounds, self.feed, speed_m_s=speed_m_s)
        self._led_s, self._sent_s, self._turns_until_s = now_s, -math.inf, now_s + TURN_S

    def limit(self, left: Sequence[GuidedTarget]) -> None:
        """The same targets, at other speeds."""
        if self._leg is not None:
            self._leg.limit(bounds_of(self._leg.start, left, self.feed)[0])

    def stop(self) -> None:
        self._leg = None

    def set_point(self, at: Place, now_s: float, *, heading_rad: float | None) -> SetPoint | None:
        """``at``: where the vehicle is now, and its nose; not to be called while that is not known."""
        if self._leg is None or now_s - self._sent_s < self.feed.period_s - EARLY_S:
            return None
        if now_s - self._led_s > SILENT_S:
            self._leg.catch_up(at)
        else:
            most_m_s = TURNING_M_S if self._turns(at, heading_rad, now_s) else math.inf
            self._leg.advance(now_s - self._led_s, at, most_m_s=most_m_s)
        self._led_s = self._sent_s = now_s
        return self._leg.set_point(at.home_alt_amsl_m, heading_rad)

    def _turns(self, at: Place, heading_rad: float | None, now_s: float) -> bool:
        """The nose has not turned yet; once it has, swaying does not slow the leg."""
        if now_s >= self._turns_until_s or heading_rad is None or at.heading_rad is None:
            return False
        if abs(math.remainder(heading_rad - at.heading_rad, math.tau)) > TURNED_RAD:
            return True
        self._turns_until_s = -math.inf
        return False
