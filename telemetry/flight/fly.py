"""A whole flight: connect, upload, check, start, follow to the landing. For programs; the console does it by hand."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from typing import Protocol

from planning.model import Mission
from planning.vehicle_profile import dump_profile
from telemetry.errors import RefusedError
from telemetry.flight.preflight import Preflight
from telemetry.flight.prepare import FlyOptions, Prepared, Report, connect, prepare
from telemetry.flight.records import plan_record
from telemetry.flight.targets import guided_plan
from telemetry.flight.watch import Asks, Subscribes, Watch, watching
from telemetry.messages import FlightStatus, PlanRecord, Topic, UploadReport, VehicleText
from telemetry.requests import ReturnHome, StartAuto, StartGuided
from telemetry.vehicle import VehicleState

__all__ = ["FlyOptions", "FlyResult", "Observer", "fly"]

ARM_AGAIN_S = 2.0
FOLLOW_S = 1.0
"""How often progress is told."""


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
        bus.publish(Topic.PLAN, _record(prepared, options))
        observer.on_start(prepared)
        started_utc_s = await _start(client, watch, prepared, options, report)
        flight = await _follow(client, watch, options, observer, started_utc_s, go_home)
    completed = flight.phase == "landed" and flight.broke_off_at is None
    return FlyResult(completed, _ending(flight), prepared.mission, prepared.upload, prepared.preflight, flight)


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
    return StartGuided(options.operator, script.targets, script.takeoff_alt_rel_home_m, end=script.end)


async def _follow(
    client: Asks,
    watch: Watch,
    options: FlyOptions,
    observer: Observer,
    started_utc_s: float,
    go_home: asyncio.Event | None,
) -> FlightStatus:
    """To the landing. A lost link is said, not an end: the vehicle flies on, and may be heard again."""
    phase, heard, sent_home, report = "", True, False, observer.tell
    while True:
        ended = await watch.until(lambda seen: _ended(seen, started_utc_s), timeout_s=FOLLOW_S)
        if ended is not None:
            return ended
        if watch.flight.phase != phase:
            phase = watch.flight.phase
            report(phase.replace("_", " ").capitalize())
        if watch.link is not None and (watch.link.state != "lost") != heard:
            heard = not heard
            report("Communication is back" if heard else "Communication lost: the vehicle flies on by itself")
        if go_home is not None and go_home.is_set() and not sent_home:
            sent_home = True
            report("Return home commanded")
            await client.call(ReturnHome(options.operator))
        if watch.vehicle is not None:
            observer.on_state(watch.vehicle, watch.flight)


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
    return plan_record(
        prepared.mission,
        digest=prepared.upload.onboard.digest,
        name=options.name,
        dsm=options.dsm,
        certificate=prepared.preflight.certificate,
        profile_toml=dump_profile(options.profile),
    )
