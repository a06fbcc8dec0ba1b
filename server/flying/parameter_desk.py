"""The parameters of the adopted vehicle: read as a whole, kept until another one is adopted, written and read back."""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from planning.basics.plan_model import Firmware
from planning.errors import FormatError
from planning.formats.wpl import read_wpl
from planning.missions.vehicle_profile import parse_profile
from server.errors import ConflictError, NotReadyError, StorageError
from server.flying.descriptions import (
    keep_descriptions,
    keep_vehicle_descriptions,
    kept_descriptions,
    known_crcs,
    own_descriptions,
    vehicle_descriptions,
)
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.schemas.parameter_docs import (
    ComparedDoc,
    DifferenceDoc,
    FindingDoc,
    ParameterChangeDoc,
    ParameterDoc,
    ParametersDoc,
    WrittenAnswer,
    WrittenDoc,
)
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, NoVehicleError, TelemetryError
from telemetry.flight.low_flight.low_plan import LowPlan, low_plan
from telemetry.flight.low_flight.review import MULTIROTORS, review_settings
from telemetry.parameters.comparing import compare, of_vehicle
from telemetry.parameters.described import Description
from telemetry.parameters.files import (
    FileParameter,
    is_kept_by_vehicles,
    is_own_of_each,
    read_parameter_file,
    value_text,
    write_mission_planner,
    write_qgc,
)
from telemetry.topics.messages import PlanRecord
from telemetry.topics.parameters import WHOLE_RANGES, Parameter, ParameterChange, ParameterWritten
from telemetry.topics.requests import ListParameters, Operator, ReadMetadata, WriteParameters
from telemetry.topics.vehicle import Autopilot, VehicleState

FileFormat = Literal["vehicle.param", "vehicle.params"]
_NONE = Description()
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Read:
    """What a vehicle held when it was asked, and what was written since."""

    vehicle: str
    title: str
    """What people call it."""
    state: VehicleState
    parameters: dict[str, Parameter]
    described: dict[str, Description]
    read_utc_s: float


