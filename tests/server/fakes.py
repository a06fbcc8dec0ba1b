"""A workspace that computes nothing: what the door does is tested without what lies behind it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from server.door.hub import Hub
from server.door.lease import Lease
from server.door.operators import Operators
from server.errors import NotFoundError, NotReadyError, StaleRevisionError
from server.flying.apart.nearness import Flown
from server.flying.checklists import Checklists
from server.heard.agents import Agents
from server.library import Library
from server.obstacles.obstacle_watch import Watch
from server.schemas import (
    ClientMessage,
    Computation,
    ErrorDoc,
    FlyState,
    Imported,
    JobDoc,
    LandingSitesBody,
    LayerName,
    LibraryState,
    NoticeMessage,
    ObstaclesState,
    OnboardDoc,
    ParametersDoc,
    PlanDoc,
    PlanEdit,
    PlanMessage,
    PlanState,
    PoiDoc,
    RadarTargetsDoc,
    SectionDoc,
    SelectionDoc,
    ServerMessage,
    SetSelection,
    Snapshot,
    TraversabilityBody,
    TraversabilityState,
    ViewDoc,
    WrittenAnswer,
)


class Told(list[Any]):
    """Pages that keep what they are told."""

    def publish(self, message: ServerMessage) -> None:
        self.append(message)


def plan_state(revision: int = 1, document: PlanDoc | None = None) -> PlanState:
    return PlanState(
        plan_id="p1",
        revision=revision,
        document=document or PlanDoc(),
        can_undo=False,
        can_redo=False,
        saved_utc="2026-01-01T00:00:00.000Z",
        computation=Computation(revision=revision, state="empty", hint="Add points."),
    )


def snapshot(page_id: str = "") -> Snapshot:
    return Snapshot(
        product_version="0",
        page_id=page_id,
        plan=plan_state(),
        library=LibraryState(terrains=[], orthophotos=[], plans=[], profiles=[]),
        view=ViewDoc(),
        selection=SelectionDoc(),
        jobs=[],
    )


def notice(what: str) -> NoticeMessage:
    return NoticeMessage(level="info", error=ErrorDoc(code="test", what=what))


class FakeWorkspace:
    """Counts what would have changed something."""

    def __init__(self, library: Library, hub: Hub) -> None:
        self.library, self.hub = library, hub
        self.calls: list[str] = []
        self.messages: list[tuple[str, ClientMessage]] = []
        self.uploads: dict[str, bytes] = {}
        self.options: dict[str, object] = {}
        self.loop = asyncio.get_running_loop()
        self.files = SimpleNamespace(
            add_terrain=self._add_terrain, add_orthophoto=self._add_orthophoto, remove_spikes=self._remove_spikes
        )

        self.plans = self.terrains = self.on_show = self.board = self
        self.traversability = FakeTraversability(self.calls)

    async def unseen(self, work: Callable[[Any], Awaitable[object]]) -> None:
        await work(self)

    async def call(self, function: Callable[..., object], *arguments: object) -> object:
        return function(*arguments, report=None)

    async def start(self, *, with_demo: bool = False) -> None:
        self.calls.append("start with demo" if with_demo else "start")

    def loops(self) -> list:
        return []

    async def close(self) -> None:
        self.calls.append("close")

    def snapshot(self, page_id: str) -> Snapshot:
        return snapshot(page_id)

    def present(self) -> list[ServerMessage]:
        return []

    async def edit(self, edit: PlanEdit) -> PlanState:
        self.calls.append("edit")
        if edit.base_revision != 1:
            raise StaleRevisionError("The plan has changed.", advice="Look again.")
        state = plan_state(2, edit.document)
        self.hub.publish(PlanMessage(plan=state))
        return state

    async def undo(self) -> PlanState:
        self.calls.append("undo")
        return plan_state()

    async def export(self, file: str) -> bytes:
        if file != "report.html":
            raise NotReadyError("There is no finished plan.", advice="Wait.")
        return b"<!doctype html><script>alert(1)</script>"

    async def import_points(self, filename: str, upload: Path, *, only_fence: bool) -> Imported:
        self.uploads[filename] = upload.read_bytes()
        upload.unlink()
        document = PlanDoc(pois=[PoiDoc(id="a", lat_deg=1, lon_deg=2)])
        return Imported(state=plan_state(2, document), warnings=[], taken="2 points")

    async def add_demo(self) -> None:
        self.calls.append("demo")

    async def delete(self, terrain_id: str) -> None:
        self.calls.append("delete_terrain")
        self.library.delete_terrain(terrain_id)

    def cancel(self, job_id: str) -> None:
        self.calls.append(f"cancel {job_id}")

    async def on_client_message(self, page_id: str, message: ClientMessage) -> None:
        self.messages.append((page_id, message))
        if isinstance(message, SetSelection) and message.selection.poi_id == "broken":
            raise RuntimeError("a secret detail")
        if isinstance(message, SetSelection) and message.selection.poi_id == "refused":
            raise NotReadyError("There is no such point.")

    def _add_terrain(self, upload: Path, filename: str, **options: object) -> JobDoc:
        self.uploads[filename] = upload.read_bytes()
        self.options = options
        upload.unlink()
        return JobDoc(id="j1", label=f"Reading {filename}", state="running")

    def _add_orthophoto(self, upload: Path, filename: str, terrain_id: str) -> JobDoc:
        return self._add_terrain(upload, filename, terrain_id=terrain_id)

    def _remove_spikes(self, terrain_id: str) -> JobDoc:
        self.library.terrain_dir(terrain_id)
        return JobDoc(id="j2", label="Removing spikes", state="running")


class FakeTraversability:
    """Counts what it was asked for."""

    def __init__(self, calls: list[str]) -> None:
        self.calls = calls
        self.uploads: dict[str, bytes] = {}
        self.uwb_params: object = None

    def work_out(self, body: TraversabilityBody) -> JobDoc:
        self.calls.append(f"work out {body.resolution_m}")
        return JobDoc(id="j3", label="Traversability", state="running")

    def clear_foliage(self, upload: Path, name: str, params: object = None) -> JobDoc:
        self.uploads[name] = upload.read_bytes()
        self.uwb_params = params
        upload.unlink()
        return JobDoc(id="j4", label=f"Reading {name}", state="running")

    async def sites(self, body: LandingSitesBody) -> TraversabilityState:
        return TraversabilityState(state="ready", sites_near=(body.lat_deg, body.lon_deg))

    async def layer_file(self, layer: LayerName) -> bytes:
        if layer == "probability":
            raise NotReadyError("No radar log has been taken in yet.")
        return b"II*"

    def forget(self) -> None:
        self.calls.append("forget")


class FakeFlying:
    """A lease and nothing to command; keeps what it was asked."""

    def __init__(self, library: Library, hub: Hub) -> None:
        self.number = 1
        self.lease = Lease(library.root / "lease.json")
        self.operators = Operators(self.lease, hub)
        self.asked: list[tuple[Any, ...]] = []
        self.obstacles = self.looking = _Asked(self.asked)
        self.published: list[tuple[str, Any]] = []
        self.agents = Agents(cast(Any, self))
        self.live = SimpleNamespace(armed=False)
        self.uwb = SimpleNamespace(clear=lambda: self.asked.append(("clear",)), set_params=lambda params: None)
        self.connections = self.desk = self.simulation = self.recording = self.parameters = _Asked(self.asked)

    def publish(self, topic: str, message: Any) -> None:
        """As the bus does."""
        self.published.append((topic, message))

    def present_for(self, session_key: str) -> list[ServerMessage]:
        return []


class FakeFleet:
    """Of one vehicle."""

    def __init__(self, library: Library, hub: Hub) -> None:
        self.first = FakeFlying(library, hub)
        self.flights = [self.first]
        self.uwb, self.checklists = self.first.uwb, Checklists(library.root)
        self.recordings = self.reviewing = self.first.recording
        self.bags = SimpleNamespace(docs=list)

    @property
    def any_armed(self) -> bool:
        return self.first.live.armed

    @property
    def holders(self) -> set[str]:
        holder = self.first.lease.holder
        return set() if holder is None else {holder.session_key}

    def loops(self, alarms: object, *, demo: bool = False) -> list:
        return []

    async def close(self) -> None:
        self.first.asked.append(("close",))

    def present(self) -> list[ServerMessage]:
        return []

    def others_in_air(self, number: int) -> list[Flown]:
        del number
        return []

    def of(self, number: int) -> FakeFlying:
        if number != 1:
            raise NotFoundError(f"There is no vehicle {number}.")
        return self.first

    def named(self, number: str | None) -> FakeFlying:
        return self.of(int(number or 1))


_FLY_STATE, _OBSTACLES = FlyState(onboard=OnboardDoc(state="none")), ObstaclesState()
_ANSWERS: dict[str, Any] = {
    "upload": _FLY_STATE,
    "check": _FLY_STATE,
    "acknowledge": _OBSTACLES,
    "change_settings": _OBSTACLES,
    "plan_with_seen": plan_state(),
    "exported": b"a map",
    "section": SectionDoc(across=True, thickness_m=2.0, reach_m=30.0, text="No sensor tells where the vehicle is."),
    "targets": RadarTargetsDoc(),
    "write": WrittenAnswer(
        written=[],
        now=ParametersDoc(
            vehicle="vehicle 1", read_utc_s=0.0, described=False, parameters=[], findings=[], plan_name=""
        ),
    ),
}


class _Asked:
    """Takes every call and keeps its name and arguments."""

    def __init__(self, asked: list[tuple[Any, ...]]) -> None:
        self._asked = asked

    def __getattr__(self, name: str) -> Callable[..., Awaitable[Any]]:
        async def call(*args: object, **more: object) -> Any:
            self._asked.append((name, *args, *more.values()))
            return _ANSWERS.get(name)

        return call


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def watching(source: Any = "live") -> tuple[Watch, list[Any], Clock]:
    """A watch over what it is given, what it tells, and its clock."""
    told, clock = Told(), Clock()
    return Watch(source, told, now_mono_s=clock, now_utc_s=lambda: 5000.0), told, clock
