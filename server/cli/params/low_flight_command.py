"""``hedgehop params review``: before a low flight, what the vehicle's own settings will do on it."""

from __future__ import annotations

import asyncio
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument

from planning.errors import ParameterError
from planning.formats.detect import read_mission
from planning.missions.feasibility import commanded_speed_m_s
from planning.planner.part import certify_part
from planning.planner.plan import CERTIFICATE_STEP
from server.cli.params.params_session import parameter_session
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.files_in_out import read_small
from server.cli.shared.mission_vehicle import judged_by
from server.cli.shared.output import answer, end_progress, progress, say_notes
from server.cli.shared.terrain_given import open_model
from server.work.clocks import StepTimer
from telemetry.errors import NotAllowedError
from telemetry.flight.low_flight.findings import Finding
from telemetry.flight.low_flight.low_plan import LowPlan, low_plan
from telemetry.flight.low_flight.review import MULTIROTORS, review_settings
from telemetry.mavlink.address import parse_addresses
from telemetry.parameters.files import value_text

_WORDS = {"bad": "CHANGE", "look": "LOOK", "good": "good"}


@command
def review(
    mission: Annotated[
        Path | None, Argument(metavar="MISSION", help="The mission that is to be flown: .waypoints or .plan.")
    ] = None,
    *,
    link: o.Link,
    dsm: o.FlightDsm = None,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
    given: Annotated[o.VehicleOptions, Without("max_items", "rtl_height_m")],
    demands: Annotated[o.ClearanceOptions, Without("flown_as", "max_height_above_ground_m")],
    how: Annotated[o.ModelOptions, Without("remove_spikes")],
) -> None:
    """Say what the vehicle's own settings will do on a low flight, worst first; ends with 1 if one should be changed.

    Nothing is written. With --dsm the return height is held against the surface model.
    """
    parse_addresses(link)
    if dsm is not None and mission is None:
        raise ParameterError("A surface model says nothing without a mission.", where="--dsm", advice="Give a mission.")
    plan = None if mission is None else _plan(mission, dsm, given, demands, how)
    title, found = asyncio.run(_review(link, data_dir, plan))
    bad = sum(f.state == "bad" for f in found)
    summary = {"vehicle": title, "to_change": bad, "findings": [asdict(f) for f in found]}
    lines = [line for finding in found for line in _lines(finding, link)]
    answer(summary, [*lines, f"{bad} of {len(found)} to be changed before this flight."], as_json=as_json)
    raise typer.Exit(FAILED if bad else DONE)


def _plan(
    file: Path, dsm: Path | None, given: o.VehicleOptions, demands: o.ClearanceOptions, how: o.ModelOptions
) -> LowPlan:
    flight = read_mission(file.name, read_small(file))
    say_notes(*flight.warnings)
    request = judged_by(flight, given, demands, None)
    # Where its own items ask for a speed, that is the plan's; its profile says what it was planned for otherwise.
    speed_m_s = commanded_speed_m_s(flight) or flight.cruise_speed_m_s or request.path.max_speed_m_s
    if dsm is None:
        return low_plan(flight, speed_m_s=speed_m_s)
    timer = StepTimer(progress)
    opened = open_model(dsm, timer, how)
    timer(CERTIFICATE_STEP, None)
    # What the model adds is added where it is judged.
    _, certificate = certify_part(
        opened.model, flight, request.clearance(), max_hole_m2=how.max_hole_m2, assumptions=opened.made
    )
    end_progress()
    return low_plan(flight, speed_m_s=speed_m_s, return_needed_m=certificate.rtl_height_needed_m)


async def _review(link: str, data_dir: Path | None, plan: LowPlan | None) -> tuple[str, tuple[Finding, ...]]:
    async with parameter_session(link, data_dir) as session:
        vehicle = session.vehicle
        if vehicle.autopilot == "other" or vehicle.vehicle_type not in MULTIROTORS:
            what = f"This is {session.title}, type {vehicle.vehicle_type}."
            raise NotAllowedError(what, advice="Settings are reviewed of multirotors with ArduPilot or PX4.")
        values = {parameter.name: parameter.value for parameter in await session.whole_list()}
    firmware = "px4" if vehicle.autopilot == "px4" else "ardupilot"
    return session.title, review_settings(values, firmware, plan)


def _lines(finding: Finding, link: str) -> list[str]:
    held = "" if finding.value is None else f" = {value_text(finding.value, None)}"
    lines = [f"{_WORDS[finding.state]:<6} {finding.parameter}{held}: {finding.text}"]
    if finding.better is not None:
        lines.append(f"       hedgehop params set {finding.parameter} {value_text(finding.better, None)} --link {link}")
    return lines
