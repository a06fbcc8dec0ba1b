"""The sensors node: what it publishes, when, and when it ends."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose, rows
from planning.errors import FormatError
from telemetry.bus.bus import Bus
from telemetry.bus.node import NodeContext
from telemetry.bus.node_lock import NodeLock
from telemetry.nodes.sensors import REST_HZ, SensorOptions, main, sense
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.messages import Topic
from tests.telemetry.scenes import FRAME, truth
from tests.telemetry.small_bus import SmallBus

PATIENCE_S = 90.0
WALL = {"type": "wall", "from_m": [-20, 12], "to_m": [20, 12], "height_m": 20, "material": "stone"}


def world_file(folder: Path, *objects: Any) -> Path:
    path = folder / "world.json"
    path.write_text(json.dumps({"format": "hedgehop-world", "version": 1, "objects": list(objects)}), encoding="utf-8")
    return path


def of_type(bus: SmallBus, kind: type) -> list[Any]:
    return [message for _, message in bus.published if isinstance(message, kind)]


def sensing(folder: Path, options: SensorOptions, enough: Callable[[SmallBus], bool], **changed: Any) -> SmallBus:
    """Runs the node with a vehicle that hovers, until there is enough on the bus."""

    async def run() -> SmallBus:
        bus = SmallBus()
        with NodeLock(folder, "sensors", []) as lock:
            working = asyncio.ensure_future(sense(cast(Bus, bus), NodeContext(lock), options))
            try:
                async with asyncio.timeout(PATIENCE_S):
                    while not enough(bus) and not working.done():
                        now = truth(t_s=time.monotonic())
                        now = dataclasses.replace(now, t_mono_s=time.monotonic(), t_utc_s=time.time(), **changed)
                        bus.publish(Topic.TRUTH, now)
                        await asyncio.sleep(0.02)
            finally:
                ended = working.done()
                working.cancel()
                results = await asyncio.gather(working, return_exceptions=True)
            if ended and results[0] is not None:
                raise results[0]  # type: ignore[misc]
        return bus

    return asyncio.run(run())


def test_an_armed_vehicle_looks_out(tmp_path: Path) -> None:
    options = SensorOptions(world=world_file(tmp_path, WALL), points=2000)
    bus = sensing(tmp_path, options, lambda bus: all(len(of_type(bus, kind)) >= 3 for kind in
                                                     (RadarFrame, CloudFrame, SlamPose)))  # fmt: skip
    told = {message.t_mono_s for topic, message in bus.published if topic == Topic.TRUTH}
    for topic, kind in ((Topic.RADAR_FRAME, RadarFrame), (Topic.CLOUD_FRAME, CloudFrame), (Topic.SLAM_POSE, SlamPose)):
        sent = [message for t, message in bus.published if t == topic]
        assert all(isinstance(message, kind) for message in sent)
        assert {message.t_mono_s for message in sent} <= told
    cloud = rows(of_type(bus, CloudFrame)[-1].xyz_m, 3)
    assert abs(float(cloud[:, 1].min()) - 11.85) < 2.0
    assert [frame.number for frame in of_type(bus, CloudFrame)] == list(range(1, len(of_type(bus, CloudFrame)) + 1))


def test_the_radar_may_be_simulated_from_its_samples_on(tmp_path: Path) -> None:
    options = SensorOptions(world=world_file(tmp_path, WALL), points=500, radar="iq")
    bus = sensing(tmp_path, options, lambda bus: len(of_type(bus, RadarFrame)) >= 2)
    xyz = rows(of_type(bus, RadarFrame)[-1].xyz_m, 3)
    range_m = np.linalg.norm(xyz, axis=1)
    assert np.abs(range_m - 11.85).min() < 1.0
    # Targets of the other kind lie in the middle of cells.
    assert np.abs(range_m % 0.5 - 0.25).max() > 0.01


def test_in_the_dark_the_radar_goes_on(tmp_path: Path) -> None:
    options = SensorOptions(world=world_file(tmp_path, WALL), points=2000, dark=True)
    bus = sensing(tmp_path, options, lambda bus: len(of_type(bus, RadarFrame)) >= 2 and len(of_type(bus, SlamPose)) > 2)
    assert {frame.xyz_m for frame in of_type(bus, CloudFrame)} <= {b""}
    assert of_type(bus, SlamPose)[-1].tracking == "lost"


def test_at_rest_only_the_radar_looks_out_and_less_often(tmp_path: Path) -> None:
    """So that before a start it is seen to work."""
    bus = sensing(tmp_path, SensorOptions(points=500), lambda bus: len(of_type(bus, RadarFrame)) >= 4, armed=False)
    assert {topic for topic, _ in bus.published} == {Topic.TRUTH, Topic.RADAR_FRAME}
    times = [frame.t_mono_s for frame in of_type(bus, RadarFrame)]
    assert (times[-1] - times[0]) / (len(times) - 1) > 0.8 / REST_HZ


def test_a_broken_world_ends_it_with_the_reason(tmp_path: Path) -> None:
    options = SensorOptions(world=world_file(tmp_path, {"type": "ball"}))
    with pytest.raises(FormatError, match=r"objects\[0\]\.type"):
        sensing(tmp_path, options, lambda bus: False)


def test_wrong_arguments_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--world", "x.json"])
    assert "--runtime" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["--runtime", "x", "--radar", "sonar"])
    assert "'model', 'iq'" in capsys.readouterr().err


def test_the_vehicle_tells_where_it_really_is() -> None:
    told = SimulatedVehicle(FRAME).sim_truth(1.0, 2.0)
    assert (told.home_lat_deg, told.home_lon_deg, told.home_alt_amsl_m) == (
        FRAME.lat_deg, FRAME.lon_deg, FRAME.alt_amsl_m)  # fmt: skip
    assert told.position_enu_m == (0.0, 0.0, 0.0)
