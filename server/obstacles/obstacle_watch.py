"""Obstacles of one source, live or replayed, as the pages see them: sensors, alerts, avoidance, and what is drawn."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from server.errors import reported
from server.heard.channel import Channel
from server.obstacles.alert_list import LatchedAlerts
from server.scene.mirror import MapMirror
from server.schemas import (
    AlertMessage,
    ManoeuvreDoc,
    MapDrawn,
    ObstaclesMessage,
    ObstaclesState,
    Pages,
    PerceptionMessage,
    SeesEnough,
    Source,
)
from telemetry.flight.avoidance.regions import sees_enough_for
from telemetry.mavlink.believing import is_disarmed
from telemetry.topics.looks import CloudLook, RadarLook
from telemetry.topics.obstacles import (
    MAP_NAMES,
    SENSORS,
    AvoidanceStatus,
    MapDelta,
    MapName,
    ObstacleAlert,
    PerceptionSettings,
    PerceptionStatus,
    Sensor,
    sensor_of,
)

log = logging.getLogger("hedgehop.obstacles")

RATE_HZ = 10.0
"""Of a sensor's status to the pages."""
LATE_S = 2.0
"""So long after its newest part a map that is not complete is asked for."""
DEAD_S = 3.0
"""Nodes say at least once a second how they are."""
_HAD_SEEN: dict[Sensor, str] = {"radar": "it had seen", "vision": "its newest frame saw", "ranges": "it had seen"}
"""The camera's map is made anew at every frame."""
_UNTIL = "until the landing, or until you empty the maps"
_NOBODY_WATCHES = {
    "blind": "Avoidance sees nothing any more: nothing brakes by itself. Pause, or steer clear yourself.",
    "lost": "Avoidance is gone with the link: nothing brakes by itself. Take the pilot's transmitter.",
}
"""Of each state of avoidance in which nobody may believe that it watches, what is said in flight."""


