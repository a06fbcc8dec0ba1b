"""What is stored comes back, damage is set aside, a full disk loses nothing, and a kill at any moment neither."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.errors import NoElevationError
from planning.terrain.dsm import Dsm
from planning.terrain.orthophoto import Orthophoto
from server.errors import DataDirError, NotFoundError, StorageError, StorageFullError
from server.library import Library
from server.library.history import History
from server.library.orthophotos import store_orthophoto
from server.library.terrains import load_terrain, store_terrain
from server.schemas import PlanDoc, PoiDoc, SpikeDoc

UTM = CRS.from_epsg(32760)


def dsm(rows: int = 4, columns: int = 6) -> Dsm:
    heights = np.arange(rows * columns, dtype=np.float32).reshape(rows, columns)
    heights[0, 0] = np.nan
    return Dsm(heights, Affine(0.5, 0, 400_000.0, 0, -0.5, 5_900_000.0), UTM, "EGM96 height", "ab" * 32)


@pytest.fixture
def library(tmp_path: Path) -> Iterator[Library]:
    opened = Library(tmp_path / "data")
    yield opened
    opened.close()


def reopened(library: Library) -> Library:
    library.close()
    return Library(library.root)


def named(name: str, **fields: object) -> History:
    return History([PlanDoc.model_validate({"name": name, **fields})])


def test_a_surface_model_comes_back_mapped(library: Library) -> None:
    spike = SpikeDoc(lat_deg=1, lon_deg=2, size_m=0.5, height_m=30)
    doc = store_terrain(library.root, dsm(), name="hill <b>", spikes=[spike], warnings=["odd"])
    assert library.terrains() == []
    library.refresh()
    (listed,) = library.terrains()
    assert listed == doc
    assert (doc.width_px, doc.height_px, doc.min_m, doc.max_m) == (6, 4, 1.0, 23.0)
    assert doc.unknown_share == pytest.approx(1 / 24)
    assert len(doc.corner_lat_lon_deg) == 4
    loaded = library.load_terrain(doc.id)
    assert isinstance(loaded.elevation_m, np.memmap)
    np.testing.assert_array_equal(loaded.elevation_m, dsm().elevation_m)
    assert (loaded.transform, loaded.crs, loaded.vertical_datum) == (dsm().transform, UTM, "EGM96 height")
    again = reopened(library)
    assert again.terrains() == [doc]
    again.delete_terrain(doc.id)
    assert again.terrains() == []
    again.close()


def test_an_orthophoto_goes_with_its_surface_model(library: Library) -> None:
    terrain = store_terrain(library.root, dsm(), name="hill")
    rgb = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    known = np.eye(4, 5, dtype=bool)
    photo = Orthophoto(rgb=rgb, known=known, bounds_m=(0.0, 0.0, 5.0, 4.0), crs=UTM)
    doc = store_orthophoto(library.root, photo, name="photo", terrain_id=terrain.id)
    library.refresh()
    loaded = library.load_orthophoto(doc.id)
    np.testing.assert_array_equal(loaded.rgb, rgb)
    np.testing.assert_array_equal(loaded.known, known)
    assert loaded.bounds_m == (0.0, 0.0, 5.0, 4.0)
    library.delete_terrain(terrain.id)
    assert library.orthophotos() == []


def test_plans_come_back_with_their_history(library: Library) -> None:
    history = named("one")
    history.edit("Rename", PlanDoc(name="two", terrain_id="t1"), coalesce=False, now_mono_s=0)
    plan_id, _ = library.create_plan(named("other"))
    library.save_plan(plan_id, history)
    library.remember_plan(plan_id)
    again = reopened(library)
    assert again.last_plan() == plan_id
    loaded = again.load_plan(plan_id)
    assert (loaded.present.name, loaded.undo_label) == ("two", "Rename")
    assert [(entry.name, entry.saved_utc) for entry in again.plans()] == [("two", again.saved_utc(plan_id))]
    assert again.plans_using("t1") == ["two"]
    again.delete_plan(plan_id)
    assert again.last_plan() is None
    again.close()


@pytest.mark.parametrize("name", ["..", "../../etc", "/etc", "a/b", "", "x" * 40, "A", "a\0b", ".tmp-x"])
def test_only_generated_ids_name_anything(library: Library, name: str) -> None:
    for ask in (library.terrain_dir, library.orthophoto_dir, library.load_plan, library.delete_plan):
        with pytest.raises(NotFoundError):
            ask(name)
    with pytest.raises(NotFoundError):
        library.save_plan(name, History())


def test_damage_is_set_aside_and_told(library: Library) -> None:
    good, _ = library.create_plan(named("good"))
    torn, _ = library.create_plan(named("torn"))
    twisted, _ = library.create_plan(named("twisted"))
    terrain = store_terrain(library.root, dsm(), name="hill")
    manifest = library.root / "plans" / torn / "manifest.json"
    manifest.write_bytes(manifest.read_bytes()[:40])
    other = library.root / "plans" / twisted / "manifest.json"
    stored = json.loads(other.read_text())
    other.write_text(json.dumps({**stored, "history": {**stored["history"], "position": 7}}))
    (library.root / "terrains" / terrain.id / "manifest.json").unlink()
    again = reopened(library)
    assert {entry.id for entry in again.plans()} == {good, twisted}
    assert again.terrains() == []
    with pytest.raises(StorageError, match="damaged"):
        again.load_plan(twisted)
    assert {entry.id for entry in again.plans()} == {good}
    assert len(again.notices) == 3
    kept = {path.name.rsplit("-", 1)[0] for path in (again.root / "set-aside").iterdir()}
    assert kept == {f"plans-{torn}", f"plans-{twisted}", f"terrains-{terrain.id}"}
    again.close()


def test_a_damaged_array_is_an_error_not_a_crash(library: Library) -> None:
    doc = store_terrain(library.root, dsm(), name="hill")
    file = library.root / "terrains" / doc.id / "elevation.npy"
    file.write_bytes(file.read_bytes()[:-4])
    with pytest.raises(StorageError, match="damaged"):
        load_terrain(file.parent)


def test_an_all_unknown_model_is_refused(library: Library) -> None:
    empty = dsm().with_elevation(np.full((4, 6), np.nan, np.float32))
    with pytest.raises(NoElevationError):
        store_terrain(library.root, empty, name="void")


def test_a_full_disk_loses_nothing(library: Library, monkeypatch: pytest.MonkeyPatch) -> None:
    plan_id, _ = library.create_plan(named("kept"))

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as disk:
        disk.setattr(os, "fsync", full)
        for attempt in (
            lambda: library.save_plan(plan_id, named("lost")),
            lambda: library.create_plan(named("lost")),
            lambda: store_terrain(library.root, dsm(), name="lost"),
        ):
            with pytest.raises(StorageFullError):
                attempt()
    assert [entry.name for entry in library.plans()] == ["kept"]
    assert [path.name for path in library.root.rglob(".tmp-*")] == []
    assert library.load_plan(plan_id).present.name == "kept"
    library.save_plan(plan_id, named("after"))
    assert library.load_plan(plan_id).present.name == "after"


def test_a_second_instance_is_refused(library: Library) -> None:
    with pytest.raises(DataDirError, match=rf"process {os.getpid()}\b"):
        Library(library.root)


def test_a_data_directory_that_cannot_be_made_is_a_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataDirError, match="cannot be written"):
        Library(tmp_path / "file" / "data")


def test_leftovers_and_uploads_are_cleared_at_start(library: Library) -> None:
    (library.root / "plans" / ".tmp-half").mkdir()
    (library.root / ".tmp-note").write_text("")
    library.new_upload(".tif").write_bytes(b"x")
    again = reopened(library)
    assert [*again.root.rglob(".tmp-*"), *(again.root / "uploads").iterdir()] == []
    again.close()


def test_own_profiles_join_the_shipped_ones(library: Library) -> None:
    shipped = {entry.id for entry in library.profiles()}
    (library.root / "profiles" / "mine.toml").write_text('name = "Mine"\nradius_m = 0.5\n')
    (library.root / "profiles" / "bad.toml").write_text("radius_m = -1")
    again = reopened(library)
    assert {entry.id for entry in again.profiles()} == shipped | {"mine"}
    assert any("bad.toml" in notice.where for notice in again.notices)
    again.close()


WRITER = """
import sys
from pathlib import Path
from server.library.history import History
from server.library import Library
from server.schemas import PlanDoc, PoiDoc
library = Library(Path(sys.argv[1]))
plan_id = library.last_plan()
if plan_id is None:
    plan_id, _ = library.create_plan(History())
    library.remember_plan(plan_id)
