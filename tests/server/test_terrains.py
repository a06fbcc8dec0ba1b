"""Surface models and orthomosaics of the real world through the whole station; deletion and what follows from it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rasterio
from affine import Affine

from planning.terrain.dsm import Dsm
from server.library.terrains import load_terrain
from server.schemas import Computation, PlanDoc, PoiDoc, Snapshot, TerrainDoc, ViewMessage
from tests.planning.geotiff_samples import geotiff, write_raster
from tests.planning.mesh_samples import dsm_of, packed, tileset
from tests.server.station import Station, ok, station

pytestmark = pytest.mark.xdist_group("terrains")

RASTERS = {
    "brighton": "dsm/brighton/brighton_dsm_010.tif",
    "coromandel": "dsm/coromandel/coromandel_dsm_050.tif",
    "campus": "dsm/campus/dsm.tif",
}


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with station(tmp_path_factory.mktemp("data")) as running:
        yield running


@pytest.fixture
def fresh(field: Station) -> Station:
    """With a new plan on no surface model."""
    field.post("/api/plan/new")
    field.change("Nothing", **PlanDoc().model_dump())
    return field


def loaded(field: Station, terrain: TerrainDoc) -> Dsm:
    return load_terrain(field.server.settings.data_dir / "terrains" / terrain.id)


def added(field: Station, name: str, data: bytes, **query: str) -> TerrainDoc:
    known = {terrain.id for terrain in field.library.terrains}
    job = field.upload(name, data, **query)
    assert job.state == "done", job.error
    (terrain,) = [terrain for terrain in field.library.terrains if terrain.id not in known]
    return terrain


def solid_places(dsm: Dsm, size_px: int) -> list[PoiDoc]:
    """Two opposite corners of the known square nearest to the model's middle."""
    known = np.isfinite(dsm.elevation_m)
    total = np.pad(np.cumsum(np.cumsum(known, axis=0, dtype=np.int64), axis=1), ((1, 0), (1, 0)))
    inside = total[size_px:, size_px:] - total[:-size_px, size_px:] - total[size_px:, :-size_px]
    inside = inside + total[:-size_px, :-size_px]
    rows, cols = np.nonzero(inside == size_px**2)
    nearest = np.argmin(np.hypot(rows - known.shape[0] / 2, cols - known.shape[1] / 2))
    corners = [(rows[nearest] + share * size_px, cols[nearest] + share * size_px) for share in (0.3, 0.7)]
    xy_m = np.array([dsm.transform @ (col, row) for row, col in corners])
    places = dsm.lat_lon_from_xy(xy_m).tolist()
    return [PoiDoc(id=f"p{i}", lat_deg=lat, lon_deg=lon, name=f"P{i}") for i, (lat, lon) in enumerate(places)]


def planned(field: Station, pois: list[PoiDoc]) -> Computation:
    document = field.state.document
    surface = document.surface.model_copy(update={"radius_m": 6.0, "height_m": 4.0})
    profile = document.profile.model_copy(update={"position_error_m": 0.1, "rtl_height_m": 100.0})
    field.put(document.model_copy(update={"pois": pois, "surface": surface, "profile": profile}), "Points")
    return field.answer()


@pytest.mark.parametrize("name", RASTERS)
def test_a_real_model_is_read_shown_and_planned_on(fresh: Station, shared_data: Path, name: str) -> None:
    path = shared_data / RASTERS[name]
    terrain = added(fresh, f"{name}.tif", path.read_bytes())
    assert fresh.state.document.terrain_id == terrain.id
    with rasterio.open(path) as source:
        assert (terrain.width_px, terrain.height_px) == (source.width, source.height)
    dsm = loaded(fresh, terrain)
    answer = planned(fresh, solid_places(dsm, round(12.0 / dsm.resolution_m) if name == "brighton" else 30))
    assert answer.state == "ready", answer.error
    assert answer.result is not None
    assert answer.result.min_distance_m is not None
    assert answer.result.min_vertical_m is not None
    assert answer.result.chart.path_rel_home_m


def test_an_orthomosaic_is_draped_only_where_it_belongs(fresh: Station, tmp_path: Path) -> None:
    terrain = added(fresh, "slope.tif", slope())
    picture = tmp_path / "ortho.tif"
    transform = Affine(0.5, 0.0, 500_000.0, 0.0, -0.5, 4_176_000.0)
    with rasterio.open(
        picture,
        "w",
        driver="GTiff",
        height=100,
        width=100,
        count=3,
        dtype="uint8",
        crs="EPSG:32633",
        transform=transform,
    ) as file:
        file.write(np.full((3, 100, 100), 90, dtype=np.uint8))
    job = fresh.upload("ortho.tif", picture.read_bytes(), "orthophotos", terrain_id=terrain.id)
    assert job.state == "done", job.error
    (photo,) = fresh.library.orthophotos
    assert fresh.state.document.orthophoto_id == photo.id
    other = added(fresh, "other.tif", slope())
    fresh.change("Other", terrain_id=other.id, orthophoto_id=None)
    assert fresh.upload("again.tif", picture.read_bytes(), "orthophotos", terrain_id=terrain.id).state == "done"
    assert fresh.state.document.orthophoto_id is None
    answer = fresh.http.post(
        "/api/orthophotos",
        params={"filename": "x.tif", "terrain_id": "nothing"},
        content=b"x",
        headers={"Content-Type": "application/octet-stream"},
    )
    assert answer.status_code == 404
    assert fresh.uploads_left() == []


