"""Signing in and out over HTTP, and what strangers get to see."""

from __future__ import annotations

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from server.door.page import CLOSE_SIGNED_OUT
from tests.server.running import PASSWORD, Running

PRIVATE = [
    ("GET", "/api/state"),
    ("PUT", "/api/plan"),
    ("POST", "/api/plan/undo"),
    ("GET", "/api/plan/export/all.zip"),
    ("POST", "/api/terrains?filename=x.tif"),
    ("DELETE", "/api/terrains/a"),
    ("POST", "/api/jobs/a/cancel"),
    ("GET", "/api/openapi.json"),
    ("GET", "/api/docs"),
    ("GET", "/assets/main.js"),
    ("DELETE", "/api/session"),
]


@pytest.mark.parametrize(("method", "path"), PRIVATE)
def test_strangers_get_401_and_a_way_in(served: Running, method: str, path: str) -> None:
    before = list(served.workspace.calls)
    with served.stranger(headers={"Origin": served.origin}) as client:
        response = client.request(method, path)
    assert response.status_code == 401
    assert set(response.json()) == {"code", "what", "where", "advice"}
    assert response.json()["code"] == "sign_in"
    assert served.workspace.calls == before


def test_a_page_without_a_session_leads_to_the_sign_in_page(served: Running) -> None:
    with served.stranger() as client:
        response = client.get("/")
        assert (response.status_code, response.headers["location"]) == (303, "/signin")
        page = client.get("/signin")
    assert page.status_code == 200
    assert 'type="password"' in page.text
    assert "script-src 'sha256-" in page.headers["content-security-policy"]


def test_the_link_works_once_and_then_leads_on(served: Running) -> None:
    token = served.parts.auth.new_link_token()
    with served.stranger() as client, served.stranger() as late:
        first = client.get("/login", params={"token": token})
        assert (first.status_code, first.headers["location"]) == (303, "/")
        cookie = first.headers["set-cookie"].lower()
        assert all(part in cookie for part in ("httponly", "samesite=strict", "path=/", "max-age="))
        assert client.get("/api/state").status_code == 200
        assert client.get("/login", params={"token": token}).headers["location"] == "/"
        refused = late.get("/login", params={"token": token})
        assert refused.status_code == 401
        assert "used already" in refused.text
        assert "set-cookie" not in refused.headers


def test_markup_in_a_token_is_not_echoed(served: Running) -> None:
    with served.stranger() as client:
        assert "<script>alert" not in client.get("/login", params={"token": "<script>alert(1)</script>"}).text


def test_the_password_signs_in(served: Running) -> None:
    with served.stranger(headers={"Origin": served.origin}) as client:
        wrong = client.post("/api/session", json={"password": "wrong"})
        assert (wrong.status_code, wrong.json()["code"]) == (401, "sign_in")
        assert client.post("/api/session", json={"password": PASSWORD}).status_code == 204
        assert client.get("/api/state").status_code == 200
        assert client.delete("/api/session").status_code == 204
        assert client.get("/api/state").status_code == 401


def test_signing_out_closes_the_sockets_of_the_session(served: Running) -> None:
    with served.stranger(headers={"Origin": served.origin}) as client:
        client.post("/api/session", json={"password": PASSWORD})
        name = f"hedgehop-{served.settings.port}"
        with served.socket(additional_headers={"Cookie": f"{name}={client.cookies[name]}"}) as socket:
            socket.recv(timeout=60)
            client.delete("/api/session")
            with pytest.raises(ConnectionClosed) as closed:
                read_on(socket)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == CLOSE_SIGNED_OUT


def read_on(socket: Connection) -> None:
    while True:
        socket.recv(timeout=30)


@pytest.mark.parametrize("cookie", ["", "hedgehop-{port}=invented", "hedgehop-1=x"])
def test_a_socket_without_a_session_closes_with_4401(served: Running, cookie: str) -> None:
    text = cookie.replace("{port}", str(served.settings.port))
    with (
        connect(
            f"ws://127.0.0.1:{served.settings.port}/ws",
            origin=Origin(served.origin),
            additional_headers={"Cookie": text},
        ) as socket,
        pytest.raises(ConnectionClosed) as closed,
    ):
        socket.recv(timeout=60)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == CLOSE_SIGNED_OUT