number = len(library.load_plan(plan_id).present.pois)
while True:
    number += 1
    pois = [PoiDoc(id=str(k), lat_deg=1, lon_deg=2) for k in range(number)]
    library.save_plan(plan_id, History([PlanDoc(name=str(number), pois=pois)]))
    library.create_plan(History([PlanDoc(name=str(number))]))
    print(number, flush=True)
"""


def test_a_kill_at_any_moment_loses_nothing_acknowledged(tmp_path: Path) -> None:
    data = tmp_path / "data"
    for round_number in range(4):
        acknowledged = _killed_after(data, saves=3 + 2 * round_number)
        library = Library(data)
        plan_id = library.last_plan()
        assert plan_id is not None
        present = library.load_plan(plan_id).present
        assert len(present.pois) >= acknowledged
        assert present.name == str(len(present.pois))
        assert sum(entry.name == str(acknowledged) and entry.id != plan_id for entry in library.plans()) >= 1
        assert library.notices == []
        library.close()


def _killed_after(data: Path, *, saves: int) -> int:
    """The last save that a writer acknowledged before it was killed."""
    with subprocess.Popen([sys.executable, "-c", WRITER, str(data)], stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        lines = [writer.stdout.readline() for _ in range(saves)]
        writer.send_signal(signal.SIGKILL)
        lines += writer.stdout.readlines()
    return int(lines[-1])


def test_poi_documents_survive_unchanged(library: Library) -> None:
    document = PlanDoc(pois=[PoiDoc(id="a", lat_deg=-36.123456789012, lon_deg=175.5, name="“”<>&\u2028")])
    plan_id, _ = library.create_plan(History([document]))
    assert library.load_plan(plan_id).present == document
