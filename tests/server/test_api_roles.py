"""Observers see everything and change nothing: every route, every WebSocket, and the 3D view's own messages."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import httpx
import msgspec
import pytest
from fastapi.routing import APIRoute
from starlette.routing import WebSocketRoute
from websockets.exceptions import ConnectionClosed

from server.api.access import _NEEDS, Need, need_of
from server.door.guard import SAFE_METHODS
from server.door.page import CLOSE_SIGNED_OUT
from server.door.passwords import PasswordHash
from server.scene.filter import ALLOWED, OF_OBSERVERS, MessageFilter
from tests.server.running import Running
from tests.server.test_api_session import read_on

OWN = {("DELETE", "/api/session"), ("PUT", "/api/session/password")}
"""What observers may change: whether they are in, and by which password."""
OPEN = {
    ("GET", "/api/health"),
    ("GET", "/login"),
    ("GET", "/signin"),
    ("POST", "/api/session"),
    ("GET", "/"),
    ("GET", "/help"),
    ("GET", "/help/"),
    ("GET", "/help/{path:path}"),
    ("GET", "/favicon.svg"),
}
FOR_OPERATORS = {("GET", "/api/accounts"), ("GET", "/api/sessions")}


@pytest.fixture
def observer(served: Running) -> Iterator[httpx.Client]:
    accounts = served.parts.auth.accounts
    accounts.add("Olga", "observer")
    with served.stranger(headers={"Origin": served.origin}) as client:
        assert client.get("/login", params={"token": accounts.invite("Olga")}).headers["location"] == "/"
        yield client
    if accounts.find("Olga"):
        accounts.remove("Olga")


def cookie(served: Running, client: httpx.Client) -> dict[str, str]:
    name = f"hedgehop-{served.settings.port}"
    return {"Cookie": f"{name}={client.cookies[name]}"}


def routes(served: Running) -> list[tuple[str, str, Any]]:
    return [
        (method, route.path, route.endpoint)
        for route in _all(served.app.router)
        if isinstance(route, APIRoute)
        for method in sorted(route.methods or ())
    ]


def _all(router: Any) -> Iterator[Any]:
    for route in router.routes:
        if isinstance(route, APIRoute | WebSocketRoute):
            yield route
        else:
            inner = getattr(route, "original_router", None) or getattr(route, "app", None)
            yield from _all(inner)


def test_every_route_says_what_it_needs_and_what_is_open_stands_here(served: Running) -> None:
    found = routes(served)
    assert len(found) > 60
    declared = {(method, path): need_of(endpoint, method) for method, path, endpoint in found}
    assert {key for key, need in declared.items() if need is Need.NOTHING} == OPEN
    assert {key for key, need in declared.items() if need is Need.OPERATOR and key[0] in SAFE_METHODS} == FOR_OPERATORS
    changing = {key for key, need in declared.items() if key[0] not in SAFE_METHODS and need is Need.OBSERVER}
    assert changing == OWN


def test_an_observer_is_refused_by_every_route_that_changes_something(served: Running, observer: httpx.Client) -> None:
    before, asked = list(served.workspace.calls), list(served.flying.asked)
    tried = 0
    for method, path, _ in routes(served):
        if (method in SAFE_METHODS and (method, path) not in FOR_OPERATORS) or (method, path) in OWN | OPEN:
            continue
        answered = observer.request(method, re.sub(r"{[^}]*}", "x", path), json={})
        assert (answered.status_code, answered.json()["code"]) == (403, "observer"), (method, path)
        tried += 1
    assert tried > 45
    assert (served.workspace.calls, served.flying.asked) == (before, asked)
    assert served.flying.lease.holder is None


def test_an_observer_sees(served: Running, observer: httpx.Client) -> None:
    for path in ("/api/state", "/api/scenarios", "/api/openapi.json", "/api/docs", "/api/radar/files"):
        assert observer.get(path).status_code == 200, path
    assert observer.get("/api/session").json() == {"name": "Olga", "role": "observer", "owner": False}


def test_every_socket_says_what_it_needs(served: Running) -> None:
    found = [route for route in _all(served.app.router) if not isinstance(route, APIRoute)]
    sockets = {route.path: _NEEDS[route.endpoint] for route in found}
    assert sorted(sockets.values(), key=str) == [Need.NOTHING, Need.OBSERVER, Need.OBSERVER]
    assert {path for path, need in sockets.items() if need is Need.OBSERVER} == {"/ws", "/view/{page_id}"}


def test_an_observers_stream_changes_nothing_that_others_see(served: Running, observer: httpx.Client) -> None:
    served.workspace.messages.clear()
    with served.socket(additional_headers=cookie(served, observer)) as socket:
        me = next(message for message in map(json.loads, socket) if message["type"] == "me")
        assert me["me"]["role"] == "observer"
        view = {"type": "set_view", "view": {}, "change": 1}
        for message in (
            {"type": "hover_profile", "s_m": 1.0},
            {"type": "hover_view", "x": 0.5, "y": 0.5},
            {"type": "set_selection", "selection": {}, "change": 0},
            view,
            {"type": "frame_view", "target": "top"},
        ):
            socket.send(json.dumps(message))
        told = []
        while not (told and told[-1]["type"] == "answered" and told[-1]["change"] == 1):
            told.append(json.loads(socket.recv(timeout=30)))
        socket.send(json.dumps({"type": "ping", "page_ms": 1.0}))
        while told[-1]["type"] != "clock":
            told.append(json.loads(socket.recv(timeout=30)))
    notices = [message["error"]["code"] for message in told if message["type"] == "notice"]
    assert notices == ["observer", "observer"]
    assert [message.type for _, message in served.workspace.messages] == ["frame_view"]


def test_an_observers_hand_in_the_3d_view_moves_the_camera_alone() -> None:
    for kind in ALLOWED:
        if kind.__name__ not in OF_OBSERVERS:
            observers = MessageFilter(may_change=False)
            assert not observers.lets_through(msgspec.msgpack.encode({"type": kind.__name__}))
            assert not observers.dropped


def test_a_removed_account_is_out_at_once_on_all_its_pages(served: Running, observer: httpx.Client) -> None:
    with served.socket(additional_headers=cookie(served, observer)) as socket:
        socket.recv(timeout=30)
        served.parts.auth.accounts.remove("Olga")  # as the command line does: the server sees the file
        with pytest.raises(ConnectionClosed) as closed:
            read_on(socket)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == CLOSE_SIGNED_OUT
    assert observer.get("/api/state").status_code == 401


def test_another_password_ends_the_other_sessions(served: Running, observer: httpx.Client) -> None:
    accounts = served.parts.auth.accounts
    with served.stranger(headers={"Origin": served.origin}) as other:
        other.get("/login", params={"token": accounts.invite("Olga")})
        assert other.put("/api/session/password", json={"password": "short"}).status_code == 422
        assert other.put("/api/session/password", json={"password": "hers alone"}).status_code == 204
        assert (other.get("/api/state").status_code, observer.get("/api/state").status_code) == (200, 401)
        body = {"name": "olga", "password": "hers alone"}
        assert observer.post("/api/session", json=body).status_code == 204
        accounts.set_password("Olga", PasswordHash.of("another one"))
        assert other.get("/api/state").status_code == 401


def test_an_operator_makes_accounts_sees_sessions_and_ends_them(served: Running) -> None:
    made = served.http.post("/api/accounts", json={"name": "Otto", "role": "operator"})
    assert made.status_code == 201
    assert served.http.post("/api/accounts", json={"name": "otto", "role": "observer"}).status_code == 409
    link = made.json()["link"]
    assert link.startswith(served.origin + "/login?token=")
    with served.stranger(headers={"Origin": served.origin}) as otto, served.stranger() as late:
        assert otto.get(link).status_code == 303
        assert late.get(link).status_code == 401
        assert otto.post("/api/lease/take").json() == {
            "holder": "Otto", "mine": True, "silent": False, "asks": None, "waits": False,
        }  # fmt: skip
        sessions = otto.get("/api/sessions").json()
        mine = next(session for session in sessions if session["mine"])
        assert (mine["name"], mine["role"], mine["address"], mine["in_charge"]) == (
            "Otto",
            "operator",
            "127.0.0.1",
            True,
        )
        assert [account["name"] for account in otto.get("/api/accounts").json()] == ["Otto"]
        assert served.http.delete(f"/api/sessions/{mine['id']}").status_code == 204
        assert otto.get("/api/state").status_code == 401
        assert served.flying.lease.holder is None
        otto.get(served.http.post("/api/accounts/Otto/invitation").json()["link"])
        assert otto.get("/api/state").status_code == 200
        assert served.http.delete("/api/sessions").status_code == 204
        assert otto.get("/api/state").status_code == 401
        assert served.http.get("/api/state").status_code == 200
    assert served.http.delete("/api/accounts/Otto").status_code == 204
    assert served.http.delete("/api/accounts/Otto").status_code == 404
    assert served.http.delete("/api/sessions/x").status_code == 404
    assert served.http.put("/api/session/password", json={"password": "long enough"}).status_code == 409
