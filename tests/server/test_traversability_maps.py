"""Traversability by the workers: kept on disk, drawn in classes, written as GeoTIFF, searched for landing sites."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from mapping.errors import CapacityError
from mapping.uwb.clearing import Cleared
from mapping.uwb.uwb_params import UwbGeometry, of_rule
from planning.errors import FormatError
from planning.ground.traversable import UwbScans, traversable_ground
from planning.terrain.geotiff import read_dsm
from server.errors import NotReadyError, StorageError
from server.library.terrains import load_terrain, store_terrain
from server.scene.geometry import palette
from server.schemas import LandingSitesBody, LayerName
from server.traversability import task
from server.traversability.landing_site_task import find_sites
from server.traversability.legend import LEGENDS, chance_classes, classes, legend_of, painted, time_classes
from server.traversability.maps import Maps, Radar, keep, kept_in, read_maps, settle, write_maps
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.sensors.uwb_log import write_uwb_log
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState
from tests.server.scene_fixtures import hill
from tests.telemetry.uwb_drives import T0_MONO_S, T0_UTC_S, on_the_bus, scan_of

LAYERS: tuple[LayerName, ...] = get_args(LayerName)


def quiet(step: str, share: float | None) -> None:
    del step, share


@pytest.fixture(scope="module")
def terrain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A hill of 60 x 80 m with a hole, and a wall of 8 m on its foot."""
    root, dsm = tmp_path_factory.mktemp("data"), hill()
    heights = dsm.elevation_m.copy()
    heights[50, 5:30] += 8.0
    (root / "terrains").mkdir()
    return root / "terrains" / store_terrain(root, dsm.with_elevation(heights), name="Hill").id


@pytest.fixture
def worked(terrain: Path, tmp_path: Path) -> tuple[task.Worked, Path]:
    file = tmp_path / "maps.npz"
    return task.work_out(terrain, file, None, report=quiet), file


def with_radar(terrain: Path, file: Path) -> Maps:
    """As a log would leave it: the wall's eastern half is foliage."""
    ground = traversable_ground(load_terrain(terrain))
    blocked = ground.map.untraversable
    east = np.zeros_like(blocked)
    east[:, 18:] = True
    probability = np.where(blocked, np.where(east, 0.05, 0.95), ground.map.value).astype(np.float32)
    seconds = np.where(blocked, 6.0, 0.0).astype(np.float32)
    maps = Maps(ground, Radar(Cleared(probability, seconds, blocked & east, blocked), "a.npz", 40))
    write_maps(file, maps)
    return maps


def test_the_figures_are_those_of_the_map(worked: tuple[task.Worked, Path], terrain: Path) -> None:
    figures, file = worked
    ground = traversable_ground(load_terrain(terrain)).map
    assert (figures.cells, figures.untraversable) == (ground.known.sum(), ground.untraversable.sum())
    assert figures.untraversable >= 25
    assert f"{figures.untraversable:,} of {figures.cells:,} cells" in figures.text
    assert read_maps(file).ground.map.index == pytest.approx(ground.index, nan_ok=True)


def test_what_is_kept_comes_back(terrain: Path, tmp_path: Path) -> None:
    before = with_radar(terrain, tmp_path / "m.npz")
    after = read_maps(tmp_path / "m.npz")
    assert before.radar is not None
    assert after.radar is not None
    assert (after.radar.log, after.radar.scans) == ("a.npz", 40)
    assert (after.radar.maps.cleared == before.radar.maps.cleared).all()
    assert after.ground.dsm.transform == before.ground.dsm.transform
    assert after.ground.dsm.crs == before.ground.dsm.crs
    with pytest.raises(StorageError):
        read_maps(tmp_path / "gone.npz")


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_is_a_geotiff_on_the_maps_grid(terrain: Path, tmp_path: Path, layer: LayerName) -> None:
    maps = with_radar(terrain, tmp_path / "m.npz")
    (tmp_path / "layer.tif").write_bytes(task.layer_file(tmp_path / "m.npz", layer, report=quiet))
    written, ground = read_dsm(tmp_path / "layer.tif"), maps.ground
    assert written.transform == ground.dsm.transform
    assert written.crs.to_epsg() == 32633
    assert maps.radar is not None
    expected = {
        "before": ground.map.value,
        "cleared": np.where(maps.radar.maps.cleared, 0.0, ground.map.value),
        "probability": maps.radar.maps.probability,
        "time_in_view": maps.radar.maps.time_in_view_s,
    }[layer]
    known = ground.map.known
    assert written.elevation_m[known] == pytest.approx(expected[known])
    assert np.isnan(written.elevation_m[~known]).all()


