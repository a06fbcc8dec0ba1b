"""Missions and runs that the tests of the mission transfer share."""

from __future__ import annotations

import random
from typing import Any

from telemetry.mavlink.upload import MissionUpload
from telemetry.topics.onboard_lists import Item
from tests.telemetry.lossy import VEHICLE, Faults, Run
from tests.telemetry.mission_vehicles import HOME, ArduCopter, Px4

HARSH = Faults(loss=0.3, reordering=0.1, duplicates=0.02, corruption=0.01)
WORSE = Faults(loss=0.5, reordering=0.1, duplicates=0.02, corruption=0.01)
STILL = (0.0, 0.0, 0.0, 0.0)


def waypoint(number: int, *, alt_m: float = 20.0, hold_s: float = 0.0) -> Item:
    return Item(16, 3, (hold_s, 0.0, 0.0, 0.0), -37.1244507 - number * 2.5e-5, 175.6892878, alt_m)


def mission(count: int, *, seed: int = 0) -> tuple[Item, ...]:
    """Take-off, waypoints on the centimetre grid as the planner makes them, return."""
    rng = random.Random(seed)
    takeoff = Item(22, 3, STILL, -37.1244507, 175.6892878, 13.552)
    points = [waypoint(k, alt_m=rng.randrange(1300, 5000) / 100 + 0.002, hold_s=k % 3) for k in range(count - 2)]
    return (takeoff, *points, Item(20, 2, STILL, 0.0, 0.0, 0.0))


def upload(items: tuple[Item, ...], vehicle: Any, faults: Faults = Faults(), *, seed: int = 0, **options: Any) -> Run:  # noqa: B008
    """A whole upload on a clock of its own."""
    firmware = "px4" if isinstance(vehicle, Px4) else "ardupilot"
    machine = MissionUpload(items, HOME, firmware=firmware, target=VEHICLE)
    return Run(machine, vehicle, faults, seed, **options).until_end()


VEHICLES = (ArduCopter, Px4)
