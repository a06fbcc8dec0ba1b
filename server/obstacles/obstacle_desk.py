"""What operators do about obstacles: acknowledge, set, clear, avoid, fly past, plan against what was seen, take out."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from planning.errors import PlanningError
from planning.missions.vehicle_profile import parse_profile
from server.door.lease import Lease
from server.errors import NotReadyError, reported
from server.obstacles.kept_settings import changed, read_settings, write_settings
from server.obstacles.manoeuvres import Manoeuvres
from server.obstacles.obstacle_watch import Watch
from server.obstacles.rest_of_plan import rest_of_plan
from server.obstacles.section import map_file
from server.obstacles.surroundings import Surroundings, is_more_than
from server.plan.plan_requests import PlanRequests
from server.scene.mirror import MapMirror
from server.schemas import (
    MapFormat,
    ObstaclesState,
    PerceptionSettingsBody,
    PlanState,
    PlanWithSeen,
    SetAvoidanceBody,
    Source,
)
from server.work.jobs import Lane
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.flight.avoidance.regions import braking_of
from telemetry.flight.home_watch import home_of_takeoff
from telemetry.perception.sensor_kinds import check_memory, check_perception
from telemetry.topics.messages import LinkStatus, PlanRecord, Topic
from telemetry.topics.obstacles import MAP_NAMES, MapName, PerceptionSettings, sensor_of
from telemetry.topics.requests import Operator, SetAvoidance

log = logging.getLogger("hedgehop.obstacles")


DEMO_SETTINGS = PerceptionSettings(radar_depth_m=15.0, vision_depth_m=14.0)
"""The demo flies at 5 m/s: the papers' regions, for 3 m/s, would end where it can only just stop."""