def test_without_a_log_there_is_nothing_of_the_radars(worked: tuple[task.Worked, Path]) -> None:
    figures, file = worked
    assert task.layer_file(file, "cleared", report=quiet) == task.layer_file(file, "before", report=quiet)
    with pytest.raises(NotReadyError, match="No radar log"):
        task.layer_file(file, "probability", report=quiet)
    for layer in LAYERS:
        assert (figures.overlay("t", layer).rgba == figures.overlay("t", "before").rgba).all()


def test_sites_are_the_best_of_the_map_before_clearing(terrain: Path, tmp_path: Path) -> None:
    maps = with_radar(terrain, tmp_path / "m.npz")
    dsm = maps.ground.dsm
    wall = dsm.lat_lon_from_xy(np.array([[500_025.0, 3_999_949.5]]))[0].tolist()
    body = LandingSitesBody(lat_deg=wall[0], lon_deg=wall[1], rotor_span_m=1.0, radius_m=40.0)
    found = find_sites(tmp_path / "m.npz", body, report=quiet)
    assert [site.rank for site in found.sites] == list(range(1, len(found.sites) + 1))
    assert 1 <= len(found.sites) <= 5
    for site in found.sites:
        xy_m = dsm.xy_from_lat_lon(np.array([[site.lat_deg, site.lon_deg]]))
        assert site.alt_dsm_m == pytest.approx(float(dsm.elevation_at(xy_m)[0]))
        assert site.obstacle_distance_m >= 2.0
        assert site.distance_m <= 40.0
        assert any("Slope" in reason for reason in site.reasons)
    nowhere = find_sites(
        tmp_path / "m.npz", body.model_copy(update={"radius_m": 5.0, "rotor_span_m": 9.0}), report=quiet
    )
    assert nowhere.sites == ()
    assert "nearest obstacle" in nowhere.no_site


