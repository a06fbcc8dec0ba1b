"""The sensors node: ``python -m telemetry.nodes.sensors --runtime DIR [--world FILE] [--dsm FILE] [--dark] ...``.

A radar, a stereo camera and its SLAM on the simulated vehicle, in a process of their own: nothing that they compute
slows the vehicle. They look from where the simulator node says that the vehicle really is.
"""

from __future__ import annotations

import argparse
import asyncio
import dataclasses
import logging
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from telemetry.bus.bus import Bus
from telemetry.bus.node import LOOK_EVERY_S, NodeContext, run_node
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.sensors import (
    CLOUD_HZ,
    RADAR_HZ,
    SLAM_HZ,
    SlamDrift,
    StereoModel,
    StereoSensor,
    radar_sensor,
)
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import RadarKind, SimTruth

_log = logging.getLogger(__name__)

REST_HZ = 4.0
"""The radar's, while the vehicle is not armed."""
FRESH_S = 0.5
"""Older truths are looked from no more: the simulator has stopped."""
_TICK_S = 0.005
_SHAPE = 16 / 9


@dataclass(frozen=True, slots=True)
class SensorOptions:
    world: Path | None = None
    dsm: Path | None = None
    seed: int = 0
    dark: bool = False
    """At night."""
    radar: RadarKind = "model"
    points: int = 20_000
    """Rays of the stereo camera."""


def main(arguments: Sequence[str] | None = None) -> int:
    """The process's exit code."""
    given = _parser().parse_args(arguments)
    fields = {field.name: getattr(given, field.name) for field in dataclasses.fields(SensorOptions)}
    options = SensorOptions(**fields)
    return run_node("sensors", given.runtime, lambda bus, context: sense(bus, context, options))


async def sense(bus: Bus, context: NodeContext, options: SensorOptions) -> None:
    """Until nobody has been there for a minute. Raises DescribedError for a broken world."""
    newest = _Newest()
    tasks = (asyncio.ensure_future(_follow(bus, newest)), asyncio.ensure_future(_work(bus, options, newest)))
    try:
        while context.is_needed() and not any(task.done() for task in tasks):
            context.set_replaceable(newest.fresh() is None)
            await asyncio.wait(tasks, timeout=LOOK_EVERY_S, return_when=asyncio.FIRST_COMPLETED)
    finally:
        ended = [task for task in tasks if task.done()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in ended:
        task.result()


class _Newest:
    """The newest truth, and a way to wait for one that is due."""

    def __init__(self) -> None:
        self.truth: SimTruth | None = None
        self.came = asyncio.Event()

    def fresh(self, *, at_rest: bool = False) -> SimTruth | None:
        """While the vehicle is armed, or ``at_rest`` as well."""
        truth = self.truth
        if truth is None or not (truth.armed or at_rest) or time.monotonic() - truth.t_mono_s > FRESH_S:
            return None
        return truth


async def _follow(bus: Bus, newest: _Newest) -> None:
    async for _, truth in bus.subscribe(Topic.TRUTH):
        if isinstance(truth, SimTruth):
            newest.truth = truth
            newest.came.set()


async def _work(bus: Bus, options: SensorOptions, newest: _Newest) -> None:
    await newest.came.wait()
    assert newest.truth is not None
    suite = await asyncio.to_thread(_Suite, options, newest.truth)
    _log.info("Sensors look out at %s.", suite.world.name or "level ground")
    async with asyncio.TaskGroup() as group:
        group.create_task(_radar(bus, suite, newest))
        group.create_task(_stereo(bus, suite, newest))
        group.create_task(_slam(bus, suite, newest))


class _Suite:
    """The sensors in their world, each looked through once: numba compiles now and not in flight."""

    def __init__(self, options: SensorOptions, truth: SimTruth) -> None:
        self.world = _world(options, NeuFrame(truth.home_lat_deg, truth.home_lon_deg, truth.home_alt_amsl_m))
        rows = max(8, round((options.points / _SHAPE) ** 0.5))
        model = StereoModel(columns=round(rows * _SHAPE), rows=rows)
        self._make(options, model)
        self.radar.frame(truth)
        self.stereo.frame(truth)
        self._make(options, model)

    def _make(self, options: SensorOptions, model: StereoModel) -> None:
        self.radar = radar_sensor(options.radar, self.world, seed=options.seed)
        self.stereo = StereoSensor(self.world, seed=options.seed, dark=options.dark, model=model)
        self.slam = SlamDrift(seed=options.seed)


def _world(options: SensorOptions, frame: NeuFrame) -> World:
    from planning.terrain.geotiff import read_dsm

    dsm = read_dsm(options.dsm) if options.dsm else None
    if options.world:
        return World.load(options.world, frame=frame, dsm=dsm)
    return World.empty(frame, dsm=dsm)


async def _radar(bus: Bus, suite: _Suite, newest: _Newest) -> None:
    """At rest, too, as real ones do: before a start it must be seen that they work."""
    beat = _Beat(RADAR_HZ, rest_hz=REST_HZ)
    while True:
        truth = await beat.next(newest)
        bus.publish(Topic.RADAR_FRAME, await asyncio.to_thread(suite.radar.frame, truth))


async def _stereo(bus: Bus, suite: _Suite, newest: _Newest) -> None:
    beat = _Beat(CLOUD_HZ)
    while True:
        truth = await beat.next(newest)
        bus.publish(Topic.CLOUD_FRAME, await asyncio.to_thread(suite.stereo.frame, truth))


async def _slam(bus: Bus, suite: _Suite, newest: _Newest) -> None:
    beat = _Beat(SLAM_HZ)
    while True:
        truth = await beat.next(newest)
        bus.publish(Topic.SLAM_POSE, suite.slam.pose(truth, suite.stereo.share_seen))


class _Beat:
    """Waits for a new truth once a period has passed; a period that was missed is not made up for."""

    def __init__(self, rate_hz: float, *, rest_hz: float | None = None) -> None:
        """``rest_hz``: of a vehicle that is not armed; None: then nobody looks out."""
        self._period_s = 1.0 / rate_hz
        self._rest_period_s = None if rest_hz is None else 1.0 / rest_hz
        self._due_s = -np.inf
        self._last_t_mono_s = -np.inf

    async def next(self, newest: _Newest) -> SimTruth:
        while True:
            now_s, truth = time.monotonic(), newest.fresh(at_rest=self._rest_period_s is not None)
            if now_s >= self._due_s and truth is not None and truth.t_mono_s > self._last_t_mono_s:
                rest_s = 0.0 if truth.armed or self._rest_period_s is None else self._rest_period_s - self._period_s
                self._due_s = max(self._due_s + self._period_s, now_s) + rest_s
                self._last_t_mono_s = truth.t_mono_s
                return truth
            await asyncio.sleep(max(_TICK_S, self._due_s - now_s))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"{__package__}.sensors", description="Sensors of a simulated vehicle.")
    default = SensorOptions()
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus")
    parser.add_argument("--world", type=Path, help="world file (docs/worlds.md)")
    parser.add_argument("--dsm", type=Path, help="surface model that stands around the vehicle")
    parser.add_argument("--seed", type=int, default=default.seed)
    parser.add_argument("--dark", action="store_true", help="at night: the camera sees nothing")
    parser.add_argument(
        "--radar", choices=get_args(RadarKind), default=default.radar, help="targets (model) or samples, processed (iq)"
    )
    parser.add_argument("--points", type=int, default=default.points, help="rays of the stereo camera")
    return parser


if __name__ == "__main__":
    sys.exit(main())
