"""What single MAVLink frames tell beyond the vehicle's state: missions, reached items, targets, simulators' truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.texts.speech import EVENT_KINDS, Speech
from telemetry.recording.mission_frames import MissionFrames
from telemetry.recording.tlog import frame_address
from telemetry.topics.messages import VehicleText

SAYING = EVENT_KINDS | {"STATUSTEXT"}
_NO_POSITION = 0b111
"""Of POSITION_TARGET_TYPEMASK: none of x, y, z is to be used."""


@dataclass(frozen=True, slots=True)
class SentTarget:
    """One SET_POSITION_TARGET_GLOBAL_INT that a ground station sent."""

    t_utc_s: float
    lat_deg: float
    lon_deg: float
    alt_m: float
    frame: int


@dataclass(frozen=True, slots=True)
class TruePosition:
    """Where a simulator says the vehicle really is (SIM_STATE)."""

    t_utc_s: float
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


class FrameFacts:
    """Collects, frame by frame, from one vehicle and from the ground stations that talk to it."""

    def __init__(self, system_id: int, component_id: int) -> None:
        self.vehicle = (system_id, component_id)
        self.missions = MissionFrames(self.vehicle)
        self.reached: list[tuple[float, int]] = []
        self.targets: list[SentTarget] = []
        self.truth: list[TruePosition] = []
        self._texts: list[VehicleText] = []
        self._speech, self._last_text_s = Speech(self.vehicle), 0.0

    def on_message(self, message: Any, t_utc_s: float) -> None:
        """``message``: any pymavlink message object; those of other vehicles are left out."""
        source, kind = (message.get_srcSystem(), message.get_srcComponent()), message.get_type()
        if kind.startswith("MISSION_"):
            self.missions.on_message(message, t_utc_s)
        if source == self.vehicle:
            self._from_vehicle(message, kind, t_utc_s)
        elif kind == "SET_POSITION_TARGET_GLOBAL_INT" and message.target_system == self.vehicle[0]:
            self._target(message, t_utc_s)

    def texts(self) -> list[VehicleText]:
        """All texts, those of which the last part never came too."""
        self._add_texts(self._speech.on_tick(math.inf).texts, self._last_text_s)
        return self._texts

    def _from_vehicle(self, message: Any, kind: str, t_utc_s: float) -> None:
        self._add_texts(self._speech.on_tick(t_utc_s).texts, t_utc_s)
        if kind == "MISSION_ITEM_REACHED":
            self.reached.append((t_utc_s, message.seq))
        elif kind in SAYING:
            self._add_texts(self._speech.on_message(message, t_utc_s).texts, t_utc_s)
        elif kind == "SIM_STATE" and (place := _true_place(message)) is not None:
            self.truth.append(TruePosition(t_utc_s, *place, message.alt))

    def _add_texts(self, texts: tuple[tuple[int, str], ...], t_utc_s: float) -> None:
        self._last_text_s = t_utc_s
        self._texts += [VehicleText(t_utc_s, severity, text) for severity, text in texts]

    def _target(self, message: Any, t_utc_s: float) -> None:
        if message.type_mask & _NO_POSITION == 0:
            lat_deg, lon_deg = message.lat_int / 1e7, message.lon_int / 1e7
            self.targets.append(SentTarget(t_utc_s, lat_deg, lon_deg, message.alt, message.coordinate_frame))


def _true_place(message: Any) -> tuple[float, float] | None:
    """ArduPilot 4.7 holds degrees times 1e7 in the floats as well, too coarse to use; the integers are extensions."""
    if message.lat_int or message.lon_int:
        return message.lat_int / 1e7, message.lon_int / 1e7
    known = abs(message.lat) <= 90 and abs(message.lon) <= 180 and (message.lat or message.lon)
    return (message.lat, message.lon) if known and math.isfinite(message.alt) else None


def decode_frame(decoder: mavlink.MAVLink, frame: bytes) -> Any | None:
    """A whole frame as a pymavlink message; None for messages of unknown type and for damaged ones."""
    if frame_address(frame)[0] not in mavlink.mavlink_map:
        return None
    try:
        return decoder.decode(bytearray(frame))
    except mavlink.MAVError:
        return None
