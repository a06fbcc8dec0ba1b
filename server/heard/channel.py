"""One vehicle as the pages see it: the live one, or the one of a recording."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import NamedTuple

from server.heard.flown_track import Track
from server.heard.led_way import LedWay
from server.heard.plan_follower import Ahead, Follower
from server.schemas import (
    FlightMessage,
    FollowDoc,
    HealthMessage,
    Pages,
    Source,
    TextMessage,
    TrackMessage,
    VehicleMessage,
)
from server.work.bucket import Bucket
from telemetry.flight.health import NOT_READ, Health, HealthRow
from telemetry.topics.messages import FlightStatus, VehicleText
from telemetry.topics.vehicle import VehicleState

RATE_HZ, BURST = 20.0, 20.0
"""Of positions: the link sends no more on average, so that in flight none waits; a fast replay sends many more."""
QUIET_S = 0.05
"""What is no new position waits for the next one, but no longer."""


HEALTH_EVERY_S = 1.0


class HealthTold(NamedTuple):
    at_mono_s: float = float("-inf")
    rows: tuple[HealthRow, ...] | None = None


class ShownWay(NamedTuple):
    """A guided way that is judged or flown."""

    places: tuple[tuple[float, float, float], ...]
    """(K,) lat_deg, lon_deg, alt_rel_home_m"""
    is_certified: bool


class Channel:
    """Publishes each new position as soon as it comes, but no faster than pages draw; lives on the event loop."""

    def __init__(
        self,
        source: Source,
        pages: Pages,
        *,
        now_mono_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._source: Source = source
        self._pages, self._now_mono_s = pages, now_mono_s
        self._pace = Bucket(RATE_HZ, BURST, 0.0)
        self._waiting: asyncio.TimerHandle | None = None
        self._told_mono_s = float("-inf")
        self.follower = Follower()
        self.returns = NOT_READ
        """How the vehicle returns, as its settings were read last."""
        self.track = Track()
        self._health, self._health_told = Health(), HealthTold()
        self.state: VehicleState | None = None
        self.flight = FlightStatus()
        self.follow: FollowDoc | None = None
        self.way: ShownWay | None = None
        self.led: LedWay | None = None
        """The way that is flown, where it is a single guided one."""

    @property
    def armed(self) -> bool:
        return self.state is not None and self.state.armed

    @property
    def in_air(self) -> bool:
        return self.state is not None and self.state.armed and self.state.landed != "on_ground"

    @property
    def is_led_apart(self) -> bool:
        """It is flown in GUIDED, and not along its plan."""
        return self.flight.way == "guided" and self.flight.target is None

    def ahead(self) -> Ahead | None:
        """What is left of the plan that is flown; None where nothing tells it."""
        return None if self.is_led_apart else self.follower.ahead(self.flight)

    def led_ahead(self) -> Ahead | None:
        """Of the single way that is ordered or flown, and of a plan's whole line while it takes off: where it may be
        besides. None while a way is paused, or where nothing tells it."""
        if self.led is not None and self.state is not None:
            is_held = self.flight.phase == "paused" and not self.led.is_new
            return None if is_held else self.led.ahead(self.state)
        if self.flight.phase != "taking_off" or self.is_led_apart:
            return None
        return self.follower.rising()

    @property
    def battery(self) -> str:
        """In words, as it was told last; empty: it was not."""
        return next((row.value for row in self._health_told.rows or () if row.code == "battery"), "")

    @property
    def home(self) -> tuple[float, float] | None:
        """(lat_deg, lon_deg)"""
        state = self.state
        if state is None or state.home_lat_deg is None or state.home_lon_deg is None:
            return None
        return state.home_lat_deg, state.home_lon_deg

    def on_state(self, state: VehicleState) -> None:
        """A new flight begins where the vehicle arms: its path starts afresh."""
        before, self.state = self.state, state
        self._health.on_state(state)
        begins = state.armed and (before is None or not before.armed)
        if begins and self._source == "live":
            self.restart_track()
        self.track.see(state)
        moved = before is None or before.position_t_mono_s != state.position_t_mono_s
        wait_s = max(0.0, 1.0 - self._pace.left(self._now_mono_s())) / RATE_HZ if moved else QUIET_S
        if wait_s == 0.0:
            self._pace.spend(1.0)
            self._publish()
        elif self._waiting is None:
            self._waiting = asyncio.get_running_loop().call_later(wait_s, self._publish)

    def on_flight(self, flight: FlightStatus) -> None:
        self.flight = flight
        self._pages.publish(FlightMessage(source=self._source, flight=flight))

    def on_text(self, text: VehicleText) -> None:
        self._pages.publish(TextMessage(source=self._source, text=text))

    def forget(self) -> None:
        """The vehicle is another one, or gone."""
        self.state, self.follow = None, None
        self._health, self._health_told = Health(), HealthTold()
        self.restart_track()
        self._publish()

    def restart_track(self) -> None:
        self.track.clear()
        self.follower.begin_again()
        self.publish_track()

    def prepend(self, states: list[VehicleState]) -> None:
        """What was flown before this server began to listen."""
        later = [state for state in self.track.states if not states or state.t_utc_s > states[-1].t_utc_s]
        self.track.clear()
        self.follower.begin_again()
        for state in (*states, *later):
            self.track.add(state, self.follower.follow(state))
        self.publish_track()

    def publish_track(self) -> None:
        self._pages.publish(TrackMessage(track=self.track.doc(self._source)))

    def tick(self) -> None:
        """Once a second: when nothing is heard, ages go on running."""
        if self.state is not None and self._now_mono_s() - self._told_mono_s >= 1.0:
            self._publish()

    def close(self) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None

    def _publish(self) -> None:
        self.close()
        state = self.state
        self.follow = None if state is None else self.follower.follow(state, self.flight)
        if state is not None and (state.armed or self._source == "replay"):
            self.track.add(state, self.follow)
        self._told_mono_s = self._now_mono_s()
        self._pages.publish(
            VehicleMessage(source=self._source, now_mono_s=self._told_mono_s, state=state, follow=self.follow)
        )
        self._tell_health()

    def _tell_health(self) -> None:
        """Words that a pilot reads: once a second, and only when they change."""
        if self._told_mono_s - self._health_told.at_mono_s < HEALTH_EVERY_S:
            return
        live_mono_s = self._told_mono_s if self._source == "live" else None
        state = self.state
        profile, returns = self.follower.profile, self.returns
        rows = () if state is None else self._health.rows(state, profile, now_mono_s=live_mono_s, returns=returns)
        if rows != self._health_told.rows:
            self._pages.publish(HealthMessage(source=self._source, rows=list(rows)))
        self._health_told = HealthTold(self._told_mono_s, rows)
