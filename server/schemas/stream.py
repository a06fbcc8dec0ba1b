"""The ``/ws`` stream: every message has ``v`` and ``type``. First a snapshot, then whatever changed."""

from __future__ import annotations

from typing import Annotated, Literal, Protocol

from pydantic import Field

from server.schemas.account_docs import LeaseDoc, MeDoc
from server.schemas.flight_docs import FlyState, FollowDoc, NodeDoc, RecordingDoc, Source, TrackDoc
from server.schemas.guided_docs import GuidedState
from server.schemas.home_docs import HomeState
from server.schemas.library_docs import JobDoc, LibraryState
from server.schemas.obstacle_docs import ObstaclesState, SensorName
from server.schemas.result_docs import ErrorDoc, PlanState
from server.schemas.review_docs import ReviewDoc
from server.schemas.station_docs import AlarmDoc, OtherStationDoc, RecordingFetchDoc, StationRecordingsDoc, VehicleDoc
from server.schemas.strict_model import Message
from server.schemas.study_docs import RadarFileDoc, ScenarioRunDoc
from server.schemas.traversability_docs import TraversabilityState
from server.schemas.view_docs import SelectionDoc, ViewDoc
from telemetry.flight.health import HealthRow
from telemetry.topics.messages import (
    FlightStatus,
    LinkStatus,
    RecorderStatus,
    ReplayStatus,
    TransferStatus,
    VehicleText,
)
from telemetry.topics.obstacles import ObstacleAlert, PerceptionStatus
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.traffic import TrafficSettings, TrafficStatus
from telemetry.topics.vehicle import VehicleState


class Snapshot(Message):
    type: Literal["snapshot"] = "snapshot"
    product_version: str
    page_id: str
    """Names this page's 3D view: its address is ``/view/{page_id}/``."""
    plan: PlanState
    library: LibraryState
    view: ViewDoc
    selection: SelectionDoc
    jobs: list[JobDoc]


class PlanMessage(Message):
    type: Literal["plan"] = "plan"
    plan: PlanState


class LibraryMessage(Message):
    type: Literal["library"] = "library"
    library: LibraryState


class ViewMessage(Message):
    type: Literal["view"] = "view"
    view: ViewDoc


class SelectionMessage(Message):
    type: Literal["selection"] = "selection"
    selection: SelectionDoc


class AnsweredMessage(Message):
    """Every change that this page asked for up to this one is carried out, or refused with a notice."""

    type: Literal["answered"] = "answered"
    change: int


class ActiveMessage(Message):
    """The vehicle that this page shows and commands from now on; all that is known of it follows at once."""

    type: Literal["active"] = "active"
    vehicle: int


class FleetMessage(Message):
    """All vehicles of a station that has several, some times a second."""

    type: Literal["fleet"] = "fleet"
    vehicles: list[VehicleDoc]


class StationsMessage(Message):
    """Other stations and their vehicles, twice a second, where this station meets them at a router."""

    type: Literal["stations"] = "stations"
    now_mono_s: float
    """The server's clock, from which the ages in it count."""
    old_s: float
    """A position that is older is shown as old."""
    station: str
    """This one's name."""
    router: Literal["connected", "lost"]
    text: str
    """What is wrong with the way to them, and what to do; empty: nothing."""
    stations: list[OtherStationDoc]
    refused: int
    """Messages that were malformed, foreign or repeated."""


class StationRecordingsMessage(Message):
    """Recordings of other stations, when a list of them has changed: they are long."""

    type: Literal["station_recordings"] = "station_recordings"
    stations: list[StationRecordingsDoc]


class StationFetchesMessage(Message):
    """What is fetched of them: what is new at once, how far it is every two seconds."""

    type: Literal["station_fetches"] = "station_fetches"
    fetches: list[RecordingFetchDoc]


class ClockMessage(Message):
    """The answer to a page's ping: what the page said its clock is, and the clock of all ``t_mono_s`` when it came."""

    type: Literal["clock"] = "clock"
    page_ms: float
    now_mono_s: float


class JobMessage(Message):
    type: Literal["job"] = "job"
    job: JobDoc


class CursorMessage(Message):
    """The place marked in profile and 3D view at once."""

    type: Literal["cursor"] = "cursor"
    s_m: float | None
    lat_deg: float | None = None
    lon_deg: float | None = None
    ground_rel_home_m: float | None = None
    path_rel_home_m: float | None = None


class VehicleMessage(Message):
    """The vehicle as it is now, at most 20 times a second; once a second when nothing is heard of it."""

    type: Literal["vehicle"] = "vehicle"
    source: Source
    now_mono_s: float
    """The clock of the state's ``..._t_mono_s``: their difference is a value's age."""
    state: VehicleState | None
    follow: FollowDoc | None


class HealthMessage(Message):
    """How the vehicle is, by its own account, in the words of ``telemetry.flight.health``; empty: no vehicle."""

    type: Literal["health"] = "health"
    source: Source
    rows: list[HealthRow]


class TrackMessage(Message):
    """Replaces the flown path: after a seek, or when another flight begins."""

    type: Literal["track"] = "track"
    track: TrackDoc


