"""Ways over and around an obstacle: prepared in a worker when an alert begins, kept until it is over."""

from __future__ import annotations

import asyncio
import logging
import math
from dataclasses import replace

import numpy as np

from mapping.geometry.frames import apart_m
from server.errors import NotFoundError, reported
from server.obstacles.manoeuvre_situation import Prepared, none_possible
from server.obstacles.manoeuvre_task import prepare
from server.obstacles.surroundings import Surroundings, are_maps_whole
from server.scene.layers.region_layers import Route
from server.schemas import ManoeuvreDoc
from server.work.jobs import Lane
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError
from telemetry.mavlink.believing import is_disarmed
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.requests import FlyManoeuvre, MayFlyManoeuvre, Operator

log = logging.getLogger("hedgehop.obstacles")

NOTHING_KNOWN = "The plan that is flown, its surface model, or home is not known here. Hold, or steer clear by sight."
STANDS = "The vehicle stands on the ground: a way past it is flown in flight only."
PARTS_MISSING = "Parts of a map are missing: look before you fly it."
KINDS = ("obstacle", "conflict", "approach")
AGAIN_AFTER_S = 1.0
"""While the obstacle stands in the region: the vehicle moves, and more of it is seen."""
MOVED_ON_M = 8.0
"""A way that begins farther away than this is not the one that would be flown."""
TURNED_RAD = math.radians(60.0)
"""Between the sidestep on show and the one prepared when it is flown: beyond it the pilot has chosen another one."""


