"""The lines that this station's vehicles fly, made ready to be told to other stations: fewer points, the error told."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.frames import MEAN_RADIUS_M, offset_m
from planning.following.thinned import thinned
from server.errors import reported
from server.heard.channel import Channel
from server.heard.plan_follower import Followed
from telemetry.stations.plan_lines import MOST_ERROR_M, MOST_POINTS, ROUNDED_M, PlanLine, line_id, packed
from telemetry.topics.station_vehicles import FleetLine

log = logging.getLogger("hedgehop.flying")

EVERY_S = 1.0
GOOD_ENOUGH_M = 1.0
"""With fewer points no more is gained."""
_HOME_STEP_M = 0.5
"""By so much home has to move to make another line of the same plan; less is part of the error."""

_CENTIMETRE_M = 0.01
"""To a whole one the error is raised as it is told."""


@dataclass(frozen=True, slots=True)
class _Made:
    followed: Followed
    home_alt_amsl_m: float
    line: FleetLine | None
    """None: it has no times, or cannot be told."""
    id: int = 0


class OwnLines:
    """By the vehicle's number, of those in the air. Belongs to the event loop; lines are made beside it."""

    def __init__(self, channels: Mapping[int, Channel]) -> None:
        self._channels = channels
        self._made: dict[int, _Made] = {}

    async def run(self) -> None:
        """Until cancelled; a line that cannot be made is not told, and its vehicle is taken to fly straight on."""
        while True:
            try:
                await self.look()
            except Exception as error:
                log.warning("Lines for other stations: %s", reported(error, log, "Lines for other stations").what)
            await asyncio.sleep(EVERY_S)

    async def look(self) -> None:
        for number, channel in self._channels.items():
            followed = channel.follower.followed if channel.in_air else None
            home_m = None if channel.state is None else channel.state.home_alt_amsl_m
            if followed is None or home_m is None:
                self._made.pop(number, None)
            elif self._of(number, followed, home_m) is None:
                self._made[number] = await asyncio.to_thread(_made, number, followed, home_m)

    def told(self, number: int) -> tuple[int, float | None]:
        """What the line is known by, and where on it the vehicle is; 0 and None where none is told."""
        channel, made = self._channels[number], self._made.get(number)
        if made is None or made.line is None or channel.follower.followed is not made.followed:
            return 0, None
        return made.id, channel.follower.line_s(channel.flight)

    def lines(self) -> Sequence[FleetLine]:
        return [made.line for made in self._made.values() if made.line is not None]

    def _of(self, number: int, followed: Followed, home_m: float) -> _Made | None:
        made = self._made.get(number)
        if made is None or made.followed is not followed or abs(made.home_alt_amsl_m - home_m) > _HOME_STEP_M:
            return None
        return made


def _made(number: int, followed: Followed, home_alt_amsl_m: float) -> _Made:
    try:
        line = line_of_plan(followed, home_alt_amsl_m)
        if line is not None and line.error_m + ROUNDED_M > MOST_ERROR_M - _CENTIMETRE_M:
            log.info("Vehicle %d flies a plan of too many turns: other stations are not told its line.", number)
            line = None
        payload = None if line is None else packed(line)
    except Exception as error:
        log.warning("A line for other stations: %s", reported(error, log, "Making a line").what)
        payload = None
    if payload is None:
        return _Made(followed, home_alt_amsl_m, None)
    return _Made(followed, home_alt_amsl_m, FleetLine("", number, payload), line_id(payload))


def line_of_plan(followed: Followed, home_alt_amsl_m: float) -> PlanLine | None:
    """From the first waypoint to the last; None where nothing tells its times."""
    reference = followed.reference
    t_s = np.column_stack([reference.arrive_s, reference.leave_s]).ravel()
    if len(t_s) < 2 or not np.isfinite(t_s).all():
        return None
    t_s = np.maximum.accumulate(np.maximum(t_s, 0.0))
    points_m = np.repeat(reference.points_m, 2, axis=0)
    lat_lon_deg = followed.placer.dsm.lat_lon_from_xy(points_m[:, :2])
    alt_amsl_m = points_m[:, 2] - reference.home_alt_dsm_m + home_alt_amsl_m
    east_m, north_m = offset_m((lat_lon_deg[0, 0], lat_lon_deg[0, 1]), lat_lon_deg[:, 0], lat_lon_deg[:, 1])
    kept, off_m = thinned(
        np.column_stack([east_m, north_m, alt_amsl_m]), t_s, most=MOST_POINTS, good_enough_m=GOOD_ENOUGH_M
    )
    longest_m = float(np.hypot(np.diff(east_m), np.diff(north_m)).max())
    # Straight on the map is not straight in latitude and longitude: by the bow between both, on the longest leg.
    steep = max(1.0, abs(math.tan(math.radians(float(np.abs(lat_lon_deg[:, 0]).max())))))
    bow_m = steep * longest_m**2 / (8.0 * MEAN_RADIUS_M)
    return PlanLine(lat_lon_deg[kept], alt_amsl_m[kept], t_s[kept], off_m + bow_m + _HOME_STEP_M)
