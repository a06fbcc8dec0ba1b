"""Surface models on a server: by ranges, from allowed addresses only, and every failure in words."""

from __future__ import annotations

import contextlib
import http.server
import os
import re
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.errors import ParameterError, RasterError, RasterFormatError
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.rasters import dsm_file
from planning.terrain.rasters.byte_pipe import Served, served
from planning.terrain.rasters.http_ranges import Look, RemoteFile, is_address
from tests.planning.geotiff_samples import hill, write_raster


class Ranges(http.server.BaseHTTPRequestHandler):
    """Answers with ranges of ``files``; ``fault`` is what it does wrong."""

    protocol_version = "HTTP/1.1"
    server: Any  # a Server: typeshed has it mutable

    def do_GET(self) -> None:
        self.server.asked.append((self.path, self.headers.get("Range", "")))
        data, fault = self.server.files.get(self.path), self.server.fault
        if fault == "silent":
            self.server.reached.set()
            self.server.released.wait(120)
            return
        if fault == "hangs up":
            self.close_connection = True
            return
        if fault == "redirect":
            self._answer(302, b"", {"Location": f"http://127.0.0.1:{self.server.server_port}/secret.tif"})
        elif fault == "drips":
            self._drip()
        elif data is None:
            self._answer(404, b"")
        elif fault == "no ranges":
            self._answer(200, data)
        else:
            self._part(data, fault)

    def _drip(self) -> None:
        """An answer that never ends, of which some comes ever again."""
        self.close_connection = True
        with contextlib.suppress(OSError):
            self.wfile.write(b"HTTP/1.1 206 Partial Content\r\nX: ")
            while not self.server.released.wait(0.02):
                self.wfile.write(b"x")

    def _part(self, data: bytes, fault: str) -> None:
        first, last = map(int, re.findall(r"\d+", self.headers["Range"]))
        whole = {
            "Content-Range": f"bytes {first}-{last}/{len(data)}",
            "ETag": self.server.tag or f'"{self.server.version}"',
        }
        if fault == "no version":
            del whole["ETag"]
        if self.server.written:
            whole["Last-Modified"] = self.server.written
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
        self.fault, self.version, self.tag, self.written = "", 1, "", ""
        self.released, self.reached = threading.Event(), threading.Event()

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
        ("no version", "neither a strong ETag nor Last-Modified"),
        ("drips", "too slow: 0.4 s"),
        ("hangs up", "cannot be read from"),
        ("silent", "nothing for 0.2 s"),
    ],
)
def test_what_a_server_does_wrong_is_said(server: Server, fault: str, words: str) -> None:
    server.fault = fault
    hasty: dict[str, Any] = {"drips": {"request_s": 0.4}, "silent": {"timeout_s": 0.2}}
    with pytest.raises(RasterError, match=words):
        remote(server, **hasty.get(fault, {}))
    assert all(path == "/dsm/model.tif" for path, _ in server.asked)


def test_what_goes_wrong_while_it_is_read_is_said(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 4)
    file = remote(server)
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


@pytest.mark.parametrize("place", [0.3, 0.6, 1.0])
def test_no_read_may_fail_unnoticed(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: float
) -> None:
    """Decoders do without tags that they cannot read: such as scale and offset."""
    path = write_raster(tmp_path / "scaled.tif", hill(), scale=(2.0, 30.0), nodata=-9999.0)
    server.files["/dsm/scaled.tif"] = path.read_bytes()
    real, count, failing = RemoteFile.read, 0, 0

    def read(file: RemoteFile, offset: int, length: int, **how: Any) -> bytes:
        nonlocal count
        count += 1
        if count == failing:
            raise RasterError("The line was lost.")
        return real(file, offset, length, **how)

    monkeypatch.setattr(RemoteFile, "read", read)
    with closing(remote(server, "/dsm/scaled.tif")) as file:
        open_dsm(file)
    count, failing = 0, round(place * count)
    with closing(remote(server, "/dsm/scaled.tif")) as file, pytest.raises(RasterError, match="line was lost"):
        open_dsm(file)
    assert failing > 0


def test_whoever_is_interrupted_waits_for_no_server(server: Server) -> None:
    file = remote(server, timeout_s=300.0)
    look, server.fault = Look(file), "silent"
    began = time.monotonic()
    ends: list[Served] = []

    def interrupted() -> None:
        with served(look.read, look.stop) as end:
            ends.append(end)
            os.write(end.child[1], struct.pack(">QQ", 0, 4))
            assert server.reached.wait(60)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - began < 60.0
    assert "stopped" in str(ends[0].error)
    with pytest.raises(RasterError, match="stopped"):
        look.read(0, 4)
    server.fault = ""
    assert file.read(0, 4) == server.files["/dsm/model.tif"][:4]
    file.close()


def test_a_version_that_may_hide_a_change_is_said(server: Server) -> None:
    server.tag = 'W/"1"'
    with pytest.raises(RasterError, match="neither a strong ETag"):
        remote(server)
    server.written = "Wed, 21 Oct 2026 07:28:00 GMT"
    with closing(remote(server)) as file:
        assert any("same second" in text for text in open_dsm(file).warnings)
        assert "to the second" in file.identified_by
    server.tag = ""
    with closing(remote(server)) as file:
        assert not any("same second" in text for text in open_dsm(file).warnings)
        assert "ETag" in file.identified_by
        assert file._connection is None
