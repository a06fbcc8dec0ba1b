"""Ways over and around an obstacle: prepared in a worker when an alert begins, kept until it is over."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

import numpy as np

from server.errors import NotFoundError, reported
from server.obstacles.manoeuvre_task import Prepared, Situation
from server.obstacles.watch import Watch
from server.placing import metres_apart
from server.scene.regions import Route
from telemetry.errors import NotAllowedError
from telemetry.obstacles import ObstacleAlert
from telemetry.requests import FlyManoeuvre, Operator
from telemetry.vehicle import VehicleState

log = logging.getLogger("hedgehop.obstacles")

AGAIN_AFTER_S = 1.0
"""While the obstacle stands in the region: the vehicle moves, and more of it is seen."""
MOVED_ON_M = 8.0
"""A way that begins farther away than this is not the one that would be flown."""


class Manoeuvres:
    """One obstacle at a time, the newest: ``run`` prepares, the desk flies."""

    def __init__(
        self,
        watch: Watch,
        *,
        situation: Callable[[ObstacleAlert], Situation | None],
        prepare: Callable[[Situation], Awaitable[tuple[Prepared, ...]]],
        vehicle: Callable[[], VehicleState | None],
    ) -> None:
        self._watch, self._situation, self._prepare, self._vehicle = watch, situation, prepare, vehicle
        self._alerts: dict[str, ObstacleAlert] = {}
        self._wake = asyncio.Event()
        self.prepared: tuple[Prepared, ...] = ()
        self._routes: list[Route] = []
        watch.begins, watch.ends = self.on_begin, self.on_end

    def on_begin(self, alert: ObstacleAlert) -> None:
        if alert.kind in ("obstacle", "conflict"):
            self._alerts[alert.id] = alert
            self._wake.set()

    def on_end(self, alert_id: str) -> None:
        if self._alerts.pop(alert_id, None) is not None:
            if not self._alerts:
                self._show(())
            self._wake.set()

    @property
    def _alert(self) -> ObstacleAlert | None:
        """The newest that is not over."""
        return next(reversed(self._alerts.values()), None)

    def routes(self) -> list[Route]:
        """Those that can be flown, as lines."""
        return list(self._routes)

    def request(self, operator: Operator, manoeuvre_id: str) -> FlyManoeuvre:
        """Raises NotFoundError for one that is out of date, NotAllowedError for one that cannot be flown."""
        found = next((each for each in self.prepared if each.doc.id == manoeuvre_id), None)
        if found is None:
            raise NotFoundError(
                "This manoeuvre is out of date: the obstacle or the vehicle has moved on.",
                advice="Choose one of those on show.",
            )
        if not found.doc.possible:
            raise NotAllowedError(f"This manoeuvre cannot be flown: {found.doc.text}", advice="Choose the other one.")
        self._check_begins_here(found)
        return FlyManoeuvre(
            operator, found.doc.kind, found.targets, found.rejoin_item, height_offset_m=found.height_offset_m
        )

    def _check_begins_here(self, prepared: Prepared) -> None:
        state = self._vehicle()
        if state is None or state.lat_deg is None or state.lon_deg is None or prepared.begins_lat_lon_deg is None:
            return
        away_m = metres_apart(prepared.begins_lat_lon_deg, (state.lat_deg, state.lon_deg))
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
            while (alert := self._alert) is not None:
                await self._renew(alert)
                try:
                    async with asyncio.timeout(AGAIN_AFTER_S):
                        await self._wake.wait()
                    break
                except TimeoutError:
                    continue

    async def _renew(self, alert: ObstacleAlert) -> None:
        try:
            situation = await asyncio.to_thread(self._situation, alert)  # maps may be large
            if situation is None or self._watch.avoidance.state in ("climbing", "holding", "ceiling"):
                self._show(())  # those on show begin where the vehicle is no more
                return
            self._busy("" if self.prepared else "Looking for a way past the obstacle")
            prepared = await self._prepare(situation)
        except Exception as error:
            log.warning("No manoeuvre: %s", reported(error, log, "Preparing a manoeuvre").what)
            prepared = ()
        self._watch.busy = ""
        # Another alert, or none, while the worker was at it: what it found is void.
        self._show(prepared if self._alert is alert else self.prepared)

    def _busy(self, what: str) -> None:
        self._watch.busy = what
        self._watch.refresh()

    def _show(self, prepared: tuple[Prepared, ...]) -> None:
        self.prepared = prepared
        self._routes = [
            Route(each.doc.kind, np.array(each.points_enu_m), _words(each)) for each in prepared if each.points_enu_m
        ]
        self._watch.manoeuvres = [each.doc for each in prepared]
        self._watch.refresh()


def _words(prepared: Prepared) -> str:
    clearance_m = prepared.doc.clearance_m
    kind = prepared.doc.kind.capitalize()
    return kind if clearance_m is None else f"{kind}: {clearance_m:.1f} m clear"