class Manoeuvres:
    """One obstacle and one moving object at a time, the newest of each: ``run`` prepares, the desk flies."""

    def __init__(self, around: Surroundings, lane: Lane, link: LinkClient) -> None:
        self._around, self._watch, self._lane, self._link = around, around.watch, lane, link
        self._alerts: dict[str, ObstacleAlert] = {}
        self._wake = asyncio.Event()
        self.prepared: tuple[Prepared, ...] = ()
        self.routes: list[Route] = []
        """Those that can be flown, as lines."""

    def on_alert(self, alert: ObstacleAlert) -> None:
        is_new = self._watch.on_alert(alert)
        if is_new and alert.kind in KINDS:
            self._alerts[alert.id] = alert
            self._wake.set()
        if alert.phase == "ends":
            self._on_end(alert.id)

    def tick(self) -> None:
        """Once a second: what a sensor's node has not told again is over."""
        for alert_id in self._watch.tick():
            self._on_end(alert_id)

    def _on_end(self, alert_id: str) -> None:
        if self._alerts.pop(alert_id, None) is not None:
            if not self._alerts:
                self._show(())
            self._wake.set()

    @property
    def _standing(self) -> ObstacleAlert | None:
        """The newest of something that stands in the way, unless it is over."""
        return next((each for each in reversed(self._alerts.values()) if each.kind != "approach"), None)

    @property
    def _moving(self) -> ObstacleAlert | None:
        """The newest of a moving object."""
        return next((each for each in reversed(self._alerts.values()) if each.kind == "approach"), None)

    async def request(self, operator: Operator, manoeuvre_id: str) -> FlyManoeuvre:
        """Raises NotFoundError for one that is out of date, NotAllowedError for one that cannot be flown.

        One past a moving object is prepared anew: a second ago the object was somewhere else.
        """
        found = self._found(manoeuvre_id)
        if found.doc.kind == "sidestep" and found.doc.possible:
            shown = found
            await self._renew(self._standing, self._moving)
            found = self._found(manoeuvre_id)
            if found.doc.possible and _turned_rad(shown, found) > TURNED_RAD:
                raise NotAllowedError(
                    f"The way out is another one now: {found.doc.text}", advice="Look at it, then press Fly again."
                )
        return self._request(operator, found)

    def _found(self, manoeuvre_id: str) -> Prepared:
        found = next((each for each in self.prepared if each.doc.id == manoeuvre_id), None)
        if found is None:
            raise NotFoundError(
                "This manoeuvre is out of date: the obstacle or the vehicle has moved on.",
                advice="Choose one of those on show.",
            )
        return found

    def _request(self, operator: Operator, found: Prepared) -> FlyManoeuvre:
        if not found.doc.possible:
            raise NotAllowedError(f"This manoeuvre cannot be flown: {found.doc.text}", advice="Choose the other one.")
        self._check_begins_here(found)
        return FlyManoeuvre(
            operator, found.doc.kind, found.targets, found.rejoin_item, height_offset_m=found.height_offset_m
        )

    def _check_begins_here(self, prepared: Prepared) -> None:
        state = self._around.live.state
        if state is None or state.lat_deg is None or state.lon_deg is None or prepared.begins_lat_lon_deg is None:
            return
        away_m = apart_m(prepared.begins_lat_lon_deg, (state.lat_deg, state.lon_deg))
        if away_m > MOVED_ON_M:
            raise NotAllowedError(
                f"The vehicle is {away_m:.0f} m from where this manoeuvre begins.",
                advice="Press Hold, then fly the one that is shown from there.",
            )

    async def run(self) -> None:
        """Until cancelled; what cannot be prepared is told, and the next alert is served."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._alerts:
                await self._renew(self._standing, self._moving)
                try:
                    async with asyncio.timeout(AGAIN_AFTER_S):
                        await self._wake.wait()
                    break
                except TimeoutError:
                    continue

    async def _renew(self, standing: ObstacleAlert | None, moving: ObstacleAlert | None) -> None:
        if is_disarmed(self._around.live.state):
            self._show(none_possible(STANDS, standing, moving))
            return
        try:
            situation = await self._around.situation(standing, moving, at_once=True)
            if self._watch.avoidance.state == "climbing":
                self._show(())  # those on show begin where the vehicle is no more
                return
            if situation is None:
                self._show(none_possible(NOTHING_KNOWN, standing, moving))
                return
            self._busy("" if self.prepared else "Looking for a way past the obstacle")
            prepared = tuple([await self._allowed(each) for each in await self._lane.call(prepare, situation)])
            if not are_maps_whole(self._watch):
                prepared = tuple(map(_over_parts, prepared))
        except Exception as error:
            doc = reported(error, log, "Preparing a manoeuvre")
            log.warning("No manoeuvre: %s", doc.what)
            prepared = none_possible(doc.what, standing, moving)
        self._watch.busy = ""
        # Another alert, or none, while the worker was at it: what it found is void.
        served = self._standing is standing and self._moving is moving
        self._show(prepared if served else self.prepared)

    async def _allowed(self, found: Prepared) -> Prepared:
        """What the link would refuse is no offer, and its words are the reason."""
        if not found.doc.possible:
            return found
        kind, offset_m = found.doc.kind, found.height_offset_m
        why = await self._link.call(MayFlyManoeuvre(kind, found.targets, found.rejoin_item, offset_m))
        if not why:
            return found
        return Prepared(
            ManoeuvreDoc(id=found.doc.id, kind=kind, for_alert=found.doc.for_alert, possible=False, text=why)
        )

    def _busy(self, what: str) -> None:
        self._watch.busy = what
        self._watch.refresh()

    def _show(self, prepared: tuple[Prepared, ...]) -> None:
        self.prepared = prepared
        self.routes = [
            Route(each.doc.kind, np.array(each.points_enu_m), _words(each)) for each in prepared if each.points_enu_m
        ]
        self._watch.manoeuvres = [each.doc for each in prepared]
        self._watch.refresh()


def _over_parts(found: Prepared) -> Prepared:
    """Of maps of which not all is known here."""
    if not found.doc.possible:
        return found
    return replace(found, doc=found.doc.model_copy(update={"text": f"{found.doc.text} {PARTS_MISSING}"}))


def _turned_rad(shown: Prepared, now: Prepared) -> float:
    """Between the directions in which two ways begin; 0 where one of them begins with staying."""
    (a, b), (c, d) = shown.points_enu_m[:2], now.points_enu_m[:2]
    first, second = (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])
    if min(math.hypot(*first), math.hypot(*second)) < 1.0:
        return 0.0
    turn = math.atan2(first[0] * second[1] - first[1] * second[0], first[0] * second[0] + first[1] * second[1])
    return abs(turn)


def _words(prepared: Prepared) -> str:
    clearance_m = prepared.doc.clearance_m
    kind = prepared.doc.kind.capitalize()
    if prepared.doc.top_unseen:
        return f"{kind}: top not seen"
    return kind if clearance_m is None else f"{kind}: {clearance_m:.1f} m clear"
