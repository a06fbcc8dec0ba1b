"""The models of a catalogue: which of them is better, which do not fit, and what is planned over a seam."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import PathParams, Poi, SurfaceParams, VehicleProfile
from planning.certificate.clearance import certify
from planning.errors import ParameterError, RasterError
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.catalogue import models
from planning.terrain.catalogue.best import seam_m
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import Opened
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import open_models_of
from planning.terrain.rasters.header import RasterLimits
from tests.planning.catalogue_samples import NORTH_M, WEST_M, in_memory, item
from tests.planning.geotiff_samples import write_raster

FLAT = np.full((8, 8), 3.0, np.float32)


def test_the_newest_of_good_ones_is_the_best_and_the_most_exact_of_others() -> None:
    ranked = [
        in_memory(FLAT, name="newest good", rms_m=0.5, year=2026),
        in_memory(FLAT, name="older good", rms_m=0.02, year=2020),
        in_memory(FLAT, name="good of no date", rms_m=0.02, year=None),
        in_memory(FLAT, name="newer bad", rms_m=0.6, year=2027),
        in_memory(FLAT, name="newest bad", rms_m=3.0, year=2028),
    ]
    assert sorted(ranked[2:] + ranked[:2], key=lambda model: model.order) == ranked


def test_files_are_opened_judged_and_told(tmp_path: Path) -> None:
    write_raster(tmp_path / "new.tif", FLAT)
    item(tmp_path, "new.tif", name="new", datetime="2024-05-01T10:00:00Z", hedgehop__vertical_rms_m=0.1)
    write_raster(tmp_path / "old.tif", FLAT + 1, transform=Affine(1.0, 0.0, WEST_M, 0.0, -1.0, NORTH_M))
    write_raster(tmp_path / "late.tif", FLAT)
    item(tmp_path, "late.tif", datetime="2999-01-01T00:00:00Z", hedgehop__vertical_rms_m=0.6)
    write_raster(tmp_path / "elsewhere.tif", FLAT, crs="EPSG:32634")
    write_raster(tmp_path / "other_datum.tif", FLAT, tags={"HEDGEHOP_VERTICAL_DATUM": "ellipsoid"})
    write_raster(tmp_path / "site_dtm.tif", FLAT)
    (tmp_path / "broken.tif").write_bytes(b"II*\0 and no more")
    found = open_models_of(tmp_path, vertical_datum="EGM96 height")
    assert [model.name for model in found.models] == ["new", "late", "old"]
    # What nobody told: one cell, and no better than the worst that was told.
    assert [(model.rms_m, model.rms_told) for model in found.models] == [(0.1, True), (0.6, True), (1.0, False)]
    why = {out.name: out.why for out in found.left_out}
    assert set(why) == {"elsewhere", "other_datum", "site_dtm.tif", "broken.tif"}
    assert "32634" in why["elsewhere"] or "zone 34N" in why["elsewhere"]
    assert "ellipsoid" in why["other_datum"]
    assert "terrain model" in why["site_dtm.tif"]
    assert any("lies in the future" in note for note in found.warnings)
    assert (found.resolution_m, found.height_px, found.width_px) == (0.5, 16, 16)
    west_m = found.elevation_at(np.array([[WEST_M + 1.0, NORTH_M - 1.0], [WEST_M + 7.0, NORTH_M - 1.0]]))
    # Over "new" the older ones count too, so near its edge; all are raised by what their error is more.
    np.testing.assert_allclose(west_m, 4.0 + 3 * (1.0 - 0.1), atol=1e-5)
    assert found.rms_m == 0.1
    write_raster(tmp_path / "new.tif", FLAT + 2)
    with pytest.raises(RasterError, match="changed"):
        Catalogue(Opened(found.models, (), ()), "again", RasterLimits()).window(0, 0, 16, 16)


@pytest.mark.parametrize("document", [False, True])
def test_any_folder_of_a_terrain_model_says_what_it_is(tmp_path: Path, *, document: bool) -> None:
    """Newer tiles of the ground alone hid the trees of the surface model."""
    named = []
    for kind, year, high_m in (("dtm", 2024, 0.0), ("dsm", 2019, 25.0)):
        folder = tmp_path / kind / str(year)
        folder.mkdir(parents=True)
        write_raster(folder / "tile.tif", FLAT + high_m, tags={"HEDGEHOP_VERTICAL_DATUM": "EGM2008 height"})
        told = item(folder, "tile.tif", datetime=f"{year}-01-01T00:00:00Z", hedgehop__vertical_rms_m=0.1)
        named.append({"rel": "item", "href": told.relative_to(tmp_path).as_posix()})
    catalog = tmp_path / "catalog.json"
    catalog.write_text(json.dumps({"type": "Catalog", "stac_version": "1.1.0", "id": "all", "links": named}))
    found = open_models_of(catalog if document else tmp_path)
    assert [model.file.bounds_m for model in found.models] == [found.bounds_m]
    assert float(np.nanmin(found.whole().elevation_m)) == 28.0
    assert sum("terrain model" in out.why for out in found.left_out) == 1
    with pytest.raises(RasterError, match="terrain model"):
        open_models_of(tmp_path / "dtm")


@pytest.mark.parametrize(
    ("said", "place_m"),
    [({}, 0.0), ({"hedgehop__horizontal_rms_m": 0.1}, 0.3), ({"gsd": 2.0}, 2.0), ({"gsd": 0.5}, 0.0)],
)
def test_what_is_told_of_the_place_counts(tmp_path: Path, said: dict[str, Any], place_m: float) -> None:
    write_raster(tmp_path / "a.tif", FLAT)
    item(tmp_path, "a.tif", **said)
    assert open_models_of(tmp_path).place_m == pytest.approx(place_m)


def test_a_part_that_is_too_large_names_the_model_whose_cells_make_it_so() -> None:
    coarse, fine = in_memory(FLAT, cell_m=50.0, name="survey"), in_memory(FLAT, cell_m=0.1, east_m=900.0, name="tiny")
    catalogue = Catalogue(Opened((coarse, fine), (), ()), "maps", RasterLimits(max_px=10_000))
    with pytest.raises(RasterError) as error:
        catalogue.window(0, 0, 200, 200)
    assert error.value.where == "maps, at the cells of tiny, the finest model here (0.1 m)"


def test_a_catalogue_of_nothing_that_can_be_used_says_why(tmp_path: Path) -> None:
    (tmp_path / "broken.tif").write_bytes(b"II*\0 and no more")
    with pytest.raises(RasterError, match=r"no surface model that can be used\. broken\.tif: "):
        open_models_of(tmp_path)


def test_what_is_declared_is_of_those_that_say_nothing(tmp_path: Path) -> None:
    write_raster(tmp_path / "bare.tif", FLAT, crs=None)
    write_raster(tmp_path / "own.tif", FLAT, tags={"HEDGEHOP_VERTICAL_DATUM": "ellipsoid"})
    write_raster(tmp_path / "contrary.tif", FLAT, tags={"HEDGEHOP_VERTICAL_DATUM": "ellipsoid"})
    item(tmp_path, "contrary.tif", hedgehop__vertical_datum="EGM96 height")
    item(tmp_path, "bare.tif", datetime="2024-05-01T10:00:00Z")
    found = open_models_of(tmp_path, crs="EPSG:32633", vertical_datum="EGM96 height")
    assert [(model.name, model.vertical_datum) for model in found.models] == [("bare", "EGM96 height")]
    assert {out.name for out in found.left_out} == {"own", "contrary.tif"}
    with pytest.raises(ParameterError, match="height scale"):
        open_models_of(tmp_path, z_scale=0.01)


def test_models_whose_datum_nobody_tells_are_not_joined(tmp_path: Path) -> None:
    """One was above the ellipsoid, one above the sea: a plan was certified 28 m below the ground."""
    write_raster(tmp_path / "new.tif", FLAT)
    item(tmp_path, "new.tif", datetime="2024-05-01T10:00:00Z")
    write_raster(tmp_path / "old.tif", FLAT + 28)
    alone = open_models_of(tmp_path)
    assert [model.name for model in alone.models] == ["new"]
    assert [(out.name, "not told" in out.why) for out in alone.left_out] == [("old", True)]
    assert float(np.nanmax(alone.whole().elevation_m)) == 3.0
    both = open_models_of(tmp_path, vertical_datum="EGM96 height")
    assert [model.name for model in both.models] == ["new", "old"]
    item(tmp_path, "new.tif", datetime="2024-05-01T10:00:00Z", hedgehop__vertical_datum="EGM96 height")
    assert [model.name for model in open_models_of(tmp_path).models] == ["new"]


@pytest.mark.parametrize(
    ("datum", "joined"), [("EGM2008 height", True), ("ellipsoid", True), ("local", False), ("unknown", False)]
)
def test_models_are_joined_only_in_a_datum_that_both_can_mean(tmp_path: Path, datum: str, *, joined: bool) -> None:
    for name in ("new", "old"):
        write_raster(tmp_path / f"{name}.tif", FLAT, tags={"HEDGEHOP_VERTICAL_DATUM": datum})
    assert len(open_models_of(tmp_path).models) == 1 + joined
    # Who asks may know that two surveys of a site have the same zero.
    assert len(open_models_of(tmp_path, vertical_datum=datum).models) == 2


def test_only_ellipsoids_that_are_named_and_known_are_one_datum() -> None:
    """Bessel's and that of WGS 84 lie hundreds of metres apart."""
    one, utm, bessel = models._is_one_datum, CRS.from_epsg(32633), CRS.from_epsg(31467)
    assert one("WGS 84 ellipsoid", "GRS80 ellipsoid", None)
    assert not one("Bessel 1841 ellipsoid", "WGS 84 ellipsoid", None)
    assert not one("Bessel 1841 ellipsoid", "WGS 84 ellipsoid", "WGS 84 ellipsoid")
    assert not one("ETRS89 ellipsoid", "GDA94 ellipsoid", None)
    assert one("Bessel 1841 ellipsoid", "Bessel 1841 ellipsoid", "Bessel 1841 ellipsoid")
    assert not one("EGM96 height", "WGS 84 ellipsoid", "EGM96 height")
    assert models._named("ellipsoid", utm) == "WGS 84 ellipsoid"
    assert not one(models._named("ellipsoid", bessel), "WGS 84 ellipsoid", None)


