"""Hedgehop's own recording -> a flight log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Mission
from planning.errors import FormatError
from planning.formats.wpl import read_wpl
from planning.terrain.dsm import Dsm
from telemetry.errors import RecordingError
from telemetry.mavlink.reduce import reduce
from telemetry.recording.carried_ground import carried_ground
from telemetry.recording.frame_facts import FrameFacts, decode_frame
from telemetry.recording.mcap_files.reader import Recording
from telemetry.recording.recorded_flight import FlightLog, Stamped, StateHistory, track_of, truth_of
from telemetry.recording.tlog import Data, frame_address
from telemetry.recording.tlog_flight import mission_flown
from telemetry.topics.checklist import ChecklistRecord
from telemetry.topics.messages import CommandRecord, PlanRecord, RawFrame, Topic, VehicleText
from telemetry.topics.obstacles import AvoidanceStatus, ObstacleAlert, PerceptionSettings
from telemetry.topics.vehicle import VehicleState

_READ = (
    Topic.VEHICLE,
    Topic.TEXT,
    Topic.RAW,
    Topic.PLAN,
    Topic.CHECKLIST,
    Topic.COMMAND,
    Topic.ALERT,
    Topic.AVOIDANCE,
    Topic.PERCEPTION_SETTINGS,
)
STARTED_BEFORE_S = 120.0
"""A list that was ticked for a start so long before the recording began is of a flight before: a vehicle that does not
arm is asked again for no longer."""
_GLOBAL_POSITION = 33
_DECODED = frozenset({_GLOBAL_POSITION, 39, 44, 46, 47, 73, 86, 108})
"""Message ids of positions, missions, reached items, sent targets and the simulator's truth."""


class _Parts:
    """What is gathered on the way through a recording."""

    def __init__(self, mono_minus_utc_s: float) -> None:
        self._mono_minus_utc_s = mono_minus_utc_s
        self.history = StateHistory()
        self.facts: FrameFacts | None = None
        self.early: list[RawFrame] = []
        self.exact: list[Stamped] = []
        """A state for every position that came: those that are published may leave out some when there are many."""
        self.texts: list[VehicleText] = []
        self.commands: list[CommandRecord] = []
        self.plans: list[PlanRecord] = []
        self.checklist: ChecklistRecord | None = None
        self.alerts: list[ObstacleAlert] = []
        self.avoidance: list[tuple[float, AvoidanceStatus]] = []
        self.settings: list[tuple[float, PerceptionSettings]] = []
        self._decoder = mavlink.MAVLink(None)

    def on_state(self, state: VehicleState, t_utc_s: float) -> None:
        self.history.on_state(state, self._when(state, t_utc_s))
        if self.facts is None:
            self.facts = FrameFacts(state.system_id, state.component_id)
            for frame in self.early:
                self.on_frame(frame)

    def on_avoidance(self, status: AvoidanceStatus, t_utc_s: float) -> None:
        if not self.avoidance or self.avoidance[-1][1].state != status.state:
            self.avoidance.append((t_utc_s, status))

    def on_checklist(self, record: ChecklistRecord, began_utc_s: float) -> None:
        """What is ticked, or open again, after the start is for the next one."""
        if record.started_utc_s is not None and record.started_utc_s >= began_utc_s - STARTED_BEFORE_S:
            self.checklist = record

    def on_settings(self, settings: PerceptionSettings, t_utc_s: float) -> None:
        if not self.settings or self.settings[-1][1] != settings:
            self.settings.append((t_utc_s, settings))

    def _when(self, state: VehicleState, t_utc_s: float) -> float:
        """A new position counts from when it came, though the state may have been published a little later."""
        last = self.history.last
        new = last is None or last.position_t_mono_s != state.position_t_mono_s
        if new and state.position_t_mono_s is not None and self._mono_minus_utc_s:
            return state.position_t_mono_s - self._mono_minus_utc_s
        return state.t_utc_s or t_utc_s

    def on_frame(self, raw: RawFrame) -> None:
        if len(raw.frame) < 8 or frame_address(raw.frame.ljust(12, b"\0"))[0] not in _DECODED:
            return
        if self.facts is None:
            self.early.append(raw)
        elif (message := decode_frame(self._decoder, raw.frame)) is not None:
            self.facts.on_message(message, raw.t_utc_s)
            if message.get_msgId() == _GLOBAL_POSITION:
                self._on_position(message, raw.t_utc_s)

    def _on_position(self, message: Any, t_utc_s: float) -> None:
        state = reduce(self.history.last, message, t_mono_s=t_utc_s + self._mono_minus_utc_s, t_utc_s=t_utc_s)
        if state is not None and state is not self.history.last and state.lat_deg is not None:
            self.exact.append((t_utc_s, state))

    def positions(self) -> list[Stamped]:
        published = self.history.positions
        return self.exact if len(self.exact) >= len(published) else published


