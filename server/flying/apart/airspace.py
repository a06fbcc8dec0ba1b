"""Puts other aircraft into the 3D view, twice a second: those that any vehicle is told of, and other stations'."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterator, Sequence

import numpy as np

from mapping.geometry.frames import moved_deg
from server.errors import reported
from server.flying.apart.other_stations import OtherStations
from server.flying.apart.others_placed import placed_vehicles
from server.heard.channel import Channel
from server.heard.vehicle_place import Placer
from server.obstacles.traffic import TrafficWatch
from server.scene.layers.traffic_layer import LINE_S, PlacedAircraft, TrafficStage

log = logging.getLogger("hedgehop.flying")

PERIOD_S = 0.5
Around = tuple[Channel, TrafficWatch]
"""A vehicle, and the traffic that it is told of."""


class Airspace:
    """While a recording has traffic it is drawn instead of the live one."""

    def __init__(
        self,
        stage: TrafficStage | None,
        live: Sequence[Around],
        replay: Around,
        stations: OtherStations | None = None,
    ) -> None:
        self._stage, self._live, self._replay, self._stations = stage, live, replay, stations
        self._placer: Placer | None = None
        self._drawn: tuple[object, ...] = ()

    async def run(self) -> None:
        """Until cancelled; what cannot be drawn is logged, and drawn at the next turn."""
        while True:
            await asyncio.sleep(PERIOD_S)
            try:
                self.draw()
            except Exception as error:
                log.warning("Drawing traffic: %s", reported(error, log, "Drawing traffic").what)

    def draw(self) -> None:
        stage = self._stage
        if stage is None or stage.dsm is None:
            self._placer, self._drawn = None, ()
            return
        if self._placer is None or self._placer.dsm is not stage.dsm:
            self._placer = Placer(stage.dsm)
        shown = [self._replay] if self._replay[1].status is not None else self._live
        stations = self._stations.status if self._stations is not None and shown is self._live else None
        key = (stage.drawing, stations, *(watch.status for _, watch in shown))
        # Others grow old also where nothing new comes of them.
        is_same = len(key) == len(self._drawn) and all(a is b for a, b in zip(key, self._drawn, strict=True))
        if is_same and (stations is None or not stations.vehicles):
            return
        self._drawn = key
        # Two vehicles hear the same aircraft: the newer word of it counts.
        newest: dict[str, PlacedAircraft] = {}
        for around in shown:
            for placed in _placed(*around, self._placer):
                known = newest.get(placed.it.key)
                if known is None or placed.it.age_s < known.it.age_s:
                    newest[placed.it.key] = placed
        others = ()
        if stations is not None and self._stations is not None:
            others = placed_vehicles(stations.vehicles, stage.dsm, time.monotonic(), self._stations.line_of)
        aircraft = sorted(newest.values(), key=lambda placed: (not placed.it.conflict, placed.it.distance_m or 0.0))
        stage.show(aircraft, tuple(others))


def _placed(channel: Channel, watch: TrafficWatch, placer: Placer) -> Iterator[PlacedAircraft]:
    """Their heights count from the vehicle's, which stands on the model."""
    state, status = channel.state, watch.status
    own_m = None if state is None else placer.place(state)
    if status is None or own_m is None:
        return
    for it in status.aircraft:
        east_m_s, north_m_s = it.velocity_enu_m_s or (0.0, 0.0)
        here = it.lat_deg, it.lon_deg
        there = moved_deg(here, LINE_S * east_m_s, LINE_S * north_m_s)
        xy_m = placer.dsm.xy_from_lat_lon(np.array([here, there]))
        up_m = float(own_m[2]) + (it.height_m or 0.0)
        ahead_m = up_m + LINE_S * (it.climb_m_s or 0.0)
        place_m, ahead = np.array([*xy_m[0], up_m]), np.array([*xy_m[1], ahead_m])
        if np.isfinite([place_m, ahead]).all():
            yield PlacedAircraft(it, place_m, ahead)