@pytest.mark.parametrize(("unit", "in_file", "used"), [("ftUS", None, 0), ("m", None, 1), ("ft", "ft", 1)])
def test_an_item_that_tells_another_unit_than_the_file_leaves_it_out(
    tmp_path: Path, unit: str, in_file: str | None, used: int
) -> None:
    more: dict[str, Any] = {"unit": in_file} if in_file else {}
    write_raster(tmp_path / "a.tif", FLAT, **more)
    item(tmp_path, "a.tif", hedgehop__vertical_datum=f"NAVD88 height ({unit})")
    write_raster(tmp_path / "b.tif", FLAT, tags={"HEDGEHOP_VERTICAL_DATUM": "NAVD88 height"})
    found = open_models_of(tmp_path)
    assert [model.name for model in found.models if model.name == "a"] == ["a"] * used
    assert any("file's own unit is 1 m" in out.why for out in found.left_out) == (not used)


def test_cells_of_a_turned_raster_count_where_they_lie(tmp_path: Path) -> None:
    random = np.random.default_rng(8)
    write_raster(tmp_path / "near.tif", random.uniform(0, 9, (8, 8)).astype(np.float32))
    rough = random.uniform(20, 40, (12, 12)).astype(np.float32)
    turned = Affine.translation(WEST_M + 30.0, NORTH_M) @ Affine.rotation(-31.0) @ Affine.scale(1.5, -1.5)
    write_raster(tmp_path / "turned.tif", rough, transform=turned)
    found = open_models_of(tmp_path, vertical_datum="EGM96 height")
    raised_m = next(layer.raise_m for layer in found.layers if layer.model.name == "turned")
    columns, rows = np.meshgrid(np.arange(2, 10), np.arange(2, 10))
    for shift in (0.02, 0.5, 0.98):
        places = zip(columns.ravel() + shift, rows.ravel() + shift, strict=True)
        heights = found.elevation_at(np.array([turned @ (float(x), float(y)) for x, y in places]))
        assert (heights >= rough[2:10, 2:10].ravel() + raised_m - 1e-3).all()


