"""hedgehop terrain catalogue, and plans over catalogues."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from planning.errors import ParameterError
from planning.ground.demo_hillside import demo_dsm
from planning.terrain.geotiff import write_dsm
from server.cli.shared.options import ModelOptions
from server.cli.shared.terrain_given import is_catalogue
from tests.planning.catalogue_samples import item
from tests.server.cli_runs import hedgehop


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A piece of the demo's hillside, and a smaller newer one in its middle."""
    folder = tmp_path_factory.mktemp("catalogue") / "maps"
    folder.mkdir()
    old, new = demo_dsm().window(600, 400, 240, 240), demo_dsm().window(660, 460, 120, 120)
    write_dsm(folder / "old.tif", old)
    write_dsm(folder / "new.tif", new)
    item(folder, "old.tif", name="lidar", datetime="2019-03-01T00:00:00Z", hedgehop__vertical_rms_m=0.05)
    item(folder, "new.tif", name="flight", datetime="2024-05-01T00:00:00Z", hedgehop__vertical_rms_m=0.03)
    west, south, east, _ = new.bounds_m
    xy_m = np.array([[west + 15, south + 30], [east + 15, south + 30]])
    places = new.lat_lon_from_xy(xy_m)
    (folder / "points.csv").write_text("".join(f"{lat:.8f},{lon:.8f}\n" for lat, lon in places))
    links = [{"rel": "item", "href": name} for name in ("old.json", "new.json", "gone.json")]
    made = {"type": "Collection", "stac_version": "1.1.0", "id": "site", "links": links}
    (folder / "collection.json").write_text(json.dumps(made))
    return folder


def first_place(maps: Path) -> str:
    return (maps / "points.csv").read_text().splitlines()[0]


def test_a_folder_is_listed_best_first(maps: Path) -> None:
    run = hedgehop("terrain", "catalogue", maps, "--at", first_place(maps))
    assert run.code == 0, run.err
    lines = run.out.splitlines()
    assert lines[0].startswith("1. flight: 2024-05-01, 0.5 m, ±0.09 m")
    assert lines[1].startswith("2. lidar: 2019-03-01, 0.5 m, ±0.15 m; raised by 0.06 m")
    assert lines[-1].startswith("here: flight: 2024-05-01")


def test_what_a_collection_names_and_is_not_there_is_said(maps: Path) -> None:
    run = hedgehop("terrain", "catalogue", maps / "collection.json", "--json")
    assert run.code == 1
    assert [model["name"] for model in run.json["models"]] == ["flight", "lidar"]
    assert [out["name"] for out in run.json["left_out"]] == ["collection.json"]
    assert "Left out: collection.json: gone.json is no file" in run.err


def test_a_place_that_no_model_knows_is_refused(maps: Path) -> None:
    run = hedgehop("terrain", "catalogue", maps, "--at", "1,2", "--json")
    assert run.code == 2
    assert "No model of the catalogue knows 1.0000000, 2.0000000" in run.json["error"]["what"]


@pytest.mark.parametrize(
    ("address", "said"),
    [("https://maps.example/dsm/a.tif", True), ("https://maps.example/dsm/catalog.json", False)],
)
def test_no_address_is_a_catalogue(address: str, *, said: bool) -> None:
    with pytest.raises(ParameterError, match="read from this machine alone"):
        is_catalogue(Path(address), ModelOptions(catalogue=said))


def test_an_address_alone_is_one_model() -> None:
    assert not is_catalogue(Path("https://maps.example/dsm/a.tif"), ModelOptions())


def test_plans_and_certifies_over_a_catalogue(maps: Path, tmp_path: Path) -> None:
    out, how = tmp_path / "out", ("--catalogue", "--json", "--position-error-m", "0.3")
    run = hedgehop("plan", maps, maps / "points.csv", "--out", out, *how)
    assert run.code in (0, 1), run.err
    assert "here: flight: 2024-05-01, 0.5 m, ±0.09 m: the best of" in run.err
    assert "lies at seams" in run.err
    certificate = json.loads((out / "certificate.json").read_text())
    assert "lidar: 2019-03-01" in certificate["assumptions"]["models"]
    again = hedgehop("certify", maps, out / "mission.plan", *how)
    assert again.json["min_distance_m"] == pytest.approx(run.json["min_distance_m"], abs=1e-3)
    assert again.json["other_surface"] is None