def read_mcap_flight(path: Path, data: Data) -> FlightLog:
    """Raises RecordingError when no vehicle was recorded."""
    recording = Recording(path.name, data)
    parts = _Parts(recording.mono_minus_utc_s)
    for entry in recording.entries(_READ):
        message = entry.message
        if isinstance(message, VehicleState):
            parts.on_state(message, entry.t_utc_s)
        elif isinstance(message, RawFrame):
            if not message.spare:
                parts.on_frame(message)
        elif isinstance(message, VehicleText):
            parts.texts.append(message)
        elif isinstance(message, CommandRecord):
            parts.commands.append(message)
        elif isinstance(message, PlanRecord):
            parts.plans.append(message)
        elif isinstance(message, ChecklistRecord):
            parts.on_checklist(message, recording.start_utc_s)
        elif isinstance(message, ObstacleAlert) and message.phase != "goes_on":
            parts.alerts.append(message)
        elif isinstance(message, AvoidanceStatus):
            parts.on_avoidance(message, entry.t_utc_s)
        elif isinstance(message, PerceptionSettings):
            parts.on_settings(message, entry.t_utc_s)
    return _flight_log(recording, parts)


def _flight_log(recording: Recording, parts: _Parts) -> FlightLog:
    history, facts = parts.history, parts.facts
    if history.last is None or facts is None:
        what = "The recording holds no vehicle: none was connected while it ran."
        raise RecordingError(what, where=recording.name, advice="Choose another recording.")
    home, faults = history.home(), list(recording.faults)
    plan = _plan_flown(parts)
    positions = parts.positions()
    if not positions:
        faults.append("The recording holds no position of the vehicle.")
    ground = _ground(recording, faults)
    return FlightLog(
        kind="hedgehop",
        name=recording.name,
        start_utc_s=recording.start_utc_s,
        end_utc_s=recording.end_utc_s,
        states=tuple(positions),
        track=track_of(positions),
        truth=truth_of(facts.truth, home),
        texts=tuple(parts.texts),
        modes=tuple(history.modes),
        armed=tuple(history.armed),
        reached=tuple(facts.reached or history.reached),
        targets=tuple(facts.targets),
        commands=tuple(parts.commands),
        vehicle=history.last,
        home=home,
        mission=_mission(plan, faults) or mission_flown(facts, history),
        plan=plan,
        faults=tuple(faults),
        alerts=tuple(parts.alerts),
        avoidance=tuple(parts.avoidance),
        settings=tuple(parts.settings),
        checklist=parts.checklist,
        ground=ground,
    )


def _ground(recording: Recording, faults: list[str]) -> Dsm | None:
    try:
        return carried_ground(recording)
    except RecordingError as error:
        faults.append(f"{error.what} {error.advice}")
        return None


def _plan_flown(parts: _Parts) -> PlanRecord | None:
    """The last one that was active before the vehicle left the mission for good; later ones are for the next flight."""
    until = parts.history.mission_flown_until_utc_s()
    earlier = [plan for plan in parts.plans if plan.t_utc_s <= until]
    return earlier[-1] if earlier else next(iter(parts.plans), None)


def _mission(plan: PlanRecord | None, faults: list[str]) -> Mission | None:
    if plan is None or not plan.mission_wpl:
        return None
    try:
        return read_wpl(plan.mission_wpl, plan.name)
    except FormatError as error:
        faults.append(f"The plan in the recording cannot be read: {error.what}")
        return None
