"""Surface models on a server: by ranges, from allowed addresses only, and every failure in words."""

from __future__ import annotations

import http.server
import re
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.errors import ParameterError, RasterError, RasterFormatError
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.rasters import dsm_file
from planning.terrain.rasters.ranges import RemoteFile, is_address
from tests.planning.geotiff_samples import hill, write_raster


class Ranges(http.server.BaseHTTPRequestHandler):
    """Answers with ranges of ``files``; ``fault`` is what it does wrong."""

    protocol_version = "HTTP/1.1"
    server: Any  # a Server: typeshed has it mutable

    def do_GET(self) -> None:
        self.server.asked.append((self.path, self.headers.get("Range", "")))
        data, fault = self.server.files.get(self.path), self.server.fault
        if fault == "silent":
            self.server.released.wait(20)
            return
        if fault == "hangs up":
            self.close_connection = True
            return
        if fault == "redirect":
            self._answer(302, b"", {"Location": f"http://127.0.0.1:{self.server.server_port}/secret.tif"})
        elif data is None:
            self._answer(404, b"")
        elif fault == "no ranges":
            self._answer(200, data)
        else:
            self._part(data, fault)

    def _part(self, data: bytes, fault: str) -> None:
        first, last = map(int, re.findall(r"\d+", self.headers["Range"]))
        whole = {"Content-Range": f"bytes {first}-{last}/{len(data)}", "ETag": f'"{self.server.version}"'}
        if fault == "no version":
            del whole["ETag"]
        shifted = 1 if fault == "other bytes" and first else 0
        self._answer(206, data[first + shifted : last + 1], whole)

    def _answer(self, status: int, data: bytes, headers: dict[str, str] | None = None) -> None:
        self.send_response(status)
        for name, value in {**(headers or {}), "Content-Length": str(len(data))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        del format, args


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Ranges)
        self.files: dict[str, bytes] = {}
        self.asked: list[tuple[str, str]] = []
        self.fault, self.version = "", 1
        self.released = threading.Event()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    random = np.random.default_rng(2)
    heights = (hill(600, 800) + random.random((600, 800))).astype(np.float32)
    path = write_raster(tmp_path / "model.tif", heights, tiled=True, blockxsize=64, blockysize=64)
    with Server() as made:
        made.files = {"/dsm/model.tif": path.read_bytes(), "/secret.tif": b"II*\0"}
        thread = threading.Thread(target=made.serve_forever)
        thread.start()
        yield made
        made.released.set()
        made.shutdown()
        thread.join()


def remote(server: Server, path: str = "/dsm/model.tif", **how: Any) -> RemoteFile:
    return RemoteFile(server.address + path, [f"{server.address}/dsm"], **how)


def test_a_part_is_read_by_ranges(server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 4)
    whole = read_dsm(tmp_path / "model.tif")
    file = remote(server)
    model = open_dsm(file)
    part = model.window(300, 500, 40, 50)
    file.close()
    np.testing.assert_array_equal(part.elevation_m, whole.window(300, 500, 40, 50).elevation_m)
    assert model.name == "model.tif"
    assert model.sha256 == file.sha256 != whole.sha256
    assert any("not read as a whole" in text for text in model.warnings)
    assert {path for path, _ in server.asked} == {"/dsm/model.tif"}
    assert all(re.fullmatch(r"bytes=\d+-\d+", span) for _, span in server.asked)


def test_bytes_are_those_of_the_file_and_are_asked_for_once(server: Server) -> None:
    data, file = server.files["/dsm/model.tif"], remote(server)
    assert file.read(0, 10) == data[:10]
    assert file.read(300_000, 600_000) == data[300_000:900_000]
    before = len(server.asked)
    assert file.read(299_990, 500_000) == data[299_990:799_990]
    assert len(server.asked) == before
    assert file.read(len(data) - 5, 100) == data[-5:]
    assert file.read(len(data), 100) == file.read(-1, 5) == b""
    file.close()


@pytest.mark.parametrize(
    "address",
    [
        "http://127.0.0.1:{port}/secret.tif",
        "http://127.0.0.1:{port}/dsm/../secret.tif",
        "http://127.0.0.1:{port}/dsm/%2e%2e/secret.tif",
        "http://127.0.0.1:{port}/dsmother/model.tif",
        "http://127.0.0.1:1/dsm/model.tif",
        "http://localhost:{port}/dsm/model.tif",
        "https://127.0.0.1:{port}/dsm/model.tif",
        "http://127.0.0.1:{port}@169.254.169.254/dsm/model.tif",
        "http://me:secret@127.0.0.1:{port}/dsm/model.tif",
        "http://127.0.0.1:{port}/dsm/model.tif?to=http://127.0.0.1/",
        "http://127.0.0.1:{port}/dsm/model.tif#x",
        "http://127.0.0.1:{port}/dsm/model.tif\r\nHost: other",
        "http://127.0.0.1:port/dsm/model.tif",
        "file:///etc/passwd",
        "ftp://127.0.0.1/dsm/model.tif",
        "/vsicurl/http://127.0.0.1:{port}/dsm/model.tif",
    ],
)
def test_nothing_else_is_asked_for(server: Server, address: str) -> None:
    with pytest.raises(ParameterError) as refused:
        RemoteFile(address.format(port=server.server_port), [f"{server.address}/dsm/"])
    assert "secret@" not in str(refused.value)
    assert server.asked == []


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("redirect", "leads elsewhere"),
        ("no ranges", "does not answer with parts"),
        ("no version", "neither ETag nor Last-Modified"),
        ("hangs up", "cannot be read from"),
        ("silent", "nothing for 0.2 s"),
    ],
)
def test_what_a_server_does_wrong_is_said(server: Server, fault: str, words: str) -> None:
    server.fault = fault
    with pytest.raises(RasterError, match=words):
        remote(server, timeout_s=0.2)
    assert all(path == "/dsm/model.tif" for path, _ in server.asked)


def test_what_goes_wrong_while_it_is_read_is_said(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 4)
    file = remote(server, timeout_s=0.5)
    model = open_dsm(file)
    for fault, version, words in (("other bytes", 1, "other bytes"), ("", 2, "another version")):
        file._blocks.clear()
        server.fault, server.version = fault, version
        with pytest.raises(RasterError, match=words):
            model.window(300, 500, 40, 50)
    file.close()


def test_a_missing_file_and_another_kind_are_said(server: Server) -> None:
    with pytest.raises(RasterError, match="404"):
        remote(server, "/dsm/none.tif")
    server.files["/dsm/page.html"] = b"<html>no</html>"
    with closing(remote(server, "/dsm/page.html")) as page, pytest.raises(RasterFormatError, match="no GeoTIFF"):
        open_dsm(page)
    server.files["/dsm/cut.tif"] = server.files["/dsm/model.tif"][:200]
    with closing(remote(server, "/dsm/cut.tif")) as cut, pytest.raises(RasterError):
        open_dsm(cut)


def test_a_path_that_was_an_address_is_one() -> None:
    assert is_address(Path("https://maps.example/dsm/a.tif"))
    assert not is_address(Path("httpd/a.tif"))