def test_a_mesh_is_drawn_in_the_models_place_and_deleted_alone(fresh: Station, tmp_path: Path) -> None:
    dsm = dsm_of()
    raster = write_raster(tmp_path / "dsm.tif", np.array(dsm.elevation_m), crs="EPSG:32633", transform=dsm.transform)
    terrain = added(fresh, "under.tif", raster.read_bytes())
    data = packed(tmp_path / "survey.zip", tileset(dsm)).read_bytes()
    assert fresh.upload("first.zip", data).state == "done"
    assert fresh.upload("second.zip", data).state == "done"
    (mesh,) = fresh.library.meshes
    assert (mesh.name, mesh.terrain_id) == ("second.zip", terrain.id)
    assert (
        fresh.until(lambda m: isinstance(m, ViewMessage) and m.view.textured_state == "drawn").view.show_mesh is False
    )
    folder = fresh.server.settings.data_dir / "meshes"
    assert [each.name for each in folder.iterdir()] == [mesh.id]

    assert fresh.http.delete(f"/api/meshes/{mesh.id}").status_code == 204
    view = fresh.until(lambda m: isinstance(m, ViewMessage) and m.view.textured_state == "none").view
    assert (view.show_textured, view.show_mesh, view.textured_triangles) == (False, True, 0)
    assert (fresh.library.meshes, list(folder.iterdir())) == ([], [])
    assert terrain in fresh.library.terrains
    assert fresh.http.delete(f"/api/meshes/{mesh.id}").status_code == 404


def test_a_mesh_of_another_model_is_deleted_and_the_view_stays(fresh: Station, tmp_path: Path) -> None:
    dsm = dsm_of()
    raster = write_raster(tmp_path / "dsm.tif", np.array(dsm.elevation_m), crs="EPSG:32633", transform=dsm.transform)
    added(fresh, "under.tif", raster.read_bytes())
    assert fresh.upload("survey.zip", packed(tmp_path / "survey.zip", tileset(dsm)).read_bytes()).state == "done"
    other = added(fresh, "other.tif", slope())
    fresh.change("Other", terrain_id=other.id)
    before = Snapshot.model_validate_json(fresh.http.get("/api/state").text).view
    assert before.show_textured
    (mesh,) = fresh.library.meshes
    assert fresh.http.delete(f"/api/meshes/{mesh.id}").status_code == 204
    assert fresh.library.meshes == []
    assert Snapshot.model_validate_json(fresh.http.get("/api/state").text).view.show_textured


def test_spikes_are_removed_into_a_model_of_its_own(fresh: Station) -> None:
    terrain = added(fresh, "spiky.tif", slope(spike_m=80.0))
    assert terrain.spikes
    started = ok(fresh.http.post(f"/api/terrains/{terrain.id}/remove_spikes"))
    assert fresh.ended(started.json()["id"]).state == "done"
    document = fresh.state.document
    assert document.terrain_id != terrain.id
    clean = next(t for t in fresh.library.terrains if t.id == document.terrain_id)
    assert clean.max_m < terrain.max_m - 50
    assert fresh.http.post("/api/terrains/nothing/remove_spikes").status_code == 404


def test_undo_to_a_deleted_model_says_so_and_can_be_mended(fresh: Station) -> None:
    gone = added(fresh, "gone.tif", slope())
    pois = solid_places(loaded(fresh, gone), 20)
    assert planned(fresh, pois).state == "ready"
    kept = added(fresh, "kept.tif", slope())
    fresh.change("Other model", terrain_id=kept.id)
    assert fresh.http.delete(f"/api/terrains/{gone.id}").status_code == 204
    undone = fresh.post("/api/plan/undo")
    assert undone.document.terrain_id == gone.id
    answer = fresh.answer()
    assert answer.error is not None
    assert answer.error.what == "The surface model of this plan has been deleted."
    # Still a plan that can be edited.
    assert fresh.change("Rename", name="Mended").document.name == "Mended"
    refused = fresh.http.get("/api/plan/export/all.zip")
    assert refused.status_code == 404
    fresh.change("Mend", terrain_id=kept.id)
    assert fresh.answer().state == "ready"


def test_reading_a_large_model_does_not_hold_up_an_edit(fresh: Station) -> None:
    terrain = added(fresh, "small.tif", slope())
    pois = solid_places(loaded(fresh, terrain), 20)
    assert planned(fresh, pois).state == "ready"
    rows, cols = np.mgrid[0:2500, 0:2500]
    large = geotiff(100 + 10 * np.sin(rows / 50) + 5 * np.cos(cols / 70))
    job = ok(
        fresh.http.post(
            "/api/terrains",
            params={"filename": "large.tif"},
            content=large,
            headers={"Content-Type": "application/octet-stream"},
        )
    ).json()
    fresh.change("Rename", name="While it reads")
    assert fresh.answer().state == "ready"
    assert fresh.ended(job["id"]).state == "done"
    # The plan has points on its own model: it keeps it.
    assert fresh.state.document.terrain_id == terrain.id


def slope(*, spike_m: float = 0.0) -> bytes:
    elevation = np.add.outer(np.arange(60.0), np.arange(50.0)) * 0.1 + 100.0
    elevation[30, 25] += spike_m
    return geotiff(elevation)
