"""What all scenarios share: the ground and objects that one is flown among, the flight, and its recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from planning.errors import FormatError
from planning.terrain.dsm import Dsm
from telemetry.recording.carried_ground import MEDIA_TYPE, NAME, packed
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.recorded_topics import RECORDED
from telemetry.simulation.scenarios.stage.course import course_mission
from telemetry.simulation.scenarios.stage.paper_fields import field, known
from telemetry.simulation.scenarios.stage.result import ScenarioRequest
from telemetry.simulation.scenarios.stage.scenes import VALLEY, ScenarioScene
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.simulation.scenarios.stage.virtual_flight import fly
from telemetry.simulation.scenarios.stage.virtual_link import T0_MONO_S, T0_UTC_S
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.scene.world_file import read_world
from telemetry.topics.messages import Published


def setup_of(
    scene: ScenarioScene, wanted: ScenarioRequest, title: str, *, by_script: bool = True, **more: Any
) -> Setup:
    """The scene's flight. ``more``: further fields of ``Setup``. Raises FormatError for a broken world file."""
    frame, dsm = VALLEY, field(VALLEY, scene.hills)
    if wanted.world is not None:
        frame, dsm = _own_ground(wanted.world, frame, dsm)
        world = World.load(wanted.world, frame=frame, dsm=dsm)
    else:
        world = World.parse(scene.document, frame=frame, dsm=dsm)
    return Setup(
        title=title,
        world=world,
        seed=wanted.seed,
        mission=course_mission(scene.course, frame),
        course=scene.course if by_script else None,
        ground=surveyed(dsm, wanted.seed),
        **more,
    )


def surveyed(dsm: Dsm, seed: int) -> Dsm:
    """What is known of the ground, the same for every flight of a seed."""
    return known(dsm, np.random.default_rng([seed, 11]))


def flown_of(setup: Setup, wanted: ScenarioRequest, *, part: str = "") -> SeenFlight:
    """The flight, recorded if that is wanted; ``part`` tells the files of several flights apart."""
    if wanted.record is None:
        return fly(setup)
    path = wanted.record if not part else wanted.record.with_stem(f"{wanted.record.stem}-{part.replace(' ', '-')}")
    recording = FlightRecording(path, setup.title, setup.ground)
    try:
        return fly(setup, recording.tell)
    finally:
        recording.close()


class FlightRecording:
    """One file that Review opens: ground, states, frames, maps, alerts.

    Nothing reads a clock: the same flight gives the same file.
    """

    def __init__(self, path: Path, name: str, ground: Dsm) -> None:
        """``ground``: what is known of it. Raises RecordingError when the file cannot be created."""
        carried = packed(ground)
        self._virtual_s = 0.0
        self._writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name=name, now=self._now)
        self._writer.attach(NAME, MEDIA_TYPE, carried, T0_UTC_S)

    def tell(self, topic: str, message: Published, t_utc_s: float) -> None:
        if topic in RECORDED:
            self._virtual_s = t_utc_s - T0_UTC_S
            self._writer.write(topic, message, t_utc_s)

    def close(self) -> None:
        self._writer.close()

    def _now(self) -> float:
        return self._virtual_s


def own_ground(path: Path) -> Dsm | None:
    """The surface model that a world file names."""
    file = read_world(path)
    if file.dsm is None:
        return None
    # What reads rasters takes a second to load.
    from planning.terrain.geotiff import read_dsm

    return read_dsm(file.dsm)


def _own_ground(path: Path, frame: NeuFrame, dsm: Dsm) -> tuple[NeuFrame, Dsm]:
    own, origin = own_ground(path), read_world(path).origin
    if own is None:
        return frame, dsm
    if origin is None:
        raise FormatError(
            "The world names a surface model but no origin on it.",
            where=path.name,
            advice='Add "origin": {"lat_deg": ..., "lon_deg": ...}: there the vehicle takes off.',
        )
    height_m = float(own.elevation_at(own.xy_from_lat_lon(np.array([[origin.lat_deg, origin.lon_deg]])))[0])
    return NeuFrame(origin.lat_deg, origin.lon_deg, height_m if math.isfinite(height_m) else 0.0), own
