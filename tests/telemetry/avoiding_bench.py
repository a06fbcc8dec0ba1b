"""A simulated vehicle in virtual time with avoidance on board, before walls that perfect sensors see."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from telemetry.flight.avoidance.avoiding import Avoiding
from telemetry.flight.guided.remaining_mission import RemainingMission, remaining_flight, remaining_from
from telemetry.mavlink.actions import Send
from telemetry.mavlink.reduce import reduce
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import Obstacle, PerceptionStatus, Region, Sensor
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.requests import Operator
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.simulator_bench import HOME, SLICE_S, Bench

NONE = (0.0, 0.0, 0.0, 0.0)
NORTH_PER_DEG = 111_195.0
SPEED_M_S = 3.0
AUTO, GUIDED, RTL, LOITER, BRAKE = 3, 4, 6, 5, 17
ME = Operator("Ann", 1)


def place(north_m: float, up_m: float, *, command: int = 16) -> Item:
    return Item(command, 3, NONE, HOME.lat_deg + north_m / NORTH_PER_DEG, HOME.lon_deg, up_m)


def mission(*places: Item) -> tuple[Item, ...]:
    up = Item(22, 3, NONE, 0.0, 0.0, places[0].alt_m)
    return (up, *places, Item(20, 0, NONE, 0.0, 0.0, 0.0))


FLIGHT = mission(place(45, 8), place(60, 8))


@dataclass
class Wall:
    """Across the way, from the ground to its top."""

    north_m: float
    top_m: float
    thick_m: float = 4.0
    half_wide_m: float = math.inf

    def ahead_m(
        self, north_m: float, up_m: float, depth_m: float, half_m: float = 1.0, east_m: float = 0.0
    ) -> float | None:
        """Distance to it for a vehicle that looks north, if it is in the region."""
        if up_m - half_m > self.top_m or north_m > self.north_m + self.thick_m or abs(east_m) > self.half_wide_m:
            return None
        away_m = max(0.0, self.north_m - north_m)
        return away_m if away_m <= depth_m else None


@dataclass
class Sense:
    """One sensor: what it says every ``period_s``."""

    sensor: Sensor
    depth_m: float
    period_s: float
    late_s: float = 0.05
    state: str = "running"
    text: str = ""
    silent: bool = False
    due_s: float = 0.0
    waiting: list[tuple[float, PerceptionStatus]] = field(default_factory=list)


class Craft:
    """``trail`` holds (time, north, up) of the truth, ``orders`` what avoidance sent, with the time."""

    speed_m_s = SPEED_M_S
    """Of the mission."""

    def __init__(self, items: tuple[Item, ...], walls: list[Wall], senses: list[Sense] | None = None) -> None:
        self.bench = self.made()
        self.walls = walls
        self.senses = [Sense("vision", 7.0, 0.2)] if senses is None else senses
        self.onboard = OnboardMission(items, HOME.lat_deg, HOME.lon_deg, HOME.alt_amsl_m, "digest")
        self.state = VehicleState(1, 1)
        self.avoiding = Avoiding((1, 1), remaining=self._remaining)
        self.trail: list[tuple[float, float, float]] = []
        self.orders: list[tuple[float, Any]] = []
        self.texts: list[str] = []
        self.states: list[str] = []
        self._read, self._hears = 0, False
        self._ticks = 0
        for name, rate_hz in ((33, 20), (30, 20), (42, 4), (245, 4), (242, 0.5)):
            self.bench.stream(name, rate_hz)

    def made(self) -> Bench:
        return Bench(heartbeat=True)

    def _remaining(self, state: VehicleState) -> RemainingMission | None:
        return remaining_flight(self.onboard, state)

    @property
    def now_s(self) -> float:
        return self.bench.now_s

    @property
    def truth(self) -> tuple[float, float, float]:
        return self.bench.vehicle.truth.p_neu

    def start(self) -> None:
        self.bench.until(lambda: self.bench.vehicle.autopilot.position_ok)
        home = (3, 16, 0.0, 0, 0, 0.0)
        rows = [(i.frame, i.command, 0.0, round(i.lat_deg * 1e7), round(i.lon_deg * 1e7), i.alt_m) for i in self.items]
        assert self.bench.upload([home, *rows]) == 0
        self.bench.set_parameters(WPNAV_SPEED=100 * self.speed_m_s)
        self.bench.fly_mission()
        self.until(lambda: self.state.mode == "AUTO" and self.state.landed == "in_air", 60)
        self.avoiding.enable(self.now_s)

    @property
    def items(self) -> tuple[Item, ...]:
        return self.onboard.items

    def until(self, there: Callable[[], bool], limit_s: float = 300.0) -> None:
        end_s = self.now_s + limit_s
        while not there():
            assert self.now_s < end_s, f"not there after {limit_s} s: {self.avoiding.status} {self.truth}"
            self.step()

    def advance(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while self.now_s < end_s - 1e-9:
            self.step()

    def step(self) -> None:
        self.bench.advance(SLICE_S)
        self._hear()
        self._sense()
        self._ticks += 1
        if self._ticks % 3 == 0:
            self.perform(self.avoiding.on_tick(self.now_s))
        north_m, _, up_m = self.truth
        self.trail.append((self.now_s, north_m, up_m))
        status = self.avoiding.status
        if not self.states or self.states[-1] != status.state:
            self.states.append(status.state)
        if status.text and (not self.texts or self.texts[-1] != status.text):
            self.texts.append(status.text)

    def perform(self, actions: list[Any]) -> None:
        for action in actions:
            assert isinstance(action, Send)
            self.orders.append((self.now_s, action.message))
            self.bench.send(action.message)
        if actions:
            self._hear()

    def _hear(self) -> None:
        """One message after the other: what an order to one of them brings is heard after it."""
        if self._hears:
            return
        self._hears = True
        while self._read < len(self.bench.heard):
            message = self.bench.heard[self._read].message
            self._read += 1
            self.hear(message)
        self._hears = False

    def hear(self, message: Any) -> None:
        self.perform(self.avoiding.on_message(message, self.now_s))
        new = reduce(self.state, message, t_mono_s=self.now_s, t_utc_s=self.now_s)
        if new is not None and new is not self.state:
            self.state = new
            self.perform(self.avoiding.on_state(new, self.now_s))

    def _sense(self) -> None:
        for sense in self.senses:
            if self.now_s >= sense.due_s:
                sense.due_s = self.now_s + sense.period_s
                if not sense.silent:
                    sense.waiting.append((self.now_s + sense.late_s, self._status(sense)))
            while sense.waiting and sense.waiting[0][0] <= self.now_s:
                self.perform(self.avoiding.on_perception(sense.waiting.pop(0)[1], self.now_s))

    def _status(self, sense: Sense) -> PerceptionStatus:
        north_m, east_m, up_m = self.truth
        ahead = [wall.ahead_m(north_m, up_m, sense.depth_m, east_m=east_m) for wall in self.walls]
        sideways = abs(math.sin(self.state.heading_rad or 0.0)) > 0.7  # then it looks along the walls
        found = [away_m for away_m in ahead if away_m is not None and not sideways]
        blank = replace(seen_at(min(found)), height_difference_m=0.0) if found else None
        region = Region((0.0, north_m, up_m), 0.0, sense.depth_m, math.radians(24), 2.0, bool(found))
        return PerceptionStatus(
            sensor=sense.sensor,
            state=sense.state,  # type: ignore[arg-type]
            text=sense.text,
            t_mono_s=self.now_s,
            t_utc_s=self.now_s,
            done_t_mono_s=self.now_s + sense.late_s,
            region=region,
            obstacles=() if blank is None else (blank,),
            latency_s=sense.late_s,
        )

    def sent(self, kind: str) -> list[Any]:
        return [message for _, message in self.orders if message.get_type() == kind]

    def modes(self) -> list[int]:
        return [int(m.param2) for m in self.sent("COMMAND_LONG") if m.command == 176]


def seen_at(distance_m: float, **changes: Any) -> Obstacle:
    plain = Obstacle(
        region="roi",
        distance_m=distance_m,
        bearing_deg=0.0,
        off_nose_deg=0.0,
        height_difference_m=1.0,
        time_to_contact_s=None,
        enu_m=(0.0, distance_m, 0.0),
        lat_deg=0.0,
        lon_deg=0.0,
        alt_amsl_m=0.0,
        voxels=3,
        size_m=(1.0, 1.0, 1.0),
    )
    return replace(plain, **changes)


def craft(*walls: Wall, senses: list[Sense] | None = None, items: Any = FLIGHT) -> Craft:
    made = Craft(items, list(walls), senses)
    made.start()
    return made


def state(it: Craft) -> str:
    return it.avoiding.status.state


def targets(*places: tuple[float, float, float]) -> tuple[GuidedTarget, ...]:
    """North, east and height above home of each."""
    return tuple(
        GuidedTarget(k, HOME.lat_deg + n / NORTH_PER_DEG, HOME.lon_deg + e / NORTH_PER_DEG * 1.2543, up_m, 3.0)
        for k, (n, e, up_m) in enumerate(places, start=1)
    )


def remaining_at(it: Craft, item: int) -> RemainingMission:
    remaining = remaining_from(it.onboard, item)
    assert remaining is not None
    return remaining