class Watch:
    """Tells what is heard at once: alerts above all. Maps are folded in threads; nothing waits for them.

    ``vehicle`` is the live one; None where nothing can happen to it any more.
    """

    def __init__(
        self,
        source: Source,
        pages: Pages,
        vehicle: Channel | None = None,
        *,
        now_mono_s: Callable[[], float] = time.monotonic,
        now_utc_s: Callable[[], float] = time.time,
    ) -> None:
        self._source: Source = source
        self._pages, self._vehicle, self._now_mono_s, self._now_utc_s = pages, vehicle, now_mono_s, now_utc_s
        self._blind: ObstacleAlert | None = None
        self._alerts = LatchedAlerts()
        self._maps_drawn: tuple[MapDrawn, ...] = ()
        self._told_mono_s = dict.fromkeys(SENSORS, float("-inf"))
        self._heard_mono_s: dict[Sensor, float] = {}
        self._lost: dict[Sensor, ObstacleAlert] = {}
        self._told: ObstaclesState | None = None
        self.statuses: dict[Sensor, PerceptionStatus] = {}
        self.mirrors: dict[MapName, MapMirror] = {name: MapMirror(name) for name in MAP_NAMES}
        self.radar_look: RadarLook | None = None
        self._cloud_look: CloudLook | None = None
        self._folded_mono_s: dict[MapName, float] = {}
        self._lasting: dict[str, ObstacleAlert] = {}
        self._begins_in_air: bool | None = None
        """Whether this flight was under way when its vehicle was heard first; None: none was heard yet."""
        self.awaited: set[Sensor] = set()
        """Their nodes ran before this server, and have not spoken since."""
        self.needs_whole = {sensor: asyncio.Event() for sensor in SENSORS}
        """Set when parts of a map are missing here."""
        self.settings = PerceptionSettings()
        self.avoidance = self._heard_avoidance = AvoidanceStatus()
        """``avoidance``: as it is shown; the link that is to avoid may have failed since it was heard."""
        self._link_answers = True
        self.manoeuvres: Sequence[ManoeuvreDoc] = ()
        self.seen_in_plan = 0
        self.busy = self.stays_higher = ""

    @property
    def state(self) -> ObstaclesState:
        return ObstaclesState(
            alerts=self._alerts.docs,
            manoeuvres=list(self.manoeuvres),
            avoidance=self.avoidance,
            settings=self.settings,
            sees_enough=SeesEnough(**{sensor: sees_enough_for(self.settings, sensor) for sensor in SENSORS}),
            maps=list(self._maps_drawn),
            seen_in_plan=self.seen_in_plan,
            busy=self.busy,
            stays_higher=self.stays_higher,
        )

    @property
    def is_disarmed(self) -> bool:
        """The vehicle stands: nothing that is meant for flight is to be said of it."""
        return self._vehicle is not None and is_disarmed(self._vehicle.state)

    # What is heard

    def on_status(self, status: PerceptionStatus) -> None:
        sensor, now_s = status.sensor, self._now_mono_s()
        before = self.statuses.get(sensor)
        self.statuses[sensor] = status
        self._heard_mono_s[sensor] = now_s
        self.awaited.discard(sensor)
        for name in _filled(status):
            if self.mirrors[name].origin is None:
                run = "" if status.basis is None else status.basis.run
                self.mirrors[name].expect(status.t_mono_s, run, status.clear_count)
                self._tell_kept()
        if any(self._is_left_incomplete(name, now_s) for name in MAP_NAMES if sensor_of(name) == sensor):
            self.needs_whole[sensor].set()
        changed = before is None or before.state != status.state
        if changed or now_s - self._told_mono_s[sensor] >= 0.8 / RATE_HZ:
            self._tell_status(sensor)
        if (lost := self._lost.pop(sensor, None)) is not None:
            self._tell_own(replace(lost, phase="ends", text=f"The {sensor} node is back."))

    def on_alert(self, alert: ObstacleAlert) -> bool:
        """Whether it was not there before. Latched before it is told: the list that follows holds it."""
        is_new = self._alerts.on_alert(alert, self._now_mono_s())
        self._pages.publish(AlertMessage(source=self._source, alert=alert))
        self.refresh()
        return is_new

    def on_avoidance(self, status: AvoidanceStatus) -> None:
        before, self._heard_avoidance = self.avoidance, status
        self.avoidance = status if self._link_answers else _lost_with_link(status)
        self._tell_blindness(before)
        self.refresh()

    def on_link_process(self, *, answers: bool, has_ended: bool = False) -> None:
        """It avoids obstacles: what it said last holds no longer than it answers. ``has_ended``: another one
        takes over, and only its own word says what avoids then."""
        self._link_answers = answers
        if has_ended:
            self._heard_avoidance = _lost_with_link(self._heard_avoidance)
        self.on_avoidance(self._heard_avoidance)

    def _tell_blindness(self, before: AvoidanceStatus) -> None:
        text = _NOBODY_WATCHES.get(self.avoidance.state)
        if (blind := self._blind) is not None and blind.text != text:
            over = "is off" if not self.avoidance.enabled else "does not watch" if text else "sees again"
            self._end_blindness(blind, f"Avoidance {over}.")
        if self._blind is None and text and self._vehicle is not None and self._vehicle.in_air:
            sensor: Sensor = before.sensors[0] if before.sensors else "radar"
            now_s = self._now_mono_s()
            self._blind = ObstacleAlert(f"blind-{now_s:.1f}", sensor, "avoidance", "begins", now_s, 0.0, now_s, text)
            self._tell_own(self._blind)

    def _end_blindness(self, blind: ObstacleAlert, text: str) -> None:
        self._blind = None
        self._tell_own(replace(blind, phase="ends", text=text))

    def on_settings(self, settings: PerceptionSettings) -> None:
        self.settings = settings
        self.refresh()

    async def on_flight(self, *, flies: bool) -> None:
        """The vehicle is in the air, or disarmed: what was seen in a flight counts until that is over. One call at a
        time: who tells of the vehicle waits for it."""
        self._begins_in_air = flies and self._begins_in_air is None
        for mirror in self.mirrors.values():
            await asyncio.to_thread(mirror.on_flight, flies=flies)
        if not flies:
            self._ask_for_all()
            if self._blind is not None:
                self._end_blindness(self._blind, "The flight is over.")
        self._tell_kept()

    async def dismiss(self, clear_count: int) -> None:
        """All maps are emptied by this order, and what is kept with them, whatever their nodes make of it."""
        self._begins_in_air = None if self._begins_in_air is None else False
        for mirror in self.mirrors.values():
            await asyncio.to_thread(mirror.dismiss, clear_count)
        self._ask_for_all()
        self._tell_kept()

    async def on_map(self, delta: MapDelta) -> None:
        """In a thread: what is large takes milliseconds, and the next part waits for this one."""
        self._folded_mono_s[delta.sensor] = self._now_mono_s()
        try:
            if not await asyncio.to_thread(self.mirrors[delta.sensor].fold, delta):
                self.needs_whole[sensor_of(delta.sensor)].set()
        except Exception as error:
            # Whatever a node sends: the others' maps and all alerts go on.
            log.warning("A part of the %s map: %s", delta.sensor, reported(error, log, "Taking in a map").what)
        self._tell_kept()

    def on_radar_look(self, look: RadarLook) -> None:
        self.radar_look = look

    def on_cloud_look(self, look: CloudLook) -> None:
        self._cloud_look = look

    def is_silent(self, sensor: Sensor) -> bool:
        """Its node is not heard."""
        return self._now_mono_s() - self._heard_mono_s.get(sensor, float("-inf")) > DEAD_S

    def is_lacking(self, name: MapName) -> bool:
        """Something of that map is not here, or is lost."""
        mirror = self.mirrors[name]
        return sensor_of(name) in self.awaited or mirror.has_forgotten or not mirror.is_complete

    def fresh_cloud(self) -> CloudLook | None:
        """What the camera sees now; a camera that has stopped sees nothing."""
        look = self._cloud_look
        return look if look is not None and abs(self._now_mono_s() - look.t_mono_s) < DEAD_S else None

    def on_drawn(self, maps: Sequence[MapDrawn]) -> None:
        self._maps_drawn = tuple(maps)
        self.refresh()

    # What is asked

    def acknowledge(self, alert_id: str | None) -> None:
        self._alerts.acknowledge(alert_id)
        self.refresh()

    def refresh(self) -> None:
        """Tells the pages, if there is anything new."""
        if (state := self.state) != self._told:
            self._told = state
            self._pages.publish(ObstaclesMessage(source=self._source, obstacles=state))

    def tick(self) -> list[str]:
        """Once a second: a node that has died tells nothing, so its silence is noted here.

        One that was started anew at once knows nothing of the alerts before: they end here, too. Their ids.
        """
        now_s, ended = self._now_mono_s(), list[str]()
        for sensor, heard_s in self._heard_mono_s.items():
            silent = now_s - heard_s > DEAD_S
            if silent and sensor not in self._lost and self.statuses[sensor].state != "waiting":
                self._lose(sensor, now_s)
            ended += self._alerts.give_up(sensor, now_s)
        ended += self._alerts.give_up("traffic", now_s)
        self.refresh()
        return ended

    def forget(self) -> None:
        """Another recording, or none."""
        for sensor in self.statuses:
            self._pages.publish(
                PerceptionMessage(source=self._source, now_mono_s=self._now_mono_s(), sensor=sensor, status=None)
            )
        self.statuses.clear()
        self._heard_mono_s.clear()
        self._lost.clear()
        self._lasting.clear()
        self._begins_in_air = None
        self.awaited.clear()
        self._folded_mono_s.clear()
        for mirror in self.mirrors.values():
            mirror.clear()
        self.radar_look = self._cloud_look = None
        self.avoidance = AvoidanceStatus()
        self.forget_alerts()

    def forget_alerts(self) -> None:
        """The clock has jumped: what was heard before belongs to another time."""
        self._alerts.clear()
        self.refresh()

    # How

    def _tell_status(self, sensor: Sensor) -> None:
        now_s = self._now_mono_s()
        self._told_mono_s[sensor] = now_s
        status = self.statuses[sensor]
        self._pages.publish(PerceptionMessage(source=self._source, now_mono_s=now_s, sensor=sensor, status=status))

    def _lose(self, sensor: Sensor, now_s: float) -> None:
        text = f"Nothing is heard of the {sensor} any more: its node may have died. It is started again."
        lost = ObstacleAlert(f"lost-{sensor}-{now_s:.1f}", sensor, "sensor", "begins", now_s, 0.0, now_s, text)
        self._lost[sensor] = lost
        self._tell_own(lost)

    def _is_left_incomplete(self, name: MapName, now_s: float) -> bool:
        """Parts of a large map take their time."""
        late = now_s - self._folded_mono_s.get(name, float("-inf")) > LATE_S
        return late and not self.mirrors[name].is_complete

    def _ask_for_all(self) -> None:
        """Of maps that are not here any more, and of nodes that have not spoken, nothing is waited for."""
        self.awaited.clear()
        for sensor in SENSORS:
            if self.mirrors[sensor].origin is None and not self.is_silent(sensor):
                self.needs_whole[sensor].set()

    def _tell_kept(self) -> None:
        """What counts, and is drawn no more, is said; and what may not count."""
        for name in SENSORS:
            mirror = self.mirrors[name]
            self._tell_lasting(
                f"kept-{name}",
                name,
                f"The {name} map began anew: what {_HAD_SEEN[name]} counts for ways, returns and plans {_UNTIL}.",
                over=f"Nothing that the {name} saw before counts any more.",
                holds=mirror.kept_count > 0,
            )
            self._tell_lasting(
                f"forgot-{name}",
                name,
                f"Not all that the {name} had seen before its map began anew could be kept: no way and no return is"
                f" certified {_UNTIL}, and plans against what was seen are without it.",
                over=f"What the {name} had seen before is not waited for any more.",
                holds=mirror.has_forgotten,
            )
        self._tell_lasting(
            "start",
            "radar",
            "The vehicle was in the air when this server heard it first: what sensors saw before that, and have not in"
            f" their maps any more, does not count for ways, returns and plans {_UNTIL}.",
            over="Nothing counts any more that sensors saw before this server heard the vehicle.",
            holds=bool(self._begins_in_air),
        )

    def _tell_lasting(self, subject: str, sensor: Sensor, text: str, *, over: str, holds: bool) -> None:
        told, now_s = self._lasting.get(subject), self._now_mono_s()
        if holds and told is None:
            told = ObstacleAlert(f"{subject}-{now_s:.1f}", sensor, "sensor", "begins", now_s, 0.0, now_s, text)
            self._lasting[subject] = told
            self._tell_own(told)
        elif told is not None and not holds:
            del self._lasting[subject]
            self._tell_own(replace(told, phase="ends", text=over))

    def _tell_own(self, alert: ObstacleAlert) -> None:
        now_s = self._now_mono_s()
        self.on_alert(replace(alert, t_mono_s=now_s, t_utc_s=self._now_utc_s(), done_t_mono_s=now_s))


def _lost_with_link(heard: AvoidanceStatus) -> AvoidanceStatus:
    if not heard.enabled:
        return heard
    return replace(heard, state="lost", text=_NOBODY_WATCHES["lost"], largest_speed_m_s=None, sensors=(), eyes=())


def _filled(status: PerceptionStatus) -> list[MapName]:
    """Maps of a sensor that are not empty, by its own word, and can be told: one that lies nowhere yet cannot."""
    if not status.placed or status.origin is None:
        return []
    flight = status.flight_map
    filled: list[MapName] = [status.sensor] if status.voxels_occupied else []
    if flight is not None and flight.voxels_occupied:
        filled.append("vision_flight")
    return filled
