"""Before a flight: connect, upload, verify, check, and move the heights to suit where the vehicle stands."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from planning.basics.plan_model import Mission, VehicleProfile
from planning.certificate.certificate_model import ClearanceParams
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from telemetry.errors import ConnectionFailedError, NotAllowedError, NoVehicleError, TransferError
from telemetry.flight.preflight import checks
from telemetry.flight.preflight.parameters import NAMES
from telemetry.flight.preflight.preflight import Preflight, actual_home, check
from telemetry.flight.preflight.rereference import rereference
from telemetry.flight.preflight.resume import Resumption, plan_resumption
from telemetry.flight.watch import Asks, Watch
from telemetry.mavlink.address import parse_addresses
from telemetry.mavlink.items import items_from_mission
from telemetry.topics.checklist import ChecklistPoint
from telemetry.topics.messages import ErrorInfo
from telemetry.topics.onboard_lists import UploadReport
from telemetry.topics.requests import Connect, Operator, ReadParameters, Upload
from telemetry.topics.vehicle import VehicleState

Report = Callable[[str], None]

CONNECT_S = 30.0
VERSION_S = 2.0
"""A vehicle that does not say which firmware it runs is not waited for any longer."""
FAILED_PATIENCE_S = 5.0
"""A connection that cannot be opened is tried again for so long."""
HOME_ATTEMPTS = 3
"""A vehicle that stands still is at home after one; GNSS may drift by more than heights allow in between."""


@dataclass(frozen=True, slots=True)
class FlyOptions:
    address: str
    operator: Operator
    profile: VehicleProfile
    clearance: ClearanceParams
    way: Literal["auto", "guided"] = "auto"
    dsm: Dsm | None = None
    """None: neither the ground at home nor the clearance is checked."""
    from_item: int = 1
    """Above 1: go on there with a mission that broke off."""
    accept: frozenset[str] = frozenset()
    """Codes of rows of the check that may be less than good."""
    checklist: tuple[ChecklistPoint, ...] = ()
    """As the crew ticked it; written down before the start."""
    name: str = "mission"
    connect_s: float = CONNECT_S
    ready_s: float = 120.0
    """How long GNSS and the vehicle's own checks are waited for."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A mission on board, checked."""

    mission: Mission
    upload: UploadReport
    preflight: Preflight
    resumption: Resumption | None = None


async def connect(
    client: Asks, watch: Watch, address: str, operator: Operator, report: Report, *, timeout_s: float = CONNECT_S
) -> VehicleState:
    """Opens the connection and adopts the first vehicle heard on it. ``address``: several ways, with commas between.

    Raises ConnectionFailedError when none can be opened, NoVehicleError when nobody is heard.
    """
    report(f"Connecting to {address}")
    texts = [each.text for each in parse_addresses(address)]
    for text in texts:
        await client.call(Connect(operator, text, adopt=True, as_way=len(texts) > 1))
    give_up_s = asyncio.get_running_loop().time() + FAILED_PATIENCE_S

    def found(seen: Watch) -> VehicleState | ErrorInfo | None:
        if seen.link is None:
            return None
        adopted = seen.link.adopted
        if adopted is not None and adopted.address in texts and seen.link.state == "live" and seen.vehicle is not None:
            return seen.vehicle
        hopeless = asyncio.get_running_loop().time() >= give_up_s
        failed = [c.error for c in seen.link.connections if c.state == "failed"]
        return failed[0] if hopeless and len(failed) == len(texts) else None

    answer = await watch.until(found, timeout_s=timeout_s)
    if isinstance(answer, ErrorInfo):
        raise ConnectionFailedError(answer.what, where=answer.where or address, advice=answer.advice)
    if answer is None:
        what = f"No vehicle was heard within {timeout_s:.0f} s."
        advice = "Check the link string, and that the vehicle is switched on."
        raise NoVehicleError(what, where=address, advice=advice)
    told = await watch.until(lambda seen: _with_version(seen.vehicle, answer), timeout_s=VERSION_S) or answer
    report(f"Vehicle {told.system_id}: {told.autopilot} {told.firmware_version or ''}".rstrip())
    if watch.link is not None:
        failed = [(c.address, c.error.what) for c in watch.link.connections if c.error is not None]
        for warning in (*watch.link.warnings, *(f"The way {at} is not open: {what}" for at, what in failed)):
            report(f"Warning: {warning}")
    return told


def _with_version(seen: VehicleState | None, answer: VehicleState) -> VehicleState | None:
    """The same vehicle, once it has said what it runs: it is asked when it is adopted."""
    known = seen is not None and seen.system_id == answer.system_id and seen.firmware_version is not None
    return seen if known else None


