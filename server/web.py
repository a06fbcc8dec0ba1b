"""The FastAPI app: console, REST, ``/ws`` and the 3D view on one origin, with everything they share."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from planning import __version__
from planning.errors import DescribedError
from planning.terrain.rasters.confinement import what_holds
from server.api import (
    account_routes,
    audit_routes,
    checklist_routes,
    console_routes,
    flight_routes,
    link_routes,
    obstacle_routes,
    parameter_routes,
    plan_routes,
    proxy,
    radar_file_routes,
    recording_routes,
    scenario_routes,
    sensor_routes,
    session_routes,
    terrain_routes,
    traffic_routes,
    traversability_routes,
    vehicle_log_routes,
    view_routes,
)
from server.api.access import Admitted, Parts, answer
from server.api.sessions_ended import watch_sessions
from server.door.accounts import Accounts
from server.door.alarms import Alarms
from server.door.audit_watch import AuditWatch
from server.door.auth import Auth
from server.door.guard import Guard
from server.door.hub import Hub
from server.door.sensor_token import sensor_token
from server.door.tls import Tls
from server.door.trust import TrustListener
from server.errors import error_doc, status_of
from server.library import Library
from server.library.radar_files import RadarShelf
from server.library.reserve import DiskWatch
from server.library.scenario_runs import ScenarioShelf
from server.scene.host import SceneHost
from server.schemas import ErrorDoc, NoticeMessage
from server.schemas.station_docs import FIRST_VEHICLE
from server.settings import Settings
from server.studies.radar_desk import RadarDesk
from server.studies.scenario_desk import ScenarioDesk
from server.work.loading import loaded_to_stay
from server.work.loop_lag import LoopLag
from server.work.task_group import Background

if TYPE_CHECKING:
    from server.fleet import Fleet
    from server.workspace import Workspace

log = logging.getLogger("hedgehop.app")

MakeWorkspace = Callable[[Library, Hub, SceneHost, Background], "Workspace"]
"""Joins the open plan to its files, its pages and its 3D view."""
OpenFleet = Callable[[Settings, Library, Hub, "Workspace", ScenarioDesk, bool], Awaitable["Fleet"]]
"""Joins the buses and all that hangs on them."""
ROUTERS = (
    session_routes,
    account_routes,
    audit_routes,
    plan_routes,
    terrain_routes,
    traversability_routes,
    view_routes,
    console_routes,
    link_routes,
    vehicle_log_routes,
    flight_routes,
    checklist_routes,
    parameter_routes,
    obstacle_routes,
    traffic_routes,
    sensor_routes,
    recording_routes,
    radar_file_routes,
    scenario_routes,
    proxy,
)


def create_app(
    settings: Settings,
    library: Library,
    make_workspace: MakeWorkspace,
    open_fleet: OpenFleet,
    *,
    demo: bool = False,
    tls: Tls | None = None,
) -> FastAPI:
    """The app around an open library, which stays its caller's to close."""
    app = FastAPI(
        title="Hedgehop",
        version=__version__,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        dependencies=[Admitted],
        lifespan=lambda app: _lifespan(app, settings, library, make_workspace, open_fleet, demo, tls),
    )
    for module in ROUTERS:
        app.include_router(module.router)
    for error in (DescribedError, RequestValidationError, HTTPException):
        app.add_exception_handler(error, _tell)
    app.add_exception_handler(ClientDisconnect, _answer_nobody)
    app.add_exception_handler(Exception, _tell_unforeseen)
    app.add_middleware(Guard, settings=settings, certified=tls.names.dns if tls else frozenset())
    return app


@contextlib.asynccontextmanager
async def _lifespan(
    app: FastAPI,
    settings: Settings,
    library: Library,
    make_workspace: MakeWorkspace,
    open_fleet: OpenFleet,
    demo: bool,
    tls: Tls | None,
) -> AsyncIterator[None]:
    async with AsyncExitStack() as stack, asyncio.TaskGroup() as group:
        background = Background(group)
        stack.callback(background.stop)
        try:
            with loaded_to_stay():
                await asyncio.to_thread(_complete_routes, app)
                parts = await _open(settings, library, make_workspace, open_fleet, background, stack, demo, tls)
        except DescribedError as error:
            app.state.start_error = error
            raise
        app.state.parts = parts
        disk = DiskWatch(library.reserve, lambda full: _tell_of_disk(parts, full))
        own = (
            parts.loop_lag.run(),
            watch_sessions(parts),
            disk.run(),
            parts.audit.run(),
            *_tls_loops(tls, settings, parts.alarms),
        )
        for loop in (*own, *parts.workspace.loops(), *parts.fleet.loops(parts.alarms, demo=demo)):
            background.spawn(loop)
        try:
            yield
        except asyncio.CancelledError:
            # One of the loops failed. Without it the pages would go on showing what is no longer true.
            log.critical("A part of the server failed: it stops. Everything acknowledged is saved.")
            signal.raise_signal(signal.SIGTERM)
            raise
        finally:
            parts.hub.close()
            background.stop()