class ParameterDesk:
    """All methods belong to the event loop; files are read beside it."""

    def __init__(
        self,
        link: LinkClient,
        live: Channel,
        aboard: Aboard,
        root: Path,
        on_written: Callable[[], None],
        name: str = "",
    ) -> None:
        """``on_written``: some may have been written; ``name``: of the vehicle, where there are several."""
        self._link, self._live, self._aboard, self._root = link, live, aboard, root
        self._on_written, self._name = on_written, name
        self._kept: _Read | None = None
        self._busy = False

    async def doc(self) -> ParametersDoc:
        """As read before. Raises NotReadyError, NoVehicleError."""
        read = self._read_before()
        return await asyncio.to_thread(_doc, read, self._aboard.record)

    async def read(self) -> ParametersDoc:
        """The whole list, anew: up to a minute over a slow radio. Raises what the link raises."""
        vehicle, state = self._vehicle()
        if self._busy:
            raise ConflictError("The parameters are being read already.", advice="Wait until that is done.")
        self._busy = True
        try:
            listed = await self._link.call(ListParameters())
        finally:
            self._busy = False
        if self._vehicle()[0] != vehicle:
            raise ConflictError("Another vehicle was adopted meanwhile.", advice="Read the parameters again.")
        described, _ = await asyncio.to_thread(kept_descriptions, self._root, state.autopilot)
        described |= await self._own_descriptions(state.autopilot)
        if self._vehicle()[0] != vehicle:
            raise ConflictError("Another vehicle was adopted meanwhile.", advice="Read the parameters again.")
        self._kept = _Read(vehicle, _title(state, self._name), state, listed.by_name(), described, time.time())
        return await self.doc()

    async def write(self, operator: Operator, changes: Sequence[ParameterChangeDoc]) -> WrittenAnswer:
        """One after the other, each read back; refused while the vehicle is armed. Raises what the link raises."""
        read = self._read_before()
        asked = tuple(ParameterChange(change.name, change.value) for change in changes)
        try:
            written = await self._link.call(WriteParameters(operator, asked))
        except Exception as error:
            if not isinstance(error, NotAllowedError):
                self._on_written()
            raise
        self._on_written()
        self._kept = replace(read, parameters=_after(read.parameters, written))
        return WrittenAnswer(written=written_docs(written), now=await self.doc())

    def on_written(self, written: Sequence[ParameterWritten]) -> None:
        """By another desk: what was read before is brought up to date."""
        if self._kept is not None:
            self._kept = replace(self._kept, parameters=_after(self._kept.parameters, written))
        self._on_written()

    def saved(self, file: FileFormat) -> str:
        """All that was read, as a file. Raises NotReadyError."""
        read = self._read_before()
        at = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(read.read_utc_s))
        heading = f"Parameters of {read.title}\n{at}, saved by Hedgehop"
        parameters = tuple(read.parameters.values())
        if file == "vehicle.params":
            return write_qgc(parameters, system_id=read.state.system_id, heading=heading)
        return write_mission_planner(parameters, heading)

    async def compared(self, name: str, data: bytes) -> ComparedDoc:
        """The vehicle against a file of Mission Planner's, MAVProxy's or QGroundControl's. Raises FormatError."""
        return await asyncio.to_thread(_compared, self._read_before(), name, data)

    async def compared_with(self, other: ParameterDesk) -> ComparedDoc:
        """Against another vehicle of this station, which is read anew. Raises what the link raises."""
        ours = self._read_before()
        await other.read()
        return await asyncio.to_thread(_compared_vehicles, ours, other._read_before())

    async def describe(self, name: str, data: bytes) -> ParametersDoc:
        """Takes the makers' own file for this kind of autopilot. Raises FormatError."""
        autopilot = self._read_before().state.autopilot
        described = await asyncio.to_thread(keep_descriptions, self._root, autopilot, name, data)
        described |= await self._own_descriptions(autopilot)
        self._kept = replace(self._read_before(), described=described)
        return await self.doc()

    async def _own_descriptions(self, autopilot: Autopilot) -> dict[str, Description]:
        """What the vehicle says of its own parameters: it goes before the makers' file, which may be of another
        version. Empty where it says nothing, or nothing that can be used."""
        known = await asyncio.to_thread(known_crcs, self._root, autopilot)
        try:
            found = await self._link.call(ReadMetadata(known))
            if not found.content:
                return await asyncio.to_thread(vehicle_descriptions, self._root, autopilot, found.crc)
            described = await asyncio.to_thread(own_descriptions, found.content)
        except (TelemetryError, FormatError, OSError) as error:
            _log.info("The vehicle's own description of its parameters is not used: %s", error)
            return {}
        try:
            await asyncio.to_thread(keep_vehicle_descriptions, self._root, autopilot, found.crc, found.content)
        except (StorageError, OSError) as error:
            _log.warning("The vehicle's own description of its parameters is used but not kept: %s", error)
        return described

    def _vehicle(self) -> tuple[str, VehicleState]:
        vehicle, state = self._aboard.vehicle, self._live.state
        if vehicle is None or state is None:
            raise NoVehicleError("No vehicle is connected.", advice="Connect one first.")
        return vehicle, state

    def _read_before(self) -> _Read:
        if self._kept is None or self._kept.vehicle != self._vehicle()[0]:
            raise NotReadyError("This vehicle's parameters have not been read.", advice="Press Read.")
        return self._kept


def written_docs(written: Sequence[ParameterWritten]) -> list[WrittenDoc]:
    return [
        WrittenDoc(
            name=w.name, asked=w.asked, before=w.before, after=w.after, outcome=w.outcome, took=w.took, words=w.words
        )
        for w in written
    ]


def _after(held: dict[str, Parameter], written: Sequence[ParameterWritten]) -> dict[str, Parameter]:
    """What was not read back is not known any more."""
    now = dict(held)
    for one in written:
        if one.name in now and one.outcome != "not sent":
            value = one.asked if one.took and one.after is None else one.after
            now[one.name] = replace(now[one.name], value=value)
    return now


def _doc(read: _Read, record: PlanRecord | None) -> ParametersDoc:
    findings, not_judged = _findings(read, record)
    return ParametersDoc(
        vehicle=read.title,
        read_utc_s=read.read_utc_s,
        described=bool(read.described),
        parameters=[_parameter(p, read.described.get(p.name, _NONE)) for p in _sorted(read)],
        findings=findings,
        plan_name="" if record is None else record.name,
        not_judged=not_judged,
    )


