"""A whole flight: connect, upload, check, start, follow to the landing. For programs; the console does it by hand."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from planning.basics.plan_model import Mission, finite_or_none
from planning.certificate.certificate_model import Certificate
from planning.certificate.clearance import certificate_json
from planning.formats.wpl import write_wpl
from planning.missions.vehicle_profile import dump_profile
from planning.terrain.dsm import Dsm
from telemetry.errors import NotAllowedError, RefusedError, TelemetryError
from telemetry.flight.guided.script_targets import guided_plan
from telemetry.flight.preflight.preflight import Preflight
from telemetry.flight.preflight.prepare import FlyOptions, Prepared, Report, connect, prepare
from telemetry.flight.watch import Asks, Subscribes, Watch, watching
from telemetry.topics.checklist import ChecklistRecord
from telemetry.topics.messages import FlightStatus, PlanRecord, Topic, VehicleText
from telemetry.topics.onboard_lists import UploadReport
from telemetry.topics.requests import ReturnHome, StartAuto, StartGuided, TickPoint
from telemetry.topics.vehicle import VehicleState

__all__ = ["FlyOptions", "FlyResult", "Observer", "fly"]

ARM_AGAIN_S = 2.0
FOLLOW_S = 1.0
"""How often progress is told."""
HEARTBEAT_S = 2.5
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class FlyResult:
    completed: bool
    """All was flown and the vehicle has landed."""
    text: str
    """How it ended, in a sentence."""
    mission: Mission
    """As flown: after heights were moved, if they were."""
    upload: UploadReport
    preflight: Preflight
    flight: FlightStatus


class Observer(Protocol):
    """Who is told how it goes."""

    def tell(self, text: str) -> None:
        """A step, a warning, the vehicle's own words."""
        ...

    def on_start(self, prepared: Prepared) -> None:
        """From here on the vehicle may be in the air."""
        ...

    def on_refused(self) -> None:
        """The start was refused, and the vehicle stands on the ground, not armed."""
        ...

    def on_state(self, state: VehicleState, flight: FlightStatus) -> None:
        """About once a second while it flies."""
        ...


async def fly(
    client: Asks,
    bus: Subscribes,
    mission: Mission,
    options: FlyOptions,
    observer: Observer,
    *,
    go_home: asyncio.Event | None = None,
) -> FlyResult:
    """Fly a mission to its end. ``go_home``: set to command the return. Cancelling leaves the vehicle as it is.

    Raises what the link node raises; NotAllowedError when the check before the start fails; NoVehicleError.
    """
    report = observer.tell
    async with watching(bus, on_text=lambda text: _tell_text(text, report)) as watch:
        await connect(client, watch, options.address, options.operator, report, timeout_s=options.connect_s)
        prepared = await prepare(client, watch, mission, options, report)
        await _write_ticks_down(client, bus, watch, prepared, options)
        bus.publish(Topic.PLAN, _record(prepared, options))
        observer.on_start(prepared)
        watcher = _Watcher(client, watch, options, observer, go_home)
        try:
            started_utc_s = await _start(client, watch, prepared, options, report)
        except TelemetryError as error:
            await watcher.down_after(error)
            raise
        flight = await watcher.follow(started_utc_s)
    completed = flight.phase == "landed" and flight.broke_off_at is None
    return FlyResult(completed, _ending(flight), prepared.mission, prepared.upload, prepared.preflight, flight)


async def _write_ticks_down(
    client: Asks, bus: Subscribes, watch: Watch, prepared: Prepared, options: FlyOptions
) -> None:
    """The crew's checklist, for the log of commands and for the recording. Raises NotAllowedError: a point is open."""
    points, profile = options.checklist, options.profile.name
    for number, point in enumerate(points, start=1):
        if not point.ticked_by:
            what = f'Point {number} of the checklist is open: "{point.text}".'
            raise NotAllowedError(what, where="the check before the start", advice="Look, then tick it.")
        by = "" if point.ticked_by == options.operator.name else point.ticked_by
        await client.call(TickPoint(options.operator, number, len(points), point.text, profile, by=by))
    if points:
        vehicle = "" if watch.link is None or watch.link.adopted is None else watch.link.adopted.id
        now_s, digest = time.time(), prepared.upload.onboard.digest
        bus.publish(Topic.CHECKLIST, ChecklistRecord(now_s, profile, vehicle, digest, points, started_utc_s=now_s))


async def _start(client: Asks, watch: Watch, prepared: Prepared, options: FlyOptions, report: Report) -> float:
    """Arms and starts; a vehicle that refuses to arm is asked again while ``ready_s`` lasts. When it was asked last."""
    request = _start_request(prepared, options)
    report("Starting")
    loop = asyncio.get_running_loop()
    patience_s = loop.time() + options.ready_s
    while True:
        asked_utc_s = time.time()
        try:
            await client.call(request)
            return asked_utc_s
        except RefusedError as error:
            if loop.time() >= patience_s or (watch.vehicle is not None and watch.vehicle.armed):
                raise
            report(f"Not yet: {error.what}")
            await asyncio.sleep(ARM_AGAIN_S)