def _complete_routes(app: FastAPI) -> None:
    """Left to itself, FastAPI does it when first asked, and holds up the loop for a third of a second."""
    scope = {"type": "http", "method": "GET", "path": "/-", "headers": []}
    for route in app.router.routes:
        route.matches(scope)


async def _open(
    settings: Settings,
    library: Library,
    make_workspace: MakeWorkspace,
    open_fleet: OpenFleet,
    background: Background,
    stack: AsyncExitStack,
    demo: bool,
    tls: Tls | None,
) -> Parts:
    """Opens everything in order; ``stack`` closes it in reverse, also when a later step fails."""
    auth = await asyncio.to_thread(
        Auth,
        library.root / "sessions.json",
        Accounts(library.root),
        password=None if settings.password is None else settings.password.get_secret_value(),
        lifetime_s=settings.session_days * 86400.0,
    )
    await asyncio.to_thread(sensor_token, library.root)
    hub = Hub()
    host = await asyncio.to_thread(SceneHost)
    stack.callback(host.close)
    workspace = make_workspace(library, hub, host, background)
    stack.push_async_callback(workspace.close)
    radar, scenarios = await asyncio.to_thread(_open_studies, library, hub, background)
    stack.push_async_callback(radar.close)
    stack.push_async_callback(scenarios.close)
    log.info("%s", what_holds())
    fleet = await open_fleet(settings, library, hub, workspace, scenarios, demo)
    stack.push_async_callback(fleet.close)
    await workspace.start(with_demo=demo)
    for notice in library.notices:
        log.warning("%s (%s)", notice.what, notice.where)
    hub.greet_with([NoticeMessage(level="warning", error=notice) for notice in library.notices])
    alarms = Alarms(hub)
    audit = AuditWatch(lambda: {FIRST_VEHICLE: library.root, **library.vehicle_dirs()}, workspace.board, alarms)
    trust_port = settings.trust_port if tls is not None and tls.offer(settings) else None
    lag = LoopLag()
    return Parts(settings, auth, hub, library, host, workspace, fleet, radar, scenarios, lag, alarms, audit, trust_port)


def _tell_of_disk(parts: Parts, full: ErrorDoc | None) -> None:
    if full is not None:
        parts.alarms.begin("disk", full)
        return
    parts.alarms.end("disk")
    again = ErrorDoc(code="disk_room", what="There is room on the disk again.")
    parts.hub.publish(NoticeMessage(level="info", error=again))


def _tls_loops(tls: Tls | None, settings: Settings, alarms: Alarms) -> list[Coroutine[Any, Any, None]]:
    if tls is None:
        return []
    offer = tls.offer(settings)
    listener = [] if offer is None else [TrustListener(offer, settings.host, settings.trust_port).run()]
    return [tls.run(alarms), *listener]


def _open_studies(library: Library, hub: Hub, background: Background) -> tuple[RadarDesk, ScenarioDesk]:
    """What Review looks at beside recordings."""
    damaged = library.notices.append
    scenarios = ScenarioDesk(ScenarioShelf(library.root, damaged), hub, background)
    return RadarDesk(RadarShelf(library.root, damaged), hub), scenarios


async def _tell(request: Request, error: Exception) -> Response:
    del request
    return answer(error_doc(error), status_of(error))


async def _answer_nobody(request: Request, error: Exception) -> Response:
    # An upload was broken off: no fault of the server's. The status is for the log only.
    del request, error
    return Response(status_code=400)


async def _tell_unforeseen(request: Request, error: Exception) -> Response:
    # Whoever serves the app logs the error itself, with its traceback.
    del request
    return answer(error_doc(error), 500)