def test_cells_in_degrees_count_where_they_lie(tmp_path: Path) -> None:
    """Bent and oblong in metres: every one of them stands under the surface where it is the only model."""
    random = np.random.default_rng(5)
    write_raster(tmp_path / "near.tif", random.uniform(0, 9, (8, 8)).astype(np.float32))
    rough = random.uniform(20, 40, (12, 12)).astype(np.float32)
    west, north = 15.0, 37.6775
    write_raster(tmp_path / "far.tif", rough, crs="EPSG:4326", transform=Affine(3e-5, 0.0, west, 0.0, -2e-5, north))
    found = open_models_of(tmp_path, vertical_datum="EGM96 height")
    assert {model.name for model in found.models} == {"near", "far"}, found.warnings
    raised_m = next(layer.raise_m for layer in found.layers if layer.model.name == "far")
    columns, rows = np.meshgrid(np.arange(1, 11), np.arange(1, 11))
    for shift in (0.02, 0.5, 0.98):
        places = [north - 2e-5 * (rows.ravel() + shift), west + 3e-5 * (columns.ravel() + shift)]
        heights = found.elevation_at(found.xy_from_lat_lon(np.column_stack(places).astype(np.float64)))
        assert (heights >= rough[1:11, 1:11].ravel() + raised_m - 1e-3).all()


