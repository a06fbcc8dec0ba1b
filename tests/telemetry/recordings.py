"""Recordings and logs as tests need them: short made-up flights, written by the real writer."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Home, Mission, MissionItem
from planning.formats.wpl import write_wpl
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.player import Player
from telemetry.recording.replay_sources import open_source
from telemetry.topics.messages import (
    CommandRecord,
    FlightStatus,
    LinkStatus,
    PlanRecord,
    Published,
    RawFrame,
    Topic,
    VehicleText,
)
from telemetry.topics.vehicle import VehicleState

T0_UTC_S = 1_700_000_000.0
T0_MONO_S = 500.0
HOME = (45.0, 10.0, 120.0)
MISSION = Mission(
    Home(*HOME),
    (MissionItem(22, 3, alt_m=10.0), MissionItem(16, 3, lat_deg=45.001, lon_deg=10.0, alt_m=20.0), MissionItem(20, 2)),
)
PLAN = PlanRecord(
    t_utc_s=T0_UTC_S,
    name="Alpine meadow",
    mission_wpl=write_wpl(MISSION),
    digest="d" * 64,
    firmware="ardupilot",
    terrain_id="t1",
    terrain_name="Meadow",
    terrain_sha256="a" * 64,
    home_alt_dsm_m=None,
    vertical_datum=None,
    profile_toml="",
    certificate_json="",
)
STATE = VehicleState(
    system_id=1,
    component_id=1,
    autopilot="ardupilot",
    vehicle_type=2,
    firmware_version="4.6.0",
    mode="STABILIZE",
    home_lat_deg=HOME[0],
    home_lon_deg=HOME[1],
    home_alt_amsl_m=HOME[2],
)


def state_at(t_s: float, *, armed: bool = True, mode: str = "AUTO") -> VehicleState:
    """A vehicle that flies north; ``t_s`` since the recording's begin."""
    t_mono_s = T0_MONO_S + t_s
    return replace(
        STATE,
        t_utc_s=T0_UTC_S + t_s,
        heartbeat_t_mono_s=t_mono_s,
        position_t_mono_s=t_mono_s,
        attitude_t_mono_s=t_mono_s,
        lat_deg=HOME[0] + t_s * 1e-5,
        lon_deg=HOME[1],
        alt_amsl_m=HOME[2] + 10.0,
        alt_rel_home_m=10.0,
        heading_rad=0.0,
        armed=armed,
        mode=mode,
    )


def flight(seconds: float = 20.0, rate_hz: float = 10.0) -> Iterator[tuple[float, str, Published]]:
    """(time since the begin, topic, message) of a flight from arming to disarming."""
    yield 0.0, Topic.PLAN, PLAN
    yield 0.0, Topic.LINK, LinkStatus(t_mono_s=T0_MONO_S)
    yield 0.0, Topic.COMMAND, CommandRecord(T0_UTC_S, "operator", "start the mission")
    count = round(seconds * rate_hz)
    for number in range(count + 1):
        t_s = number / rate_hz
        in_air = 0 < number < count
        yield t_s, Topic.RAW, RawFrame(T0_UTC_S + t_s, False, "udpin:127.0.0.1:14550", heartbeat(number))
        yield t_s, Topic.VEHICLE, state_at(t_s, armed=in_air, mode="AUTO" if in_air else "STABILIZE")
        if number == count // 2:
            yield t_s, Topic.TEXT, VehicleText(T0_UTC_S + t_s, 6, "Half of it flown")
            yield t_s, Topic.FLIGHT, FlightStatus(way="auto", phase="flying", target=2, targets=3)


def heartbeat(sequence: int) -> bytes:
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    link.seq = sequence % 256
    return bytes(link.heartbeat_encode(2, 3, 1, 3, 4).pack(link))


def write_flight(path: Path, *, finish: bool = True, seconds: float = 20.0, rate_hz: float = 10.0) -> Path:
    """``finish`` False: as a killed recorder leaves it."""
    clock = [0.0]
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name="by hand", now=lambda: clock[0])
    for t_s, topic, message in flight(seconds, rate_hz):
        clock[0] = t_s
        writer.write(topic, message, T0_UTC_S + t_s)
    if finish:
        writer.close()
    else:
        writer.commit()
        writer.abandon()
    return path


def tlog_record(t_utc_s: float, frame: bytes) -> bytes:
    return round(t_utc_s * 1e6).to_bytes(8, "big") + frame


@contextlib.contextmanager
def opened(path: Path, now_s: float) -> Iterator[Player]:
    """A player that has read what there is at the recording's beginning."""
    player = Player(open_source(path), now_s)
    player.open(now_s)
    yield player
    player.close()
