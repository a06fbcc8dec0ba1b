"""A flying desk on a link that answers as a vehicle does."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np

from planning.fence.fence_model import RallyPoint
from planning.formats.fence_items import rally_items
from server.flying.checklist_desk import ChecklistDesk
from server.flying.checklists import Checklists
from server.flying.flight_desk import FlightDesk
from server.flying.in_flight.take_up_desk import TakingUp
from server.flying.work import FlightWork
from server.heard.onboard import Aboard
from server.library import Library
from server.obstacles.obstacle_watch import Watch
from server.plan import demo, tasks
from server.plan.file_tasks import make_demo_terrain
from server.schemas import Computation, FlyState, PlanDoc, PlanState, ServerMessage
from server.work.jobs import Lane
from telemetry.errors import SilentError, TransferError
from telemetry.mavlink.items import wire_items
from telemetry.mavlink.verify import as_stored, compare, digest
from telemetry.topics.checklist import ChecklistRecord
from telemetry.topics.messages import Candidate, FlightStatus, LinkStatus, PlanRecord, Topic
from telemetry.topics.onboard_lists import Item, OnboardMission, UploadReport
from telemetry.topics.requests import Download, DownloadPlaces, Operator, ReadParameters, Upload, UploadPlaces
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told

ME = Operator("Anna", 7)


class Vehicle:
    """Behind the link: stores what it gets as ArduPilot does, and remembers what it was told to do."""

    def __init__(self) -> None:
        self.items: tuple[Any, ...] = ()
        self.told: list[Any] = []
        self.swaps_two_items = self.drops_fences = self.answers_no_download = False
        self.breaks_off: Literal["", "keeps", "mixes"] = ""
        """An upload in flight; and what is on board then."""
        self.places: dict[str, tuple[Any, ...]] = {"fence": (), "rally": ()}
        self.parameters: dict[str, float] = {"RTL_ALT": 6000.0}

    async def call(self, request: Any) -> Any:
        if isinstance(request, Upload) and request.while_holding and self.breaks_off:
            self.items = self.items[:3] if self.breaks_off == "mixes" else self.items
            raise TransferError("The upload broke off at item 3.", advice="Try again.")
        if isinstance(request, Download) and self.answers_no_download:
            raise SilentError("The vehicle does not answer.", advice="Look at the link.")
        if isinstance(request, Upload):
            self.items = as_stored(request.items, "ardupilot")
            if self.swaps_two_items:
                self.items = (self.items[0], self.items[2], self.items[1], *self.items[3:])
            rounded, differences = compare(request.items, self.items)
            return UploadReport(not differences, self._onboard(), rounded, differences, 0.1)
        if isinstance(request, UploadPlaces):
            self.places[request.kind] = kept = as_stored(request.items, "ardupilot")
            if self.drops_fences:
                self.places[request.kind] = kept = kept[:-1]
            rounded, differences = compare(request.items, kept)
            return UploadReport(not differences, self._onboard(), rounded, differences, 0.1)
        if isinstance(request, DownloadPlaces):
            return self.places[request.kind]
        if isinstance(request, Download):
            return self._onboard()
        if isinstance(request, ReadParameters):
            return {name: self.parameters.get(name) for name in request.names}
        self.told.append(request)
        return None

    def _onboard(self) -> OnboardMission:
        return OnboardMission(self.items, 0.0, 0.0, 0.0, digest(self.items))


QUAD = Candidate("udp/1/1", "udpin:127.0.0.1:14550", "127.0.0.1:9", 1, 1, "ardupilot", 2)


class Made:
    """A library with the demo's surface model and its plan, computed once."""

    def __init__(self, root: Path) -> None:
        self.library = Library(root)
        make_demo_terrain(root, demo.TERRAIN_NAME, report=lambda step, share: None)
        self.library.refresh()
        terrain = self.library.terrains()[0]
        plan_id = demo.ensure_plan(self.library, terrain)
        self.document = self.library.load_plan(plan_id).present
        directory = self.library.terrain_dir(terrain.id)
        result, _ = tasks.compute_plan(directory, self.document, report=lambda step, share: None)
        self.computation = Computation(revision=3, state="ready", result=result)

    def plan(self, **changes: Any) -> PlanState:
        return PlanState(
            plan_id="p",
            revision=3,
            document=self.document,
            can_undo=False,
            can_redo=False,
            saved_utc="",
            computation=self.computation.model_copy(update=changes),
        )

    @property
    def home(self) -> tuple[float, float]:
        return self.document.pois[0].lat_deg, self.document.pois[0].lon_deg

    def rally(self, *, east_m: float = 0.0, north_m: float = 0.0) -> tuple[Item, ...]:
        """One rally point, so far from the plan's home, as the vehicle holds it."""
        there = self.standing(east_m=east_m, north_m=north_m)
        assert there.lat_deg is not None
        assert there.lon_deg is not None
        return wire_items(rally_items([RallyPoint(there.lat_deg, there.lon_deg, 40.0)], "ardupilot"))

    def standing(self, *, east_m: float = 0.0, north_m: float = 0.0) -> VehicleState:
        """Disarmed and ready, so far from the plan's home."""
        dsm = self.library.load_terrain(self.library.terrains()[0].id)
        xy_m = dsm.xy_from_lat_lon(np.array([self.home])) + np.array([[east_m, north_m]])
        lat_deg, lon_deg = dsm.lat_lon_from_xy(xy_m)[0].tolist()
        return VehicleState(
            1,
            1,
            autopilot="ardupilot",
            landed="on_ground",
            ready_to_arm=True,
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            alt_amsl_m=float(dsm.elevation_at(xy_m)[0]),
            alt_rel_home_m=0.0,
            home_lat_deg=lat_deg,
            home_lon_deg=lon_deg,
            home_alt_amsl_m=float(dsm.elevation_at(xy_m)[0]),
            gnss_fix="rtk_fixed",
            gnss_t_mono_s=0.0,
            horizontal_accuracy_m=0.02,
            battery_share=1.0,
        )


