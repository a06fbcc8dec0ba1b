"""What every route needs: the parts of the running app, the session behind a request, answers as JSON."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Depends, Request
from fastapi.responses import Response
from pydantic import BaseModel
from starlette.requests import HTTPConnection

from server.door.auth import Auth, session_key
from server.door.hub import Hub
from server.errors import BadRequestError, LateError, SignInError
from server.library import Library
from server.scene.host import SceneHost
from server.schemas import ErrorDoc
from server.settings import Settings
from server.work.loop_lag import LoopLag
from telemetry.topics.requests import Operator

if TYPE_CHECKING:
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
    flying: Flying
    radar: RadarDesk
    scenarios: ScenarioDesk
    loop_lag: LoopLag


def parts_of(connection: HTTPConnection) -> Parts:
    return connection.app.state.parts


def cookie_name(connection: HTTPConnection) -> str:
    """With the port, because browsers share the cookies of all ports of a host."""
    prefix = "__Host-" if connection.scope["scheme"] in ("https", "wss") else ""
    return f"{prefix}hedgehop-{parts_of(connection).settings.port}"


def session_of(connection: HTTPConnection) -> str:
    """The id of the live session that the request belongs to; raises ``SignInError``."""
    session_id = connection.cookies.get(cookie_name(connection), "")
    if parts_of(connection).auth.remaining_s(session_id) <= 0:
        raise SignInError(
            "You are not signed in, or your session has ended.",
            advice="Open the sign-in link that Hedgehop printed, or sign in with the password.",
        )
    return session_id


def signed_in(request: Request) -> str:
    return session_of(request)


def workspace_of(request: Request) -> Workspace:
    return parts_of(request).workspace


def flying_of(request: Request) -> Flying:
    return parts_of(request).flying


def session_key_of(request: Request) -> str:
    return session_key(session_of(request))


def in_charge(request: Request) -> Operator:
    """What a command of this session carries; raises ``NotInChargeError``, and ``LateError`` for one that is late."""
    _check_in_time(request.headers.get("hedgehop-good-until", ""))
    return parts_of(request).flying.lease.operator(session_key_of(request))


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


SignedIn = Depends(signed_in)
Work = Annotated["Workspace", Depends(workspace_of)]
Fly = Annotated["Flying", Depends(flying_of)]
Session = Annotated[str, Depends(session_key_of)]
InCharge = Annotated[Operator, Depends(in_charge)]
"""Demanded by everything that reaches a vehicle."""
ERROR_RESPONSES: dict[int | str, dict[str, object]] = {
    status: {"model": ErrorDoc} for status in (401, 403, 404, 409, 413, 422, 502, 503, 504, 507)
}


DONE: dict[str, Any] = {"status_code": 204, "response_class": Response}
"""Of routes that answer with nothing."""


def answer(document: BaseModel, status_code: int = 200) -> Response:
    """A checked document as JSON, written once; NaN and infinity become null."""
    return Response(document.model_dump_json(), status_code=status_code, media_type="application/json")
