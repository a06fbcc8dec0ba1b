"""Puts the vehicles and their paths into the 3D view, ten times a second, on whatever surface model is on show."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from server.heard.channel import Channel, ShownWay
from server.heard.vehicle_place import Placer
from server.scene.layers.vehicle_layers import VehiclePose
from server.scene.layers.vehicles import REPLAY, Vehicles
from telemetry.topics.vehicle import VehicleState

PERIOD_S = 0.1
_TRACK_EVERY = 5
"""Of the periods: a path grows by half a metre in one."""


class Scenery:
    """Draws only what has changed since the last time."""

    def __init__(
        self, stage: Vehicles | None, channels: Mapping[str, Channel], labels: Mapping[str, str] = MappingProxyType({})
    ) -> None:
        """Both by the actor (``actor_of``); ``labels``: their names, where they have to be told apart."""
        self._stage = stage
        self._actors = {a: _Actor(a, channel, labels.get(a, "")) for a, channel in channels.items()}
        self._placer: Placer | None = None

    async def run(self) -> None:
        """Until cancelled."""
        beat = 0
        while True:
            await asyncio.sleep(PERIOD_S)
            beat += 1
            for _ in self.drawn(with_tracks=beat % _TRACK_EVERY == 0):
                # Each vehicle takes the loop some milliseconds: what else waits comes between them.
                await asyncio.sleep(0)

    def drawn(self, *, with_tracks: bool) -> Iterator[None]:
        """Vehicle by vehicle."""
        dsm = None if self._stage is None else self._stage.dsm
        if self._stage is None or dsm is None:
            self._placer = None
            return
        if self._placer is None or self._placer.dsm is not dsm:
            self._placer = Placer(dsm)
            for actor in self._actors.values():
                actor.forget()
        for name, actor in self._actors.items():
            actor.move(self._stage, self._placer)
            actor.draw_way(self._stage, self._placer)
            # A replay leaves states out when it runs fast or jumps; its whole line is drawn from the recording.
            if with_tracks and name != REPLAY:
                actor.draw_track(self._stage, self._placer)
            yield


_NOWHERE = np.full((1, 3), np.nan)
"""Between two points of a path: no line there."""


class _Actor:
    """One vehicle on the stage, and what of it is drawn already."""

    def __init__(self, name: str, channel: Channel, label: str) -> None:
        self._name, self._channel, self._label = name, channel, label
        self.forget()

    def forget(self) -> None:
        self._drawn: VehicleState | None = None
        self._placed = 0
        self._way: ShownWay | None = None
        self._points = np.zeros((0, 3))

    def move(self, stage: Vehicles, placer: Placer) -> None:
        state = self._channel.state
        if state is not self._drawn:
            self._drawn = state
            stage.move(self._name, None if state is None else _pose(state, placer, self._label))

    def draw_way(self, stage: Vehicles, placer: Placer) -> None:
        way, state = self._channel.way, self._channel.state
        if way is self._way:
            return
        if way is None or state is None:
            stage.lead(self._name, np.zeros((0, 3)))
        else:
            stage.lead(self._name, placer.line(way.places, state), is_certified=way.is_certified)
        self._way = way

    def draw_track(self, stage: Vehicles, placer: Placer) -> None:
        track = self._channel.track
        states = track.states
        if len(states) == self._placed:
            return
        if len(states) < self._placed:
            self._placed, self._points = 0, np.zeros((0, 3))
        starts = [k for k in range(self._placed, len(states)) if track.is_anew[k]]
        for start, end in pairwise(sorted({self._placed, *starts, len(states)})):
            parted = [_NOWHERE] if track.is_anew[start] else []
            self._points = np.concatenate([self._points, *parted, placer.places(states[start:end])])
        self._placed = len(states)
        stage.follow(self._name, self._points)


def _pose(state: VehicleState, placer: Placer, label: str) -> VehiclePose | None:
    place = placer.place(state)
    if place is None:
        return None
    return VehiclePose(
        place,
        roll_rad=state.roll_rad or 0.0,
        pitch_rad=state.pitch_rad or 0.0,
        heading_rad=state.heading_rad or 0.0,
        home_m=placer.home(state),
        label=label,
    )
