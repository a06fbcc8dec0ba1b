"""The station itself: what is wrong with it, how it is, and its log of commands."""

from __future__ import annotations

from typing import Literal

from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Strict

FIRST_VEHICLE = 1
"""The number of the vehicle that a station with only one has."""


class VehicleAlarm(Strict):
    """The worst of what is wrong with one vehicle, for pages that show another one."""

    kind: Literal["loss", "near", "alert"]
    """loss: nothing reaches it, or nothing is heard of it; near: another one is, which has the same alarm."""
    key: str
    """Another key is another alarm: who has seen the one has not seen the other."""
    text: str


class VehicleDoc(Strict):
    """One of several vehicles, as every page is told of it; null where nothing is known."""

    number: int
    name: str
    lat_deg: float | None = None
    lon_deg: float | None = None
    alt_rel_home_m: float | None = None
    ground_speed_m_s: float | None = None
    mode: str = ""
    phase: str = "idle"
    """As in the flight message."""
    armed: bool = False
    link: Literal["none", "live", "stale", "lost"] = "none"
    silent_s: float | None = None
    battery_share: float | None = None
    holder: str | None = None
    """Who is in charge of it."""
    plan_name: str = ""
    """Of the plan on board, where it came from here."""
    alarm: VehicleAlarm | None = None


class AlarmDoc(Strict):
    """Stands on every page until it is over, or until somebody has read it."""

    kind: Literal["disk", "audit", "certificate", "restart", "stations"]
    level: Literal["warning", "error"]
    began_utc_s: float
    error: ErrorDoc


class AuditEntryDoc(Strict):
    """A command, or what came of it."""

    t_utc_s: float | None
    operator: str
    words: str
    result: str
    """Empty: written down before it was sent."""


class AuditDoc(Strict):
    """The log of commands, and whether it is as it was written."""

    state: Literal["none", "whole", "broken"]
    """none: no command was given yet."""
    verdict: list[str]
    """One sentence each, the most important first."""
    lines: int
    checked_utc_s: float | None
    newest: list[AuditEntryDoc]
    """The newest first."""


class LoopDoc(Strict):
    """How late the server's loop came round: for so long messages of vehicles waited in it."""

    p99_ms: float
    """Of the last ten minutes at most."""
    longest_ms: float
    longest_utc: str
    since_utc: str
    longest_work_ms: float
    """Of the processor's time that the loop took for itself at once: not above 20, however busy the machine is."""


class HealthDoc(Strict):
    """Without a session only status and version."""

    status: Literal["ok"] = "ok"
    version: str
    loop: LoopDoc | None = None
    confinement: str | None = None
    """What is refused to workers and to decoders of rasters on this machine."""


class OtherVehicleDoc(Strict):
    """A vehicle of another station, which only that one commands; null where nothing is known."""

    number: int
    name: str
    age_s: float | None = None
    """Of its position, at the worse end; null: it has none, or its station's clock was not compared yet."""
    is_old: bool = True
    lat_deg: float | None = None
    lon_deg: float | None = None
    alt_rel_home_m: float | None = None
    alt_amsl_m: float | None = None
    alt_surface_m: float | None = None
    ground_speed_m_s: float | None = None
    in_charge: str = ""
    """Who commands it at its own station; empty: nobody."""
    in_charge_silent: bool = False
    """Nothing is heard of them there."""
    mode: str = ""
    phase: str = "idle"
    """As in the flight message."""
    armed: bool = False
    in_air: bool = False
    link: Literal["none", "live", "stale", "lost"] = "none"
    battery_share: float | None = None
    battery: str = ""
    """In words, with the time that is left."""
    plan: str = ""
    plan_share: float | None = None
    text: str = ""
    """What is wrong with it, or with what is known of it."""


class RecordingThereDoc(Strict):
    """Of another station, as that one tells of it."""

    sha256: str
    name: str
    bytes: int
    started_utc: str | None
    duration_s: float | None
    vehicle: str = ""
    plan_name: str = ""
    recording_id: str | None = None
    """Once it was fetched: here."""


class StationRecordingsDoc(Strict):
    name: str
    state: Literal["live", "lost"]
    listed: Literal["no", "asking", "listed", "silent", "off"]
    """no: it was not asked yet; silent: it does not answer; off: it offers none."""
    age_s: float | None
    """Of the list; null: none has come."""
    text: str = ""
    """What is wrong with the list or missing in it, and what to do."""
    recordings: list[RecordingThereDoc]
    """Newest first; the last that were listed, while it is lost or asked anew."""


class RecordingFetchDoc(Strict):
    """A recording that is being fetched, or could not be."""

    station: str
    sha256: str
    name: str
    bytes: int
    have_bytes: int
    state: Literal["waiting", "fetching", "checking", "whole", "failed"]
    """waiting: for its station, or for those before it; checking: its SHA-256 is computed; whole: it is opened."""
    left_s: float | None
    """At the pace of the last ten seconds."""
    text: str = ""
    """Why it waits or failed, and what to do."""


class RecordingsThereDoc(Strict):
    """Recordings of other stations, and what is fetched of them."""

    now_mono_s: float
    """The server's clock, from which the ages in it count."""
    is_offered: bool
    """This station's own are offered to the others."""
    kb_s: int
    """So much of them comes in a second at most."""
    stations: list[StationRecordingsDoc]
    fetches: list[RecordingFetchDoc]


class OtherStationDoc(Strict):
    name: str
    state: Literal["live", "lost"]
    silent_s: float
    round_trip_s: float | None = None
    clock_ahead_s: float | None = None
    text: str = ""
    """What is wrong and what to do."""
    vehicles: list[OtherVehicleDoc]
