"""Promise S3: viser behind the proxy gets cameras and clicks of its own page, and nothing else from anyone."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Any

import msgspec
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from server.scene.host import SUBPROTOCOL
from tests.server.running import Running

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 5),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 300,
    "image_width": 400,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


def encoded(message: dict[str, Any]) -> bytes:
    return msgspec.msgpack.encode(message)


def page_id_of(socket: Connection) -> str:
    return msgspec.json.decode(socket.recv(timeout=60))["page_id"]


def view(served: Running, page_id: str, **options: Any) -> ClientConnection:
    return served.socket(f"/view/{page_id}", subprotocols=[SUBPROTOCOL], **options)


def eventually(condition: Callable[[], object], seconds: float = 60.0) -> bool:
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return bool(condition())


def test_the_page_is_viser_with_a_strict_policy(served: Running) -> None:
    with served.socket() as stream:
        response = served.http.get(f"/view/{page_id_of(stream)}/")
    assert response.status_code == 200
    assert "<title>Viser</title>" in response.text
    policy = response.headers["content-security-policy"]
    assert f"connect-src 'self' ws://127.0.0.1:{served.settings.port} data: blob:;" in policy
    assert "frame-ancestors 'self'" in policy
    assert "'unsafe-eval'" not in policy


def test_a_query_that_points_elsewhere_is_stripped(served: Running) -> None:
    with served.socket() as stream:
        path = f"/view/{page_id_of(stream)}/"
        response = served.http.get(path + "?websocket=ws://evil.example&fixedDpr=0.5&playbackPath=//evil")
        assert (response.status_code, response.headers["location"]) == (303, path + "?fixedDpr=0.5")
        assert served.http.get(path + "?fixedDpr=0.5").status_code == 200


def test_messages_flow_and_the_client_is_known_by_its_page(served: Running) -> None:
    host = served.parts.scene_host
    with served.socket() as stream:
        page_id = page_id_of(stream)
        with view(served, page_id) as socket:
            assert socket.subprotocol == SUBPROTOCOL
            assert isinstance(socket.recv(timeout=60), bytes)
            socket.send(encoded(CAMERA))
            assert eventually(lambda: host.client(page_id) is not None)
            client = host.client(page_id)
            assert client is not None
            assert host.page_of_client(client.client_id) == page_id
            assert client.camera.position[2] == 5
        assert eventually(lambda: host.client(page_id) is None)
        assert eventually(lambda: host.page_of_client(client.client_id) is None)


def test_two_pages_are_told_apart(served: Running) -> None:
    host = served.parts.scene_host
    with served.socket() as one, served.socket() as two:
        pages = [page_id_of(one), page_id_of(two)]
        with view(served, pages[1]) as second, view(served, pages[0]) as first:
            for socket in (first, second):
                socket.send(encoded(CAMERA))
            assert eventually(lambda: all(host.client(page) is not None for page in pages))
            clients = [client for page in pages if (client := host.client(page)) is not None]
            assert [host.page_of_client(client.client_id) for client in clients] == pages


def test_hostile_messages_reach_no_callback(served: Running) -> None:
    server = served.parts.scene_host.server
    pressed: list[str] = []
    button = server.gui.add_button("Arm")
    upload = server.gui.add_upload_button("Load")
    button.on_click(lambda _: pressed.append("button"))
    upload.on_upload(lambda _: pressed.append("upload"))
    hostile = [
        {"type": "GuiUpdateMessage", "uuid": button._impl.uuid, "updates": {"value": True}},
        {"type": "ShareUrlRequest"},
        {"type": "ShareUrlDisconnect"},
        {"type": "CommandTriggerMessage", "uuid": "x"},
        {
            "type": "FileTransferStartUpload",
            "source_component_uuid": upload._impl.uuid,
            "transfer_uuid": "t",
            "filename": "../../x",
            "mime_type": "text/plain",
            "part_count": 1,
            "size_bytes": 10**12,
        },
        {"type": "RunJavascriptMessage", "source": "alert(1)"},
        {"type": "NoSuchMessage"},
        {"no_type": 1},
        CAMERA | {"fov": float("nan")},
        CAMERA | {"position": ("a", "b", "c")},
    ]
    with served.socket() as stream, view(served, page_id := page_id_of(stream)) as socket:
        for message in hostile:
            socket.send(encoded(message))
        socket.send(b"\xc1" * 100)
        socket.send("text")
        socket.send(encoded(CAMERA))
        # The camera comes last: once it is there, everything before it was dropped or handled.
        assert eventually(lambda: served.parts.scene_host.client(page_id) is not None)
    assert pressed == []
    assert server._share_tunnel is None
    button.remove()
    upload.remove()


def test_the_view_outlives_a_broken_stream_and_ends_with_its_page(
    served: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served.socket() as stream:
        page_id = page_id_of(stream)
        kept = view(served, page_id)
        kept.recv(timeout=60)
    with served.socket(f"/ws?page={page_id}") as stream:
        assert page_id_of(stream) == page_id
        with contextlib.suppress(TimeoutError):
            while True:
                kept.recv(timeout=0.5)
        assert kept.close_code is None
    kept.close()

    monkeypatch.setattr("server.door.hub.VIEW_KEPT_S", 0.1)
    with served.socket() as stream:
        socket = view(served, page_id_of(stream))
        socket.recv(timeout=60)
    with pytest.raises(ConnectionClosed):
        _read_to_the_end(socket)


def _read_to_the_end(socket: ClientConnection) -> None:
    while True:
        socket.recv(timeout=60)


def test_strangers_and_unknown_pages_are_refused(served: Running) -> None:
    with served.socket() as stream:
        page_id = page_id_of(stream)
        refused = [
            lambda: view(served, "unknown"),
            lambda: view(served, page_id, additional_headers={"Cookie": ""}),
            lambda: served.socket(f"/view/{page_id}", subprotocols=["viser-v0.0.1"]),
        ]
        for attempt in refused:
            with pytest.raises(InvalidStatus):
                attempt()
        with served.stranger() as client:
            assert client.get(f"/view/{page_id}/").status_code == 401
    assert served.http.get("/view/unknown/").status_code == 404


def test_another_session_cannot_use_a_page(served: Running) -> None:
    with served.socket() as stream, served.stranger() as other:
        page_id = page_id_of(stream)
        other.get("/login", params={"token": served.parts.auth.new_link_token()})
        assert other.get("/api/state").status_code == 200
        assert other.get(f"/view/{page_id}/").status_code == 404


def test_visers_own_port_lets_nobody_in(served: Running) -> None:
    url = served.parts.scene_host.url
    for origin in (None, "http://evil.example", served.origin):
        with pytest.raises(InvalidStatus) as refused:
            connect(url, origin=None if origin is None else Origin(origin), subprotocols=[Subprotocol(SUBPROTOCOL)])
        assert refused.value.response.status_code == 403
    with served.stranger() as client:
        assert client.get(url.replace("ws", "http", 1)).status_code == 403


def test_a_big_scene_passes_whole(served: Running) -> None:
    import numpy as np

    points = np.zeros((400_000, 3), np.float32)
    cloud = served.parts.scene_host.server.scene.add_point_cloud("/big", points, (0, 0, 0), precision="float32")
    received = 0
    with served.socket() as stream, view(served, page_id_of(stream)) as socket:
        while received < points.nbytes:
            received += len(socket.recv(timeout=60))
    cloud.remove()
    assert received >= points.nbytes


def test_viser_is_the_version_the_proxy_was_written_for() -> None:
    assert viser.__version__ == "1.1.1"
