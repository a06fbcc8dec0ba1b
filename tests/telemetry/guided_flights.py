"""The navigation script against the simulated vehicle, without sockets: where the vehicle was on every leg."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from planning.formats.wpl import read_wpl
from telemetry.flight.guided.feed import Feed
from telemetry.flight.guided.guided import GuidedScript
from telemetry.flight.guided.script_targets import guided_plan
from telemetry.mavlink.actions import Action, Send
from telemetry.mavlink.reduce import reduce
from telemetry.simulation.simulator.airframe.gnss import GnssKind
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES, Make
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.requests import Operator, StartGuided
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.simulator_bench import SLICE_S, Bench

STREAMS_HZ = {33: 20, 30: 20, 245: 4, 87: 2}
"""GLOBAL_POSITION_INT, ATTITUDE, EXTENDED_SYS_STATE and POSITION_TARGET_GLOBAL_INT, as the link asks for them."""


class ScriptedFlight:
    """``track``: (N, 5) time, north, east, up and heading while targets were flown; ``line``: (K, 3) of the targets.

    ``silent_s``: from when to when the link is down, counted from the first target.
    """

    def __init__(
        self,
        mission: Path,
        *,
        feed: Feed | None = None,
        silent_s: tuple[float, float] = (math.inf, math.inf),
        make: Make = "ardupilot",
        gnss: GnssKind = "perfect",
        seed: int = 0,
        **parameters: float,
    ) -> None:
        personality = PERSONALITIES[make]
        self._silent_s, self._flies_s = silent_s, math.inf
        self.sent: list[Any] = []
        plan = guided_plan(replace(read_wpl(mission.read_bytes()), firmware=make))
        home = read_wpl(mission.read_bytes()).home
        self.frame = NeuFrame(home.lat_deg, home.lon_deg, home.alt_dsm_m)
        self.bench = Bench(
            SimulatedVehicle(
                self.frame,
                make=make,
                gnss=gnss,
                seed=seed,
                boot_s=0.5,
                parameters=personality.parameters(**{personality.capacity: 60000.0, **parameters}),
            )
        )
        self.line = np.array(
            [(*self.frame.neu_from_geodetic(t.lat_deg, t.lon_deg, 0)[:2], t.alt_rel_home_m) for t in plan.targets]
        )
        self._state: VehicleState | None = None
        self._heard = 0
        self.bench.until(lambda: self.bench.vehicle.autopilot.position_ok)
        for message_id, rate_hz in STREAMS_HZ.items():
            self.bench.stream(message_id, rate_hz)
        self._listen()
        while self._state is None or self._state.alt_amsl_m is None:
            self._advance()
        asked = StartGuided(Operator("Ann", 1), plan.targets, plan.takeoff_alt_rel_home_m, end=plan.end)
        self.script = GuidedScript(asked, self._state, firmware=make, target=(1, 1), feed=feed)
        self.track = self._fly()

    def _fly(self) -> F64:
        track = []
        self._perform(self.script.start(self.bench.now_s))
        while self.script.phase in ("arming", "taking_off", "flying"):
            self._advance()
            self._perform(self.script.on_tick(self.bench.now_s))
            if self.script.phase == "flying":
                self._flies_s = min(self._flies_s, self.bench.now_s)
                truth = self.bench.vehicle.truth
                track.append((self.bench.now_s, *truth.p_neu, truth.heading_rad))
        assert self.script.phase == "returning", self.script.status()
        return np.array(track)

    @property
    def is_silent(self) -> bool:
        since_s = self.bench.now_s - self._flies_s
        return self._silent_s[0] <= since_s < self._silent_s[1]

    def _advance(self) -> None:
        self.bench.advance(SLICE_S)
        self._listen()

    def _listen(self) -> None:
        heard, self._heard = self.bench.heard[self._heard :], len(self.bench.heard)
        if self.is_silent:
            return
        for one in heard:
            self._hear(one.message)

    def _hear(self, message: Any) -> None:
        now_s, before = self.bench.now_s, self._state
        self._state = reduce(before, message, t_mono_s=now_s, t_utc_s=now_s)
        if not hasattr(self, "script"):
            return
        self._perform(self.script.on_message(message, now_s))
        if self._state is not None and self._state is not before:
            self._perform(self.script.on_state(self._state, now_s))

    def _perform(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, Send) and not self.is_silent:
                self.sent.append(action.message)
                self.bench.send(action.message)  # what it answers is heard with the rest


def off_line(points: F64, line: F64) -> tuple[F64, F64]:
    """Beside and above a line (K, 3) of each point (N, 3), at the leg that is nearest in space."""
    start, step = line[:-1], np.diff(line, axis=0)
    square = np.maximum((step[:, :2] ** 2).sum(axis=1), 1e-12)
    along = np.einsum("nkd,kd->nk", points[:, None, :2] - start[None, :, :2], step[:, :2]) / square
    foot = start[None] + np.clip(along, 0, 1)[..., None] * step[None]
    best = np.linalg.norm(points[:, None] - foot, axis=2).argmin(axis=1)
    rows = np.arange(len(points))
    away = points - foot[rows, best]
    return np.linalg.norm(away[:, :2], axis=1), away[:, 2]
