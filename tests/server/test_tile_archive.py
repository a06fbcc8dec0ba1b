"""A dropped ZIP of tiles becomes one surface model; one that cannot be unpacked is said and leaves nothing."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import signal
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from planning.errors import RasterError, RasterFormatError
from server.errors import BadRequestError, JobCancelledError, TooLargeError
from server.library import Library
from server.library.terrains import FOLDER, UNKNOWN_ORIGIN, load_terrain
from server.plan import archives, tile_archive
from server.plan.file_tasks import import_terrain
from server.schemas import TerrainDoc
from server.work.jobs import Lane
from tests.planning.geotiff_samples import HALF_METRE, hill, write_raster


@pytest.fixture
def tiles(tmp_path: Path) -> Path:
    folder = tmp_path / "tiles"
    folder.mkdir()
    write_raster(folder / "a.tif", hill()[:, :30])
    write_raster(folder / "b.tif", hill()[:, 28:], transform=HALF_METRE @ type(HALF_METRE).translation(28, 0))
    return folder


def packed(tmp_path: Path, members: dict[str, bytes]) -> Path:
    upload = tmp_path / "uploads" / "0123abcd.zip"
    upload.parent.mkdir(exist_ok=True)
    with zipfile.ZipFile(upload, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return upload


def imported(root: Path, upload: Path) -> TerrainDoc:
    (root / FOLDER).mkdir(exist_ok=True)
    doc = import_terrain(
        root,
        upload,
        "Etna.zip",
        origin=UNKNOWN_ORIGIN,
        crs=None,
        z_scale=None,
        vertical_datum=None,
        remove_spikes=False,
        cell_m=None,
        keep_noise=False,
        report=lambda step, share: None,
    )
    assert isinstance(doc, TerrainDoc)
    return doc


def test_its_tiles_are_one_model(tmp_path: Path, tiles: Path) -> None:
    members = {f"../../{path.name}": path.read_bytes() for path in tiles.iterdir()}
    upload = packed(tmp_path, {**members, "__MACOSX/._a.tif": b"x", "notes.txt": b"x", "deep/": b""})
    doc = imported(tmp_path, upload)
    assert (doc.name, doc.width_px, doc.height_px) == ("Etna.zip", 50, 40)
    np.testing.assert_array_equal(load_terrain(tmp_path / FOLDER / doc.id).elevation_m, hill())
    assert list(upload.parent.iterdir()) == [upload]
    assert sorted(path.name for path in tmp_path.iterdir()) == [FOLDER, "tiles", "uploads"]


def test_a_tile_that_does_not_fit_is_named(tmp_path: Path, tiles: Path) -> None:
    write_raster(tiles / "c.tif", hill(), crs="EPSG:32634")
    upload = packed(tmp_path, {path.name: path.read_bytes() for path in tiles.iterdir()})
    with pytest.raises(RasterFormatError, match=r"c\.tif|a\.tif") as refused:
        imported(tmp_path, upload)
    assert refused.value.where == "Etna.zip"
    assert "0123abcd" not in str(refused.value)
    assert list(upload.parent.iterdir()) == [upload]


def test_what_cannot_be_unpacked_is_said(tmp_path: Path, tiles: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tile = (tiles / "a.tif").read_bytes()
    with pytest.raises(RasterFormatError, match=r"^Etna.zip: There is no GeoTIFF"):
        imported(tmp_path, packed(tmp_path, {"points.csv": b"x", "list.vrt": b"<VRTDataset/>"}))
    whole = packed(tmp_path, {"a.tif": tile})
    data = whole.read_bytes()
    for broken in (data[: len(data) // 2], data[:60] + b"\xff" * 40 + data[100:], _encrypted(data)):
        whole.write_bytes(broken)
        with pytest.raises(BadRequestError, match=r"^Etna.zip: The archive cannot be unpacked"):
            imported(tmp_path, whole)
    monkeypatch.setattr(tile_archive, "_MOST_BYTES", len(tile) - 1)
    with pytest.raises(TooLargeError, match=r"^Etna.zip: Unpacked its files take .* there is room for"):
        imported(tmp_path, packed(tmp_path, {"a.tif": tile}))
    monkeypatch.setattr(tile_archive, "MOST_TILES", 1)
    with pytest.raises(RasterError, match=r"^Etna.zip: It has more than 1 tiles"):
        imported(tmp_path, packed(tmp_path, {"a.tif": b"", "b.tif": b""}))
    assert list(whole.parent.iterdir()) == [whole]


def test_an_entry_that_says_less_than_it_holds_is_not_unpacked_beyond_it(tmp_path: Path) -> None:
    upload = packed(tmp_path, {"a.tif": b"\0" * 1_000_000})
    data = bytearray(upload.read_bytes())
    at = data.index(b"PK\1\2")
    data[at + 24 : at + 28] = struct.pack("<I", 1000)
    upload.write_bytes(bytes(data))
    with pytest.raises(BadRequestError, match="unpacked"):
        imported(tmp_path, upload)
    assert list(upload.parent.iterdir()) == [upload]


def test_a_killed_worker_leaves_nothing_that_stays(tmp_path: Path) -> None:
    """Neither after the job's own clearing up, nor after a start without one."""
    library = Library(tmp_path / "data")
    upload = library.new_upload(".zip")
    with zipfile.ZipFile(upload, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("a.tif", bytes(400_000_000))
    asyncio.run(_killed(upload))
    (left,) = [path for path in upload.parent.iterdir() if path.is_dir()]
    again = shutil.copytree(left, left.with_name(f"{left.name}-again"))
    others = upload.with_name("fedcba98.zip")
    others.write_bytes(b"x")
    archives.remove_upload(upload)
    assert [path.exists() for path in (upload, left, again)] == [False, False, False]
    assert others.exists()
    shutil.copytree(tmp_path, left, ignore=shutil.ignore_patterns("data"))
    library.close()
    with contextlib.closing(Library(library.root)):
        assert list((library.root / "uploads").iterdir()) == []


async def _killed(upload: Path) -> None:
    """A lane that is cancelled while its worker unpacks."""
    lane = Lane("test")

    def progress(step: str, share: float | None) -> None:
        if step == "Unpacking" and share:
            assert lane._worker is not None
            os.kill(lane._worker._process.pid, signal.SIGSTOP)  # however late the next line is, it has not ended
            lane.cancel()

    try:
        with pytest.raises(JobCancelledError):
            await lane.call(
                import_terrain, upload.parent, upload, "Etna.zip", origin=UNKNOWN_ORIGIN, crs=None, z_scale=None,
                vertical_datum=None, remove_spikes=False, cell_m=None, keep_noise=False, progress=progress,
            )  # fmt: skip
    finally:
        await lane.close()


def _encrypted(data: bytes) -> bytes:
    """With the flag of a password in the directory's entry and the file's."""
    out = bytearray(data)
    for magic, at in ((b"PK\1\2", 8), (b"PK\3\4", 6)):
        out[out.index(magic) + at] |= 1
    return bytes(out)