class ObstacleDesk:
    """Commands come from live data only; of a replay only maps may be taken out as files."""

    def __init__(
        self,
        root: Path,
        watches: Mapping[Source, Watch],
        manoeuvres: Manoeuvres,
        around: Surroundings,
        link: LinkClient,
        plans: PlanRequests,
        lane: Lane,
        lease: Lease,
        bus: Bus,
    ) -> None:
        self._root, self._watches, self._manoeuvres, self._around = root, watches, manoeuvres, around
        self._link, self._plans, self._lane, self._lease, self._bus = link, plans, lane, lease, bus
        self._live = watches["live"]
        self._clearing = asyncio.Lock()
        self._avoid_when_adopted = False
        """Of the demo's simulated vehicle: it climbs over what stands in its way."""
        self._kept = PerceptionSettings()
        """What the operator has set; the demo's own settings are never written down."""
        self._profile_toml = ""

    async def start(self) -> None:
        """Nodes get the settings from the bus whenever they start."""
        self._kept = await asyncio.to_thread(read_settings, self._root)
        self._set(self._kept)

    def brake_as(self, record: PlanRecord | None) -> None:
        """The vehicle brakes as the profile of the plan on board says."""
        if record is None or record.profile_toml == self._profile_toml:
            return
        self._profile_toml = record.profile_toml
        try:
            profile = parse_profile(record.profile_toml.encode(), where="the plan's profile")
        except PlanningError as error:
            log.warning("How the vehicle brakes: %s", reported(error, log, "Reading the plan's profile").what)
            return
        braking = braking_of(record.firmware, profile.brake_decel_m_s2, profile.brake_jerk_m_s3)
        brakes = {"brake_decel_m_s2": braking.decel_m_s2, "brake_jerk_m_s3": braking.jerk_m_s3}
        self._kept = replace(self._kept, **brakes)
        self._set(replace(self._live.settings, **brakes))

    async def acknowledge(self, alert_id: str | None) -> ObstaclesState:
        self._live.acknowledge(alert_id)
        return self._live.state

    async def set_avoidance(self, operator: Operator, body: SetAvoidanceBody) -> None:
        """Raises NotAllowedError and what else the link says."""
        self._avoid_when_adopted = False
        await self._link.call(SetAvoidance(operator, body.enabled, body.consent, body.by))

    def avoid_in_demo(self) -> None:
        """As soon as the simulated vehicle is connected; whoever switches avoidance before that decides."""
        self._avoid_when_adopted = True
        if replace(self._kept, clear_count=0) == PerceptionSettings():
            self._set(replace(DEMO_SETTINGS, clear_count=self._kept.clear_count))

    async def on_link(self, status: LinkStatus) -> None:
        if not self._avoid_when_adopted or status.adopted is None or status.state != "live":
            return
        self._avoid_when_adopted = False
        try:
            await self._link.call(SetAvoidance(self._lease.server_operator(), enabled=True))
        except Exception as error:
            doc = reported(error, log, "Switching avoidance on")
            log.warning("Avoidance stays off in the demo: %s", doc.what)

    async def change_settings(self, body: PerceptionSettingsBody) -> ObstaclesState:
        """Raises MappingError for what cannot fit: nothing is changed then."""
        wanted = changed(self._live.settings, body)
        check_perception(wanted)
        if body.memory_limit_bytes is not None:
            check_memory(body.memory_limit_bytes, maps=len(MAP_NAMES))
        self._set(wanted)
        await self._keep(changed(self._kept, body))
        return self._live.state

    async def clear(self) -> None:
        """Before any node hears of it, nothing that is told counts any more."""
        async with self._clearing:  # two orders have two numbers
            clear_count = self._live.settings.clear_count + 1
            await self._live.dismiss(clear_count)
            self._set(replace(self._live.settings, clear_count=clear_count))
            await self._keep(replace(self._kept, clear_count=clear_count))

    async def fly(self, operator: Operator, manoeuvre_id: str) -> None:
        """Raises NotFoundError for one that is out of date, and what the link says."""
        await self._link.call(await self._manoeuvres.request(operator, manoeuvre_id))

    async def plan_with_seen(self, body: PlanWithSeen) -> PlanState:
        """With what was seen before a map began anew in this flight; where something is missing, the plan says so, and
        the edit's words. Raises NotReadyError when nothing was seen, and for a part when no mission is flown."""
        if not body.seen:
            return await self._plans.plan_without_seen()
        mirrors = [self._live.mirrors[sensor] for sensor in dict.fromkeys(body.sensors)]
        lacking = [mirror for mirror in mirrors if self._live.is_lacking(mirror.sensor)]
        missing = f"parts of {_maps(lacking)} are missing"
        maps = [seen for mirror in mirrors for seen in await asyncio.to_thread(mirror.seen_so_far)]
        maps = [seen for seen in maps if len(seen.keys) and not seen.explained.all()]
        if not maps and lacking:
            what = f"Nothing else was seen that the surface model does not know, and {missing}."
            raise NotReadyError(what, advice="They are asked for: plan again once they have come, or plan as is.")
        if not maps:
            raise NotReadyError(
                "Nothing was seen that the surface model does not know.", advice="Fly on, or plan as is."
            )
        live = self._around.live
        began_anew = [mirror for mirror in mirrors if mirror.kept_count]
        also = f", also before {_maps(began_anew)} began anew" if began_anew else ""
        but = f", but not all: {missing}" if lacking else ""
        words = f"Plan against what was seen{also}{but}"
        lacks = [f"{missing.capitalize()}."] if lacking else []
        before = await asyncio.to_thread(self._live.mirrors["vision_flight"].seen_so_far)
        if "vision" in body.sensors and await asyncio.to_thread(is_more_than, maps, before):
            lacks.append("What the camera saw before its newest frame is not in it.")
        seen = maps, live.state, home_of_takeoff(live.track.states), words, " ".join(lacks)
        if body.part == "whole":
            return await self._plans.plan_with_seen(*seen)
        part, underway = body.part, self._around.underway
        return await self._plans.plan_with_seen(
            *seen, lambda terrain_id: rest_of_plan(part, underway, terrain_id=terrain_id)
        )

    async def exported(self, source: Source, name: MapName, kind: MapFormat) -> bytes:
        """Raises NotReadyError while the map is empty."""
        voxels = await asyncio.to_thread(self._watches[source].mirrors[name].voxels)
        if voxels.origin is None or not len(voxels.keys):
            raise NotReadyError(f"The map of the {sensor_of(name)} is empty.", advice="Nothing has been seen yet.")
        return await self._lane.call(map_file, voxels, name, kind)

    async def _keep(self, settings: PerceptionSettings) -> None:
        self._kept = settings
        await asyncio.to_thread(write_settings, self._root, settings)

    def _set(self, settings: PerceptionSettings) -> None:
        self._live.on_settings(settings)
        self._bus.publish(Topic.PERCEPTION_SETTINGS, settings)


def _maps(mirrors: Sequence[MapMirror]) -> str:
    return " and ".join(f"the {mirror.sensor} map" for mirror in mirrors)