class Live:
    """What is heard; in flight its positions are of now."""

    def __init__(self, state: VehicleState | None) -> None:
        self._state = state
        self.track = SimpleNamespace(states=[])
        self.flight = FlightStatus(way="auto", phase="paused")

    @property
    def state(self) -> Any:
        if self._state is None or not self._state.armed:
            return self._state
        now_s = time.monotonic()
        return replace(self._state, position_t_mono_s=now_s, gnss_t_mono_s=now_s)

    @state.setter
    def state(self, state: VehicleState | None) -> None:
        self._state = state


class Bench:
    """Stands for all that hangs on the desk, but for the vehicle."""

    def __init__(self, made: Made, file: Path, lanes: tuple[Lane, Lane], *, is_alone: bool = True) -> None:
        self.made, self.vehicle, self.plan = made, Vehicle(), made.plan()
        self.plan_lane = lanes[0]
        self.live = Live(made.standing())
        self.watch = Watch("live", Told())
        self.told: list[FlyState] = []
        self.records: list[PlanRecord] = []
        self.lists: list[ChecklistRecord] = []
        me: Any = self
        work = FlightWork(made.library, me.vehicle, me, lanes[1])
        bus: Any = SimpleNamespace(publish=self._heard)
        self.aboard = Aboard(file)
        checklist = ChecklistDesk(me.vehicle, Checklists(made.library.root), self.aboard, bus)
        taking_up = TakingUp(me.vehicle, me.live, me, made.library, lanes[1], me.watch, self.aboard)
        self.desk = FlightDesk(
            me.vehicle, work, self.aboard, checklist, me, me.live, me.watch, bus, self, taking_up, is_alone=is_alone
        )
        self.desk.on_link(LinkStatus(0.0, adopted=QUAD, state="live", mission_state="unknown"))

    def _heard(self, topic: str, record: Any) -> None:
        (self.lists if topic == Topic.CHECKLIST else self.records).append(record)

    @property
    def document(self) -> PlanDoc:
        return self.plan.document

    @property
    def state(self) -> PlanState:
        return self.plan

    def publish(self, message: ServerMessage) -> None:
        assert message.type == "fly"
        self.told.append(message.fly)

    async def ready(self) -> str:
        """Uploaded and checked; the digest."""
        await self.desk.upload(ME, 3)
        state = await self.desk.check(ME)
        assert state.preflight is not None
        assert [row for row in state.preflight.rows if row.state != "good"] == []
        assert state.onboard.digest is not None
        return state.onboard.digest