def poi(model: Catalogue, east_m: float, south_m: float) -> Poi:
    lat_deg, lon_deg = model.lat_lon_from_xy(np.array([[WEST_M + east_m, NORTH_M - south_m]]))[0]
    return Poi(float(lat_deg), float(lon_deg))


def test_a_plan_over_a_seam_is_certified_against_the_worse_of_both() -> None:
    new, old = np.zeros((80, 80), np.float32), np.zeros((80, 160), np.float32)
    old[38:42, 88:90] = 9.0  # beyond the new model's edge
    old[38:42, 70:72] = 12.0  # 8 m inside of it, where the new one says nothing stands
    old[38:42, 30:32] = 15.0  # far inside: it was taken down since
    newest = in_memory(new, cell_m=1.0, rms_m=0.05, horizontal_m=0.5, year=2026, name="new")
    older = in_memory(old, cell_m=1.0, rms_m=0.15, horizontal_m=0.5, year=2015, name="old")
    catalogue = Catalogue(Opened((newest, older), (), ()), "both", RasterLimits())
    request = PlanRequest(
        pois=(poi(catalogue, 20.5, 40.5), poi(catalogue, 140.5, 40.5)),
        profile=VehicleProfile("quad", rtl_height_m=60.0, position_error_m=0.5),
        surface=SurfaceParams(8.0, 8.0),
        path=PathParams(step_m=0.5),
    )
    plan = plan_mission(catalogue, request)
    # By hand: new raised by nothing, old by 3 x (0.15 - 0.05) m; both within the reach of the seam.
    reach_px = int(seam_m(newest, older))
    by_hand = old + np.float32(0.3)
    by_hand[:, : 80 - reach_px] = 0.0
    by_hand[:, 80 - reach_px : 80] = np.maximum(by_hand[:, 80 - reach_px : 80], 0.0)
    slow = Dsm(by_hand, catalogue.transform, catalogue.crs, None, "")
    expected = certify(slow, plan.line, request.clearance())
    assert plan.certificate.min_distance_m <= expected.min_distance_m + 1e-4
    assert float(plan.dsm.elevation_m[40, 70]) == pytest.approx(12.3, abs=1e-5)
    assert float(plan.dsm.elevation_m[40, 30]) == 0.0
    assert plan.certificate.home is not None
    # Home stands on the new model: as low as its error has it.
    assert plan.certificate.home.drop_m == pytest.approx(0.15, abs=1e-5)
    # The clearance allows for what the better model tells of itself.
    assert plan.certificate.required_clearance_m == pytest.approx(
        request.clearance().required_clearance_m + 3 * (0.05 - 0.023), abs=1e-6
    )
    shares, seam = catalogue.shares_of(plan.ground)
    assert [(share.model.name, share.share) for share in shares] == [("new", 0.5), ("old", 0.5)]
    assert 0.1 < seam < 0.3
