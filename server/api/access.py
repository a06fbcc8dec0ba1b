"""What every route needs: the parts of the running app, who is behind a request and what they may, answers as JSON."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from http import HTTPStatus
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from fastapi import Depends, Request
from fastapi.responses import Response
from pydantic import BaseModel
from starlette.requests import HTTPConnection

from server.door.alarms import Alarms
from server.door.audit_watch import AuditWatch
from server.door.auth import Auth, Identity
from server.door.guard import SAFE_METHODS
from server.door.hub import Hub
from server.errors import ASK_OPERATOR, BadRequestError, LateError, ObserverError, SignInError
from server.library import Library
from server.scene.host import SceneHost
from server.schemas import ErrorDoc
from server.settings import Settings
from server.work.loop_lag import LoopLag
from telemetry.topics.requests import Operator

if TYPE_CHECKING:
    from server.fleet import Fleet
    from server.stations import Flying
    from server.studies.radar_desk import RadarDesk
    from server.studies.scenario_desk import ScenarioDesk
    from server.workspace import Workspace


@dataclass(slots=True)
class Parts:
    """The running app, from start to stop."""

    settings: Settings
    auth: Auth
    hub: Hub
    library: Library
    scene_host: SceneHost
    workspace: Workspace
    fleet: Fleet
    radar: RadarDesk
    scenarios: ScenarioDesk
    loop_lag: LoopLag
    alarms: Alarms
    audit: AuditWatch
    trust_port: int | None
    """Where a device comes to trust our certificate; None: it has not to."""


def parts_of(connection: HTTPConnection) -> Parts:
    return connection.app.state.parts


def cookie_name(connection: HTTPConnection) -> str:
    """With the port, because browsers share the cookies of all ports of a host."""
    prefix = "__Host-" if connection.scope["scheme"] in ("https", "wss") else ""
    return f"{prefix}hedgehop-{parts_of(connection).settings.port}"


class Need(Enum):
    """What a route asks of whoever calls it."""

    NOTHING = "nothing"
    OBSERVER = "observer"
    OPERATOR = "operator"


_NEEDS: dict[object, Need] = {}
_ROUTE = TypeVar("_ROUTE", bound=Callable[..., Any])


def needs(need: Need) -> Callable[[_ROUTE], _ROUTE]:
    """Declares it, where it is not what the method says: to look is for everybody who is in, all else for operators."""

    def mark(route: _ROUTE) -> _ROUTE:
        _NEEDS[route] = need
        return route

    return mark


def need_of(endpoint: object, method: str) -> Need:
    return _NEEDS.get(endpoint, Need.OBSERVER if method in SAFE_METHODS else Need.OPERATOR)


def admit(connection: HTTPConnection) -> None:
    """Before every route, whoever wrote it. Raises SignInError, ObserverError. Sockets say it after they have opened:
    before, no page could be told why."""
    if connection.scope["type"] != "http":
        return
    need = need_of(connection.scope["endpoint"], connection.scope["method"])
    if need is Need.NOTHING:
        return
    identity = identity_of(connection)
    if need is Need.OPERATOR and not identity.may_change:
        raise observer_refused(identity.name)


def observer_refused(name: str) -> ObserverError:
    return ObserverError(f"{name} is an observer: observers see everything and change nothing.", advice=ASK_OPERATOR)


def identity_of(connection: HTTPConnection) -> Identity:
    """Who is behind the request; raises ``SignInError``."""
    auth = parts_of(connection).auth
    identity = auth.identity(connection.cookies.get(cookie_name(connection), ""))
    if identity is None:
        raise SignInError(
            "You are not signed in, or your session has ended.",
            advice="Open the sign-in link that Hedgehop printed, or sign in with the password.",
        )
    auth.note_seen(identity.session_key, address_of(connection))
    return identity


def address_of(connection: HTTPConnection) -> str:
    return connection.client.host if connection.client else ""


def workspace_of(request: Request) -> Workspace:
    return parts_of(request).workspace


def flying_of(request: Request) -> Flying:
    """The vehicle that a page shows is the one that its requests name; raises NotFoundError, BadRequestError."""
    named = request.headers.get("hedgehop-vehicle") or request.query_params.get("vehicle")
    return parts_of(request).fleet.named(named)


def fleet_of(request: Request) -> Fleet:
    return parts_of(request).fleet


def who_asks(request: Request) -> Identity:
    return identity_of(request)


def in_charge(request: Request) -> Operator:
    """What a command of this session carries; raises ``NotInChargeError``, and ``LateError`` for one that is late."""
    _check_in_time(request.headers.get("hedgehop-good-until", ""))
    return flying_of(request).lease.operator(identity_of(request).session_key)


def _check_in_time(good_until: str) -> None:
    """While a server hangs, what pages ask of it waits in its sockets; meanwhile somebody took the transmitter."""
    try:
        late_s = time.monotonic() - float(good_until or "inf")
    except ValueError:
        raise BadRequestError(
            f"Hedgehop-Good-Until is {good_until[:40]!r}, which is no time.",
            advice="Give a time of the clock of all t_mono_s, in seconds, or leave it out.",
        ) from None
    if late_s > 0:
        raise LateError(
            f"This came {late_s:.0f} s too late and was not done.", advice="Give it again if it is still wanted."
        )


Admitted = Depends(admit)
Work = Annotated["Workspace", Depends(workspace_of)]
Fly = Annotated["Flying", Depends(flying_of)]
"""The vehicle that the request is about."""
All = Annotated["Fleet", Depends(fleet_of)]
Who = Annotated[Identity, Depends(who_asks)]
InCharge = Annotated[Operator, Depends(in_charge)]
"""Demanded by everything that reaches a vehicle."""
# Not as a model: each route would make ten validators of it, twice, which took a third of the server's start.
_ERROR = {"application/json": {"schema": {"$ref": f"#/components/schemas/{ErrorDoc.__name__}"}}}
ERROR_RESPONSES: dict[int | str, dict[str, object]] = {
    status: {"description": HTTPStatus(status).phrase, "content": _ERROR}
    for status in (401, 403, 404, 409, 413, 422, 502, 503, 504, 507)
}


DONE: dict[str, Any] = {"status_code": 204, "response_class": Response}
"""Of routes that answer with nothing."""


def answer(document: BaseModel, status_code: int = 200) -> Response:
    """A checked document as JSON, written once; NaN and infinity become null."""
    return Response(document.model_dump_json(), status_code=status_code, media_type="application/json")