async def prepare(client: Asks, watch: Watch, mission: Mission, options: FlyOptions, report: Report) -> Prepared:
    """The mission on board, its heights counted from where the vehicle stands, and checked."""
    await _await_position(watch, options, report)
    upload = await send(client, mission, options.operator, report)
    preflight = await _check(client, watch, upload, mission, options, None)
    planned, attempts = mission, 1
    while preflight.needs_rereference and attempts < HOME_ATTEMPTS:
        mission, moved_m = _from_here(planned, watch, options)
        report(f"The ground at the vehicle is {moved_m:+.2f} m from the planned home's: heights are moved to suit it")
        upload = await send(client, mission, options.operator, report)
        preflight = await _check(client, watch, upload, mission, options, moved_m)
        attempts += 1
    for row in preflight.rows:
        report(f"  {row.code}: {row.text}")
    _refuse(preflight.in_the_way(_accepted(options)))
    resumption = await asyncio.to_thread(_resumption, preflight, options)
    if resumption is not None:
        report(f"Going on at item {resumption.from_item}: up to {resumption.climb_to_m:.1f} m, then straight there")
        for number in resumption.skipped:
            report(f"  item {number} sets something that is not set again")
    return Prepared(mission, upload, preflight, resumption)


def _resumption(preflight: Preflight, options: FlyOptions) -> Resumption | None:
    """The way back into a mission that broke off. Raises NotAllowedError when it is not clear, or cannot be proved."""
    if options.from_item == 1:
        return None
    where = f"going on at item {options.from_item}"
    if options.way == "guided":
        advice = "Fly the rest in AUTO."
        raise NotAllowedError("Waypoints handed over one at a time begin at the first.", where=where, advice=advice)
    if options.dsm is None or preflight.mission is None or preflight.clearance is None:
        what = "Without a surface model the way there cannot be proved to be clear."
        raise NotAllowedError(what, where=where, advice="Give the surface model.")
    surface, _ = fill_holes(options.dsm)
    return plan_resumption(preflight.mission, options.from_item, surface, preflight.clearance)


def _from_here(planned: Mission, watch: Watch, options: FlyOptions) -> tuple[Mission, float]:
    """The mission with heights counted from where the vehicle stands, and how much higher its ground is there."""
    home = actual_home(_state(watch), options.dsm)
    assert home is not None
    assert options.dsm is not None
    shift_m = home.alt_dsm_m - flown_line(planned, options.dsm).home_alt_dsm_m
    return rereference(planned, shift_m, home=home), shift_m


def _refuse(rows: tuple[checks.Row, ...]) -> None:
    if not rows:
        return
    text = " ".join(f"{row.text} {row.mend}".strip() for row in rows)
    acceptable = all(row.state == "accept" for row in rows)
    advice = f"Or accept it: {', '.join(row.code for row in rows)}." if acceptable else ""
    raise NotAllowedError(text, where="the check before the start", advice=advice)


async def send(client: Asks, mission: Mission, operator: Operator, report: Report) -> UploadReport:
    """Uploads and reads back; TransferError when something else is on board afterwards."""
    upload = await transfer(client, mission, operator, report)
    if not upload.verified:
        raise TransferError(
            f"The vehicle holds another mission than was sent: {upload.differences[0]}",
            where=f"{len(upload.differences)} differences",
            advice="Upload again.",
        )
    report(f"Verified by read-back; the vehicle rounded {len(upload.rounded)} values")
    return upload


async def transfer(client: Asks, mission: Mission, operator: Operator, report: Report) -> UploadReport:
    """Uploads and reads back, and tells how the two compare."""
    items, home = items_from_mission(mission), mission.home
    report(f"Uploading {len(items)} items")
    return await client.call(Upload(operator, items, home.lat_deg, home.lon_deg, home.alt_dsm_m))


async def _await_position(watch: Watch, options: FlyOptions, report: Report) -> None:
    """Until the vehicle knows where it is and its own checks pass, or the time is up: the check then says why not."""

    def ready(seen: Watch) -> bool | None:
        state = seen.vehicle
        if state is None or actual_home(state, None) is None:
            return None
        rows = (checks.gnss_row(state, options.profile), checks.ready_row(state))
        return True if all(row.state in ("good", "accept") for row in rows) else None

    if ready(watch) is None:
        report("Waiting until the vehicle knows its position and is ready")
        await watch.until(ready, timeout_s=options.ready_s)


async def _check(
    client: Asks, watch: Watch, upload: UploadReport, planned: Mission, options: FlyOptions, moved_m: float | None
) -> Preflight:
    state = _state(watch)
    firmware = "px4" if state.autopilot == "px4" else "ardupilot"
    parameters = await client.call(ReadParameters(NAMES[firmware]))
    return await asyncio.to_thread(
        check,
        upload.onboard,
        state,
        parameters,
        dsm=options.dsm,
        profile=options.profile,
        clearance=options.clearance,
        planned_home=planned.home,
        firmware=firmware,
        rereferenced_m=moved_m,
        fence=planned.fence,
        rally=planned.rally,
    )


def _accepted(options: FlyOptions) -> frozenset[str]:
    """Who flies without a surface model has accepted that nothing is checked against one."""
    return options.accept | {"clearance", "home", "rtl_height", "battery"} if options.dsm is None else options.accept


def _state(watch: Watch) -> VehicleState:
    if watch.vehicle is None:
        raise NoVehicleError("The vehicle is gone.", advice="Check the link.")
    return watch.vehicle