def _start_request(prepared: Prepared, options: FlyOptions) -> StartAuto | StartGuided:
    digest, again = prepared.upload.onboard.digest, prepared.resumption
    if again is not None:
        return StartAuto(options.operator, digest, again.from_item, again.climb_to_m)
    if options.way == "auto":
        return StartAuto(options.operator, digest)
    script = guided_plan(prepared.mission, speed_m_s=options.profile.max_speed_m_s)
    spare_m = None if (proof := prepared.preflight.certificate) is None else proof.spare_m
    takeoff_m = script.takeoff_alt_rel_home_m
    return StartGuided(options.operator, script.targets, takeoff_m, end=script.end, spare_m=spare_m)


class _Watcher:
    """Tells how the flight goes, and commands the return once it is asked for."""

    def __init__(
        self, client: Asks, watch: Watch, options: FlyOptions, observer: Observer, go_home: asyncio.Event | None
    ) -> None:
        self._client, self._watch, self._options = client, watch, options
        self._observer, self._go_home = observer, go_home
        self._phase, self._hint, self._heard = "", "", True

    async def follow(self, started_utc_s: float) -> FlightStatus:
        """To the landing. A lost link is said, not an end: the vehicle flies on, and may be heard again."""
        return await self._until(lambda seen: _ended(seen, started_utc_s))

    async def down_after(self, error: TelemetryError) -> None:
        """A start may fail after the vehicle has armed: it is not left alone before its motors stand still."""
        if not await self._is_armed():
            self._observer.on_refused()
            return
        self._observer.tell(f"The start went wrong, and the vehicle is armed: {error}")
        await self._until(lambda seen: True if seen.vehicle is None or not seen.vehicle.armed else None)

    async def _is_armed(self) -> bool:
        """By a heartbeat of now: the last one may be from before the order to arm."""
        now_s = time.monotonic()
        await self._watch.until(
            lambda seen: True if seen.vehicle and (seen.vehicle.heartbeat_t_mono_s or 0.0) > now_s else None,
            timeout_s=HEARTBEAT_S,
        )
        return self._watch.vehicle is not None and self._watch.vehicle.armed

    async def _until(self, over: Callable[[Watch], T | None]) -> T:
        while True:
            ended = await self._watch.until(over, timeout_s=FOLLOW_S)
            if ended is not None:
                return ended
            self._tell()
            if self._go_home is not None and self._go_home.is_set():
                await self._return_home(self._go_home)

    def _tell(self) -> None:
        watch, report = self._watch, self._observer.tell
        if watch.flight.phase != self._phase:
            self._phase = watch.flight.phase
            report(self._phase.replace("_", " ").capitalize())
        if watch.flight.hint != self._hint:
            self._hint = watch.flight.hint
            if self._hint:
                report(self._hint)
        if watch.link is not None and (watch.link.state != "lost") != self._heard:
            self._heard = not self._heard
            report("Communication is back" if self._heard else "Communication lost: the vehicle flies on by itself")
        if watch.vehicle is not None:
            self._observer.on_state(watch.vehicle, watch.flight)

    async def _return_home(self, wanted: asyncio.Event) -> None:
        """Again and again until it is obeyed: a failure must not end the watch over a vehicle in the air."""
        self._observer.tell("Return home commanded")
        try:
            await self._client.call(ReturnHome(self._options.operator))
        except TelemetryError as error:
            self._observer.tell(f"It was not obeyed and is commanded again: {error}")
        else:
            wanted.clear()


def _ended(watch: Watch, started_utc_s: float) -> FlightStatus | None:
    """What was heard last may still be the end of another flight."""
    flight = watch.flight
    is_this = flight.since_utc_s is not None and flight.since_utc_s >= started_utc_s
    return flight if is_this and flight.phase in ("landed", "interrupted") else None


def _ending(flight: FlightStatus) -> str:
    if flight.phase == "landed" and flight.broke_off_at is None:
        return "The mission was flown and the vehicle has landed."
    place = f"item {flight.broke_off_at} of {flight.targets}"
    return f"The flight broke off at {place}, where it can go on. {flight.hint}".strip()


def _tell_text(text: VehicleText, report: Report) -> None:
    if text.severity <= 4:
        report(f"Vehicle: {text.text}")


def _record(prepared: Prepared, options: FlyOptions) -> PlanRecord:
    return _plan_record(
        prepared.mission,
        digest=prepared.upload.onboard.digest,
        name=options.name,
        dsm=options.dsm,
        certificate=prepared.preflight.certificate,
        profile_toml=dump_profile(options.profile),
    )


def _plan_record(
    mission: Mission,
    *,
    digest: str,
    name: str,
    dsm: Dsm | None,
    certificate: Certificate | None,
    profile_toml: str,
) -> PlanRecord:
    """For recordings, complete enough to judge the flight later without the plan's files.

    Of a mission as it is on board; ``certificate`` is of what was read back.
    """
    return PlanRecord(
        t_utc_s=time.time(),
        name=name,
        mission_wpl=write_wpl(mission),
        digest=digest,
        firmware=mission.firmware,
        terrain_id="",
        terrain_name="",
        terrain_sha256=dsm.sha256 if dsm is not None else "",
        home_alt_dsm_m=finite_or_none(mission.home.alt_dsm_m),
        vertical_datum=mission.home.vertical_datum,
        profile_toml=profile_toml,
        certificate_json="" if certificate is None else json.dumps(certificate_json(certificate), allow_nan=False),
    )