class TextMessage(Message):
    """The vehicle's own words."""

    type: Literal["text"] = "text"
    source: Source
    text: VehicleText


class LinkMessage(Message):
    type: Literal["link"] = "link"
    link: LinkStatus


class TransferMessage(Message):
    type: Literal["transfer"] = "transfer"
    transfer: TransferStatus


class FlightMessage(Message):
    type: Literal["flight"] = "flight"
    source: Source
    flight: FlightStatus


class FlyMessage(Message):
    type: Literal["fly"] = "fly"
    fly: FlyState


class GuidedMessage(Message):
    """The guided way that is judged or flown."""

    type: Literal["guided"] = "guided"
    guided: GuidedState


class HomeMessage(Message):
    """Home that is to be set, and the vehicle's own return since it was moved."""

    type: Literal["home"] = "home"
    home: HomeState


class LeaseMessage(Message):
    type: Literal["lease"] = "lease"
    lease: LeaseDoc


class MeMessage(Message):
    """Right after the snapshot."""

    type: Literal["me"] = "me"
    me: MeDoc


class NodesMessage(Message):
    type: Literal["nodes"] = "nodes"
    nodes: list[NodeDoc]


class RecorderMessage(Message):
    type: Literal["recorder"] = "recorder"
    recorder: RecorderStatus


class RecordingsMessage(Message):
    type: Literal["recordings"] = "recordings"
    recordings: list[RecordingDoc]


class ReviewMessage(Message):
    """The recording that is open for review; null: none."""

    type: Literal["review"] = "review"
    review: ReviewDoc | None


class ReplayMessage(Message):
    type: Literal["replay"] = "replay"
    now_mono_s: float
    replay: ReplayStatus


class PerceptionMessage(Message):
    """One sensor's status: with every frame of it, at most 10 times a second; null: forget this sensor."""

    type: Literal["perception"] = "perception"
    source: Source
    now_mono_s: float
    """The clock of the status's ``..._t_mono_s``."""
    sensor: SensorName
    status: PerceptionStatus | None


class AlertMessage(Message):
    """An alert begins, goes on or ends: at once, before the obstacles message that lists it."""

    type: Literal["alert"] = "alert"
    source: Source
    alert: ObstacleAlert


class ObstaclesMessage(Message):
    type: Literal["obstacles"] = "obstacles"
    source: Source
    obstacles: ObstaclesState


class TracksMessage(Message):
    """Moving objects: with every radar frame, at most 10 times a second; null: forget them."""

    type: Literal["tracks"] = "tracks"
    source: Source
    now_mono_s: float
    status: TracksStatus | None


class TrafficMessage(Message):
    """Other aircraft: once a second, and when a setting changes; null: nothing was heard of any yet."""

    type: Literal["traffic"] = "traffic"
    source: Source
    now_mono_s: float
    settings: TrafficSettings
    status: TrafficStatus | None


class TraversabilityMessage(Message):
    """What is known of where ground can be driven on or landed on."""

    type: Literal["traversability"] = "traversability"
    traversability: TraversabilityState


class RadarFilesMessage(Message):
    """Files of raw radar samples that are kept, newest first."""

    type: Literal["radar_files"] = "radar_files"
    files: list[RadarFileDoc]


class ScenarioRunsMessage(Message):
    """The scenario that runs, and those that were run, newest first."""

    type: Literal["scenario_runs"] = "scenario_runs"
    runs: list[ScenarioRunDoc]


class NoticeMessage(Message):
    """Something the operator must read: a failed click, a warning."""

    type: Literal["notice"] = "notice"
    level: Literal["info", "warning", "error"]
    error: ErrorDoc


class AlarmsMessage(Message):
    """All that is wrong with the station itself."""

    type: Literal["alarms"] = "alarms"
    alarms: list[AlarmDoc]


ServerMessage = Annotated[
    Snapshot
    | ActiveMessage
    | AlarmsMessage
    | FleetMessage
    | StationsMessage
    | StationRecordingsMessage
    | StationFetchesMessage
    | PlanMessage
    | LibraryMessage
    | ViewMessage
    | SelectionMessage
    | AnsweredMessage
    | ClockMessage
    | JobMessage
    | CursorMessage
    | VehicleMessage
    | TrackMessage
    | TextMessage
    | LinkMessage
    | TransferMessage
    | FlightMessage
    | FlyMessage
    | GuidedMessage
    | HomeMessage
    | LeaseMessage
    | MeMessage
    | HealthMessage
    | NodesMessage
    | RecorderMessage
    | RecordingsMessage
    | ReviewMessage
    | ReplayMessage
    | PerceptionMessage
    | AlertMessage
    | ObstaclesMessage
    | TracksMessage
    | TrafficMessage
    | TraversabilityMessage
    | RadarFilesMessage
    | ScenarioRunsMessage
    | NoticeMessage,
    Field(discriminator="type"),
]


class Pages(Protocol):
    """Whoever tells all pages: the hub itself, or what also keeps the latest for pages that open later."""

    def publish(self, message: ServerMessage) -> None: ...
