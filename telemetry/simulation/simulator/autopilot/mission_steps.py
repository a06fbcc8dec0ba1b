"""A mission as the simulated autopilot holds it: steps that move the vehicle, and steps that only set something."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

StepKind = Literal[
    "home", "takeoff", "waypoint", "loiter", "loiter_time", "delay", "land", "return", "jump", "speed", "yaw", "nothing"
]
MOVES = ("takeoff", "waypoint", "loiter", "loiter_time", "delay", "land", "return")
"""Kinds that take time; the others are done on the way to the next of these."""
NAMES: dict[str, str] = {
    "takeoff": "Takeoff",
    "waypoint": "WP",
    "loiter": "LoitUnlim",
    "loiter_time": "LoitTime",
    "delay": "Delay",
    "land": "Land",
    "return": "RTL",
}
"""ArduCopter's own, for its messages."""


@dataclass(frozen=True, slots=True)
class Step:
    kind: StepKind
    lat_deg: float = 0.0
    """Latitude and longitude 0: where the vehicle is."""
    lon_deg: float = 0.0
    alt_m: float = 0.0
    above: Literal["home", "sea"] = "home"
    seconds: float = 0.0
    """Hold, loiter or delay."""
    values: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    """Parameters of a step that sets something: speed type and m/s; heading; jump target and repeats."""


@dataclass(slots=True)
class MissionSteps:
    """``first``: number of the first step that is flown; before it stands home, for ArduCopter. ``current`` is the step
    that is flown to, or would be.
    """

    steps: list[Step] = field(default_factory=list)
    current: int = 0
    jumps_done: dict[int, int] = field(default_factory=dict)
    first: int = 1

    def next_move(self, start: int) -> tuple[int | None, list[Step]]:
        """Index of the first step from ``start`` on that moves the vehicle, and what is to be set before it."""
        settings: list[Step] = []
        at = start
        for _ in range(4 * len(self.steps) + 4):
            if at >= len(self.steps):
                return None, settings
            step = self.steps[at]
            if step.kind in MOVES:
                return at, settings
            if step.kind == "jump":
                at = self._jump(at, step)
            else:
                settings.append(step)
                at += 1
        return None, settings

    def peek_move(self, start: int) -> int | None:
        """As ``next_move``, without counting jumps."""
        done = dict(self.jumps_done)
        found = self.next_move(start)[0]
        self.jumps_done = done
        return found

    def restart(self) -> None:
        self.current = 0
        self.jumps_done.clear()

    def _jump(self, at: int, step: Step) -> int:
        target, repeats = int(step.values[0]), int(step.values[1])
        done = self.jumps_done.get(at, 0)
        if not self.first <= target < len(self.steps) or (repeats >= 0 and done >= repeats):
            return at + 1
        self.jumps_done[at] = done + 1
        return target