def _sorted(read: _Read) -> list[Parameter]:
    return sorted(read.parameters.values(), key=lambda parameter: parameter.name)


def _title(state: VehicleState, name: str) -> str:
    who = f"{name} (system {state.system_id})" if name else f"vehicle {state.system_id}"
    return f"{who}, {state.autopilot} {state.firmware_version or ''}".rstrip()


def _parameter(parameter: Parameter, about: Description) -> ParameterDoc:
    value = parameter.value
    return ParameterDoc(
        name=parameter.name,
        value=value,
        text=value_text(value, parameter.kind),
        whole=parameter.kind in WHOLE_RANGES,
        title=about.title,
        help=about.text,
        unit=about.unit,
        low=about.low,
        high=about.high,
        default=_default(parameter, about),
        meaning="" if value is None else about.meaning(value),
        reboot=about.reboot,
        changed=_is_changed(parameter, about),
    )


def _default(parameter: Parameter, about: Description) -> float | None:
    """The vehicle knows its own; the makers' file may be of another version."""
    return about.default if parameter.default is None else parameter.default


def _is_changed(parameter: Parameter, about: Description) -> bool:
    held = _default(parameter, about)
    if held is None or parameter.value is None:
        return False
    default = FileParameter(parameter.name, held, 0, parameter.kind)
    return not compare(of_vehicle((parameter,)), [default]).is_equal


def _findings(read: _Read, record: PlanRecord | None) -> tuple[list[FindingDoc], str]:
    """Worst first; or why there are none."""
    state = read.state
    if state.autopilot == "other" or state.vehicle_type not in MULTIROTORS:
        return [], "Settings are judged of multirotors with ArduPilot or PX4."
    firmware: Firmware = "px4" if state.autopilot == "px4" else "ardupilot"
    values = {name: parameter.value for name, parameter in read.parameters.items()}
    found = review_settings(values, firmware, None if record is None else _low_plan(record))
    docs = [
        FindingDoc(
            state=f.state,
            parameter=f.parameter,
            text=f.text,
            value=f.value,
            better=f.better if f.parameter in read.parameters else None,
            better_text="" if f.better is None else value_text(f.better, None),
        )
        for f in found
    ]
    return docs, ""


def _low_plan(record: PlanRecord) -> LowPlan:
    """Of the mission on board. What its way home needs is known once it was checked."""
    mission = read_wpl(record.mission_wpl)
    profile = parse_profile(record.profile_toml.encode(), where="the plan's profile")
    needed_m = None
    if record.certificate_json:
        found = json.loads(record.certificate_json)["rtl_height_needed_m"]
        needed_m = math.inf if found is None else float(found)
    return low_plan(mission, speed_m_s=mission.cruise_speed_m_s or profile.max_speed_m_s, return_needed_m=needed_m)


def _compared(read: _Read, name: str, data: bytes) -> ComparedDoc:
    given = read_parameter_file(name, data)
    same, differences = _differences(read, given.parameters)
    return ComparedDoc(file=name, same=same, differences=differences, notes=list(given.notes))


def _compared_vehicles(ours: _Read, theirs: _Read) -> ComparedDoc:
    same, differences = _differences(ours, of_vehicle(theirs.parameters.values()))
    marked = [each.model_copy(update={"own": is_own_of_each(each.name)}) for each in differences]
    notes: list[str] = []
    if (ours.state.autopilot, ours.state.firmware_version) != (theirs.state.autopilot, theirs.state.firmware_version):
        notes.append("The two have different firmware: names and units may differ.")
    return ComparedDoc(file=theirs.title, is_vehicle=True, same=same, differences=marked, notes=notes)


def _differences(read: _Read, given: Sequence[FileParameter]) -> tuple[int, list[DifferenceDoc]]:
    """How many are the same, and the others; without what vehicles count by themselves."""
    theirs = [p for p in given if not is_kept_by_vehicles(p.name)]
    ours = [p for p in of_vehicle(read.parameters.values()) if not is_kept_by_vehicles(p.name)]
    made = compare(ours, theirs)
    return made.same, [
        *(DifferenceDoc(name=d.name, here=d.here, there=d.there) for d in made.different),
        *(DifferenceDoc(name=p.name, here=p.value, there=None) for p in made.only_here),
        *(DifferenceDoc(name=p.name, here=None, there=p.value) for p in made.only_there),
    ]
