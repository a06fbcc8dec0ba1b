"""Plans and certificates over a large file are, to the last byte, those over the model read as a whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from affine import Affine

from planning.basics.plan_model import PathParams, Poi, SurfaceParams, VehicleProfile
from planning.errors import PoiError
from planning.planner import part
from planning.planner.part import certify_part
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from planning.report.exports import export_file
from planning.terrain.dsm import Dsm, SurfaceModel
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.rasters import dsm_file
from tests.planning.geotiff_samples import write_raster

KINDS = {
    "metres": ("EPSG:32633", Affine(0.5, 0, 5e5, 0, -0.5, 4.17e6)),
    "degrees": ("EPSG:4326", Affine(5.6e-6, 0, 15.0, 0, -4.5e-6, 37.6)),
    "turned": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(31.0) @ Affine.scale(0.5, -0.45)),
}
SIDE_PX = 700
FILES = ("mission.waypoints", "mission.plan", "trajectory.csv", "certificate.json")


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Dsm]]:
    folder = tmp_path_factory.mktemp("models")
    random = np.random.default_rng(4)
    y, x = np.mgrid[:SIDE_PX, :SIDE_PX] * 0.5
    heights = 100 + 5 * np.sin(x / 40) + 4 * np.cos(y / 31) + random.normal(0, 0.02, x.shape)
    heights[random.random(heights.shape) < 0.0004] = -9999.0
    heights[random.random(heights.shape) < 0.0002] += 12.0
    layout: dict[str, Any] = {
        "nodata": -9999.0,
        "tiled": True,
        "blockxsize": 64,
        "blockysize": 64,
        "compress": "deflate",
    }
    paths = {
        name: write_raster(folder / f"{name}.tif", heights.astype(np.float32), crs=crs, transform=at, **layout)
        for name, (crs, at) in KINDS.items()
    }
    return {name: (path, read_dsm(path)) for name, path in paths.items()}


@pytest.fixture(autouse=True)
def everything_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(part, "LARGE_PX", 1000)
    monkeypatch.setattr(dsm_file, "LARGE_PX", 1000)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 16)


def asked(dsm: SurfaceModel, xy_m: np.ndarray, *, radius_m: float = 5.0, error_m: float = 0.1) -> PlanRequest:
    return PlanRequest(
        pois=tuple(Poi(lat, lon) for lat, lon in dsm.lat_lon_from_xy(xy_m).tolist()),
        profile=VehicleProfile("part", position_error_m=error_m, rtl_height_m=60.0),
        surface=SurfaceParams(radius_m, 6.0),
        path=PathParams(),
    )


def near(dsm: SurfaceModel, random: np.random.Generator) -> np.ndarray:
    """A few points within some tens of metres of each other, on known ground."""
    west, south, east, north = dsm.bounds_m
    while True:
        middle = random.uniform((west + 0.35 * (east - west), south + 0.35 * (north - south)),
                                (east - 0.35 * (east - west), north - 0.35 * (north - south)))  # fmt: skip
        xy_m = middle + random.uniform(-30.0, 30.0, (int(random.integers(2, 5)), 2))
        if np.isfinite(dsm.elevation_at(xy_m)).all():
            return xy_m


def written(plan: Plan, source: SurfaceModel) -> list[str]:
    seconds = {"total": 0.0}
    return [export_file(name, plan, source, title="t", created_utc="2026", seconds=seconds) for name in FILES]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", list(KINDS))
def test_files_are_the_same_to_the_last_byte(models: dict[str, tuple[Path, Dsm]], kind: str, seed: int) -> None:
    path, dsm = models[kind]
    random = np.random.default_rng(seed)
    xy_m = near(dsm, random)
    request = asked(dsm, xy_m, radius_m=float(random.uniform(3, 9)), error_m=float(random.choice([0.1, 1.5])))
    model = open_dsm(path)
    over_file, over_memory = plan_mission(model, request), plan_mission(dsm, request)
    assert written(over_file, model) == written(over_memory, dsm)
    assert model.report is None, "all of the file was decoded"
    assert over_file.ground.elevation_m.size < dsm.elevation_m.size / 2


@pytest.mark.parametrize("kind", list(KINDS))
def test_certificates_are_those_over_the_whole_model(
    models: dict[str, tuple[Path, Dsm]], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, dsm = models[kind]
    request = asked(dsm, near(dsm, np.random.default_rng(7)))
    mission, clearance = plan_mission(dsm, request).mission, request.clearance()
    model = open_dsm(path)
    ground, cut = certify_part(model, mission, clearance, max_hole_m2=4.0, assumptions={})
    assert model.report is None
    assert ground.dsm.elevation_m.size < dsm.elevation_m.size / 2
    monkeypatch.setattr(part, "LARGE_PX", 10**9)
    _, whole = certify_part(dsm, mission, clearance, max_hole_m2=4.0, assumptions={})
    assert cut.certified == whole.certified
    assert [reason.code for reason in cut.reasons] == [reason.code for reason in whole.reasons]
    for key in ("min_distance_m", "min_vertical_m", "rtl_height_needed_m", "max_height_above_ground_m"):
        assert getattr(cut, key) == pytest.approx(getattr(whole, key), abs=1e-6)
    np.testing.assert_allclose(cut.trend_distance_m, whole.trend_distance_m, atol=1e-6)


def test_points_at_the_edge_and_far_apart(models: dict[str, tuple[Path, Dsm]]) -> None:
    path, dsm = models["metres"]
    west, south, east, north = dsm.bounds_m
    for places in (
        [(west + 12, north - 12), (west + 40, north - 15)],
        [(west + 15, south + 15), (east - 9, north - 9)],
    ):
        request = asked(dsm, np.array(places))
        model = open_dsm(path)
        assert written(plan_mission(model, request), model) == written(plan_mission(dsm, request), dsm)


def test_points_outside_are_told_without_reading_all(models: dict[str, tuple[Path, Dsm]]) -> None:
    path, dsm = models["metres"]
    west, _, _, north = dsm.bounds_m
    for places in ([(west - 500, north + 20), (west - 400, north)], [(west + 20, north - 20), (west - 9000, north)]):
        request = asked(dsm, np.array(places))
        model = open_dsm(path)
        with pytest.raises(PoiError) as told:
            plan_mission(model, request)
        with pytest.raises(PoiError) as expected:
            plan_mission(dsm, request)
        assert "outside the surface model" in str(told.value)
        assert str(told.value) == str(expected.value)
        assert model.report is None
