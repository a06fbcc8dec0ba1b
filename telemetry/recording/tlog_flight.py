"""The telemetry log of any ground station -> a flight log."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Home, Mission
from telemetry.errors import RecordingError
from telemetry.mavlink.reduce import reduce
from telemetry.recording.frame_facts import FrameFacts, decode_frame
from telemetry.recording.mission_frames import mission_of
from telemetry.recording.recorded_flight import FlightLog, StateHistory, track_of, truth_of
from telemetry.recording.tlog import Damage, Data, LogFrame, tlog_frames
from telemetry.topics.vehicle import VehicleState

_HEARTBEAT, _GLOBAL_POSITION = 0, 33
_FIRST_LOOK_BYTES = 1 << 20
_EXAMPLE_BYTES = 1 << 16


@dataclass(slots=True)
class Vehicles:
    """What a first pass over a log finds: who sent how many positions, and the damage."""

    positions: Counter[tuple[int, int]]
    autopilots: Counter[tuple[int, int]]
    frames: int
    start_utc_s: float
    end_utc_s: float
    damage: Damage

    def chosen(self, where: str) -> tuple[int, int]:
        """The autopilot with the most positions; of those without any, the one with the most heartbeats.

        Raises RecordingError when there is none.
        """
        known = Counter({v: n for v, n in self.positions.items() if v in self.autopilots})
        ranking = (known or self.positions or self.autopilots).most_common(1)
        if not ranking:
            what = f"The log holds {self.frames} MAVLink messages, but none of an autopilot."
            raise RecordingError(what, where=where, advice="Choose the log of a flight.")
        return ranking[0][0]


def survey(data: Data) -> Vehicles:
    """A first pass: no message is decoded but heartbeats."""
    seen = Vehicles(Counter(), Counter(), 0, math.inf, -math.inf, Damage())
    decoder = mavlink.MAVLink(None)
    for entry in tlog_frames(data, seen.damage):
        seen.frames += 1
        seen.start_utc_s = min(seen.start_utc_s, entry.t_utc_s)
        seen.end_utc_s = max(seen.end_utc_s, entry.t_utc_s)
        address = (entry.system_id, entry.component_id)
        if entry.message_id == _GLOBAL_POSITION:
            seen.positions[address] += 1
        elif entry.message_id == _HEARTBEAT and _of_autopilot(decoder, entry):
            seen.autopilots[address] += 1
    return seen


def _of_autopilot(decoder: mavlink.MAVLink, entry: LogFrame) -> bool:
    message = decode_frame(decoder, entry.frame)
    return message is not None and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID


def looks_like_tlog(data: Data) -> bool:
    """Whether the beginning holds timed MAVLink frames; a log may begin with rubbish, but not with a megabyte of it."""
    head, damage = data[:_FIRST_LOOK_BYTES], Damage()
    found, good_bytes = 0, 0
    for entry in tlog_frames(head, damage):
        found, good_bytes = found + 1, good_bytes + len(entry.frame)
        if good_bytes > _EXAMPLE_BYTES:
            return True
    return found > 0 and good_bytes >= damage.bytes / 50


def read_tlog_flight(path: Path, data: Data) -> FlightLog:
    """Raises RecordingError when no autopilot speaks in the log."""
    seen = survey(data)
    vehicle = seen.chosen(path.name)
    history, facts = _second_pass(data, vehicle)
    home = history.home()
    return FlightLog(
        kind="tlog",
        name=path.name,
        start_utc_s=seen.start_utc_s,
        end_utc_s=seen.end_utc_s,
        states=tuple(history.positions),
        track=track_of(history.positions),
        truth=truth_of(facts.truth, home),
        texts=tuple(facts.texts()),
        modes=tuple(history.modes),
        armed=tuple(history.armed),
        reached=tuple(facts.reached),
        targets=tuple(facts.targets),
        commands=(),
        vehicle=history.last or VehicleState(*vehicle),
        home=home,
        mission=mission_flown(facts, history),
        plan=None,
        faults=_faults(seen, vehicle, history, len(data)),
    )


def _second_pass(data: Data, vehicle: tuple[int, int]) -> tuple[StateHistory, FrameFacts]:
    history, facts = StateHistory(), FrameFacts(*vehicle)
    for state, t_utc_s in states_of(data, vehicle, facts):
        history.on_state(state, t_utc_s)
    return history, facts


def states_of(data: Data, vehicle: tuple[int, int], facts: FrameFacts) -> Iterator[tuple[VehicleState, float]]:
    """Every change of what is known of the vehicle, with its time; the log's clock stands for the monotonic one."""
    decoder = mavlink.MAVLink(None)
    state = VehicleState(*vehicle)
    for entry in tlog_frames(data):
        message = decode_frame(decoder, entry.frame)
        if message is None:
            continue
        facts.on_message(message, entry.t_utc_s)
        changed = reduce(state, message, t_mono_s=entry.t_utc_s, t_utc_s=entry.t_utc_s)
        if changed is not None and changed is not state:
            state = changed
            yield state, entry.t_utc_s


def mission_flown(facts: FrameFacts, history: StateHistory) -> Mission | None:
    """Of all whole missions in the log the one that was on board when a mission was last flown."""
    until = history.mission_flown_until_utc_s()
    transfer = facts.missions.newest(until if math.isfinite(until) else math.inf)
    if transfer is None or history.last is None:
        return None
    home = history.home()
    reported = Home(home.lat_deg, home.lon_deg, home.alt_amsl_m or math.nan) if home else None
    return mission_of(transfer, "px4" if history.last.autopilot == "px4" else "ardupilot", reported)


def _faults(seen: Vehicles, vehicle: tuple[int, int], history: StateHistory, size: int) -> tuple[str, ...]:
    faults = seen.damage.words(size)
    others = sorted(v for v in {*seen.positions, *seen.autopilots} if v != vehicle)
    if others:
        names = ", ".join(f"{system}/{component}" for system, component in others)
        faults.append(f"Vehicle {vehicle[0]}/{vehicle[1]} is shown; the log also holds {names}.")
    if not history.positions:
        faults.append("The log holds no position of the vehicle.")
    return tuple(faults)