def test_a_grid_of_too_many_cells_is_refused_with_the_resolution_that_fits(
    terrain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mapping.traversability.MOST_CELLS", 1000)
    with pytest.raises(CapacityError, match="Choose a resolution"):
        task.work_out(terrain, tmp_path / "m.npz", 1.0, report=quiet)
    assert not (tmp_path / "m.npz").exists()


def scans(lat_lon: np.ndarray, heading_rad: float = 0.0) -> UwbScans:
    """Bare ground: a steady murmur."""
    count = len(lat_lon)
    noise = np.random.default_rng(3).uniform(9.0, 11.0, (count, 64))
    return UwbScans(
        np.arange(count, dtype=np.float64) * 0.1, lat_lon, np.full(count, heading_rad), noise, UwbGeometry(bins=64)
    )


def test_a_log_is_taken_in_whether_or_not_there_is_a_map_yet(terrain: Path, tmp_path: Path) -> None:
    level = load_terrain(terrain)
    along = np.column_stack([np.linspace(500_060.0, 500_062.0, 60), np.full(60, 3_999_942.0)])
    log = tmp_path / "log.npz"
    write_uwb_log(log, scans(level.lat_lon_from_xy(along)))
    steps: list[str] = []
    first = task.clear_foliage(terrain, None, tmp_path / "a.npz", log, "walk.npz", report=lambda s, _: steps.append(s))
    assert "Working out slope and roughness" in steps
    again = task.clear_foliage(terrain, tmp_path / "a.npz", tmp_path / "b.npz", log, "walk.npz", report=quiet)
    assert (first.uwb_log, first.scans, first.seen) == (again.uwb_log, again.scans, again.seen) == ("walk.npz", 60, 0)
    assert "to be soft vegetation" in first.text
    assert first.codes["time_in_view"].any()
    assert "echoes explained" in first.uwb_rule
    paper = task.clear_foliage(
        terrain, tmp_path / "a.npz", tmp_path / "c.npz", log, "walk.npz", of_rule("paper"), report=quiet
    )
    assert "the paper's rule" in paper.uwb_rule
    assert task.read_again(tmp_path / "c.npz", report=quiet).uwb_rule == paper.uwb_rule
    assert paper.uwb_left_out == ""


def test_scans_of_a_recording_that_count_for_nothing_are_told_and_kept_with_the_map(
    terrain: Path, tmp_path: Path
) -> None:
    level = load_terrain(terrain)
    along = np.column_stack([np.linspace(500_060.0, 500_062.0, 60), np.full(60, 3_999_942.0)])
    drive = scans(level.lat_lon_from_xy(along))
    with closing(RecordingWriter(tmp_path / "late.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name="late")) as writer:
        early = scan_of(0, T0_MONO_S, drive.intensity[0])
        writer.write(Topic.UWB_SCAN, early, early.t_utc_s)
        for message in on_the_bus(replace(drive, t_s=drive.t_s + 60.0)):
            topic = Topic.VEHICLE if isinstance(message, VehicleState) else Topic.UWB_SCAN
            writer.write(topic, message, message.t_utc_s)
    told = "Scans left out: 1, where the vehicle was is not known."
    worked = task.clear_foliage(terrain, None, tmp_path / "d.npz", tmp_path / "late.mcap", "late.mcap", report=quiet)
    assert worked.uwb_left_out == told
    assert task.read_again(tmp_path / "d.npz", report=quiet).uwb_left_out == told


def test_what_is_no_log_is_named_as_the_operator_knows_it(terrain: Path, tmp_path: Path) -> None:
    (tmp_path / "x.npz").write_bytes(b"PK no")
    with pytest.raises(FormatError) as refused:
        task.clear_foliage(terrain, None, tmp_path / "a.npz", tmp_path / "x.npz", "walk.npz", report=quiet)
    assert "walk.npz" in refused.value.where
    assert not (tmp_path / "a.npz").exists()


def test_one_untraversable_cell_is_not_lost_when_drawn_coarsely(
    worked: tuple[task.Worked, Path], terrain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fine = worked[0].codes["before"]
    monkeypatch.setattr(task, "DRAWN_CELLS", 16)
    coarse = task.work_out(terrain, tmp_path / "m.npz", None, report=quiet)
    assert coarse.cell_m == 5.0
    assert coarse.codes["before"].shape == (12, 16)
    for row, col in np.argwhere(fine == 2):
        assert coarse.codes["before"][row // 5, col // 5] == 2


def test_classes_and_their_colours() -> None:
    value = np.array([[0.0, 0.5, 0.99, 1.0, np.nan]], np.float32)
    cleared = np.array([[False, False, False, True, False]])
    assert classes("before", value, cleared).tolist() == [[0, 1, 1, 2, 0]]
    assert classes("cleared", value, cleared).tolist() == [[0, 1, 1, 2, 0]]
    assert classes("cleared", value, ~cleared & False).tolist() == [[0, 1, 1, 3, 0]]
    chances = np.array([0.05, 0.2, 0.4, 0.6, 0.9, np.nan], np.float32)
    assert chance_classes(chances, np.ones(6, np.bool_)).tolist() == [1, 2, 3, 4, 5, 0]
    assert not chance_classes(chances, np.zeros(6, np.bool_)).any()
    assert time_classes(np.array([0.0, 0.1, 2.0, 2.1, 7.0, 60.0], np.float32)).tolist() == [0, 1, 1, 2, 3, 4]
    rgba = painted(np.array([[0, 1, 2]], np.uint8), LEGENDS["before"])
    assert rgba[0, 0, 3] == 0
    assert rgba[0, 2].tolist()[:3] == list(LEGENDS["before"][1].rgb)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_legend_has_a_colour_for_each_class_and_none_that_means_clearance(layer: LayerName) -> None:
    for with_log in (False, True):
        shades = legend_of(layer, with_radar=with_log)
        assert len({shade.color for shade in shades}) == len(shades) >= 2
        for shade in shades:
            apart = [sum(abs(a - b) for a, b in zip(shade.rgb, other, strict=True)) for other in _TAKEN]
            assert min(apart) > 100, shade


_TAKEN = (palette.SAFE, palette.CLOSE, palette.INSIDE, palette.RADAR, palette.VISION, palette.VEHICLE)


def test_maps_that_were_kept_are_read_again_as_they_were(worked: tuple[task.Worked, Path], tmp_path: Path) -> None:
    figures, file = worked
    place = keep(file, tmp_path)
    settle(tmp_path)
    assert (place, file.exists()) == (kept_in(tmp_path), False)
    again = task.read_again(place, report=quiet)
    assert (again.text, again.cells, again.untraversable) == (figures.text, figures.cells, figures.untraversable)
    assert (again.codes["before"] == figures.codes["before"]).all()


@pytest.mark.parametrize("left", [0, 1, 100, 5000])
def test_maps_that_are_cut_off_are_damaged_and_say_so(
    worked: tuple[task.Worked, Path], tmp_path: Path, left: int
) -> None:
    cut = tmp_path / "cut.npz"
    cut.write_bytes(worked[1].read_bytes()[:left])
    with pytest.raises(StorageError, match="damaged") as raised:
        read_maps(cut)
    assert raised.value.where == str(cut)


def test_maps_of_another_kind_and_flipped_bytes_are_damaged(worked: tuple[task.Worked, Path], tmp_path: Path) -> None:
    other, flipped = tmp_path / "other.npz", bytearray(worked[1].read_bytes())
    np.savez(other, elevation_m=np.zeros(3))
    flipped[len(flipped) // 2] ^= 0xFF
    bad = tmp_path / "flipped.npz"
    bad.write_bytes(flipped)
    for path in (other, bad):
        with pytest.raises(StorageError, match="damaged"):
            read_maps(path)
