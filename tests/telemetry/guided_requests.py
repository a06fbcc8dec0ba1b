"""Targets in a line north of home, and what the navigation script is asked with them."""

from __future__ import annotations

from typing import Any

from telemetry.topics.messages import GuidedTarget
from telemetry.topics.requests import Operator, StartGuided
from tests.telemetry.guided_vehicle import HOME, METRES_PER_DEG


def target(item: int, north_m: float, up_m: float = 10.0, **more: Any) -> GuidedTarget:
    return GuidedTarget(item, HOME[0] + north_m / METRES_PER_DEG, HOME[1], up_m, more.pop("speed_m_s", 2.0), **more)


LINE = (target(3, 3), target(4, 8), target(5, 13, 12.0), target(7, 18))


def request(targets: tuple[GuidedTarget, ...] = LINE, **more: Any) -> StartGuided:
    return StartGuided(Operator("Ada", 1), targets, 10.0, **more)
