"""A textured mesh that a page sends: on the surface model that is on show, drawn in its place, or refused in words."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from planning.errors import RasterFormatError
from planning.terrain.geotiff import read_dsm
from planning.terrain.meshes.mesh_file import Mesh, MeshPart
from server.library import Library
from server.library.orthophotos import load_mesh
from server.library.terrains import load_terrain, store_terrain
from server.plan.file_tasks import import_terrain
from server.scene.geometry.glb import parted_glb
from server.scene.geometry.payload import TexturedScene
from server.scene.geometry.stage import Drawing
from server.scene.layers.ground_layers import terrain_nodes, textured_nodes
from server.scene.layers.layers import layers, unchanged
from server.schemas import MeshDoc, TerrainDoc
from tests.planning.geotiff_samples import write_raster
from tests.planning.mesh_samples import GEOID_M, NORTH_M, WEST_M, dsm_of, height_m, local_glb, packed, tileset
from tests.server.scene_fixtures import exaggerated, state_over
from tests.server.test_cloud_import import NOTHING_SAID

ZERO_M = np.array([WEST_M, NORTH_M, 0.0])


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(tmp_path / "data")


def sent(library: Library, upload: Path, name: str, under: TerrainDoc | None) -> tuple[Any, list[str]]:
    stages: list[str] = []
    place = None if under is None else (under.id, library.terrain_dir(under.id))
    made = import_terrain(
        library.root, upload, name, **NOTHING_SAID, under=place, report=lambda stage, share: stages.append(stage)
    )
    library.refresh()
    return made, list(dict.fromkeys(stages))


def model(library: Library) -> TerrainDoc:
    doc = store_terrain(library.root, dsm_of(), name="dsm.tif")
    library.refresh()
    return doc


def test_a_tileset_is_stored_as_it_stands_on_the_model(library: Library, tmp_path: Path) -> None:
    terrain = model(library)
    doc, stages = sent(library, packed(tmp_path / "0123.zip", tileset(dsm_of())), "survey.zip", terrain)
    assert isinstance(doc, MeshDoc)
    assert stages[1:] == [
        "Choosing the level of detail", "Reading the mesh's pictures", "Laying the mesh on the surface model", "Storing"
    ] or "Reading the mesh" in stages  # fmt: skip
    assert (doc.name, doc.terrain_id, doc.triangles) == ("survey.zip", terrain.id, 7200)
    assert doc.shift_m == pytest.approx(-GEOID_M, abs=0.4)
    assert library.mesh_of(terrain.id) == doc
    glb, origin_m = load_mesh(library.mesh_dir(doc.id))
    scene = trimesh.load(io.BytesIO(glb), file_type="glb", process=False)
    xyz_m = np.vstack([np.asarray(part.vertices) for part in scene.dump()]) + origin_m  # pyright: ignore[reportAttributeAccessIssue]
    assert np.abs(xyz_m[:, 2] - height_m(xyz_m[:, 0], xyz_m[:, 1])).max() < 0.5
    library.delete_terrain(terrain.id)
    assert library.meshes() == []
    assert not any((library.root / "meshes").iterdir())


def test_without_a_model_it_is_refused_with_what_to_do(library: Library, tmp_path: Path) -> None:
    path = tmp_path / "0123.glb"
    path.write_bytes(local_glb(ZERO_M, 20.0))
    with pytest.raises(RasterFormatError, match="This is a textured mesh") as told:
        sent(library, path, "house.glb", None)
    assert told.value.where == "house.glb"
    with pytest.raises(RasterFormatError, match=r"Nothing tells where house\.glb lies"):
        sent(library, path, "house.glb", model(library))
    assert library.meshes() == []


def test_a_projects_mesh_comes_with_its_model_and_a_wrong_one_is_left_out(library: Library, tmp_path: Path) -> None:
    raster = write_raster(tmp_path / "dsm.tif", np.array(dsm_of().elevation_m), crs="EPSG:32633+5773",
                          transform=dsm_of().transform)  # fmt: skip
    files = {
        "odm_dem/dsm.tif": raster.read_bytes(),
        "odm_texturing/odm_textured_model_geo.glb": local_glb(ZERO_M),
        "odm_georeferencing/coords.txt": f"WGS84 UTM 33N\n{WEST_M:.0f} {NORTH_M:.0f}\n".encode(),
    }
    doc, _ = sent(library, packed(tmp_path / "a.zip", files), "project.zip", None)
    assert isinstance(doc, TerrainDoc)
    (mesh,) = library.meshes()
    assert (mesh.terrain_id, mesh.name) == (doc.id, "odm_texturing/odm_textured_model_geo.glb")
    np.testing.assert_array_equal(
        load_terrain(library.terrain_dir(doc.id)).elevation_m, read_dsm(raster).elevation_m
    )  # nothing of the mesh is in the model
    files["odm_georeferencing/coords.txt"] = b"WGS84 UTM 33N\n1 1\n"
    doc, _ = sent(library, packed(tmp_path / "b.zip", files), "project.zip", None)
    assert any("textured mesh is left out" in warning and "lies elsewhere" in warning for warning in doc.warnings)
    assert len(library.meshes()) == 1


def test_what_is_stored_and_damaged_is_set_aside(library: Library, tmp_path: Path) -> None:
    terrain = model(library)
    doc, _ = sent(library, packed(tmp_path / "a.zip", tileset(dsm_of())), "a.zip", terrain)
    manifest = library.mesh_dir(doc.id) / "manifest.json"
    manifest.write_text(json.dumps({"format": 1}))
    library.close()
    again = Library(library.root)
    assert again.meshes() == []
    assert any("textured mesh" in notice.what for notice in again.notices)
    again.close()


@pytest.mark.parametrize(("reach", "wrap"), [(1.0, 33071), (1.5, 10497)])
def test_a_picture_is_repeated_only_where_the_file_needs_it(reach: float, wrap: int) -> None:
    """Else its opposite edge would shine through at its border: 33071 clamps, 10497 repeats."""
    mesh = Mesh(
        np.eye(3), np.array([[0, 0], [reach, 0], [0, 1]], np.float32), np.full((3, 4), 255, np.uint8),
        np.array([[0, 1, 2]], np.uint32), (MeshPart(3, 1, 0),), (b"jpeg",), np.zeros(3), None, (),
    )  # fmt: skip
    glb = parted_glb(mesh, np.eye(3, dtype=np.float32))
    told = json.loads(glb[20 : 20 + int.from_bytes(glb[12:16], "little")])
    (texture,) = told["textures"]
    assert told["samplers"][texture["sampler"]]["wrapS"] == wrap


# Drawn

DSM = dsm_of()
SCENE = TexturedScene("hill", "m1", b"glTF", np.array([WEST_M + 30.0, NORTH_M - 30.0, 205.0]))


def drawing(textured: TexturedScene | None, **view: Any) -> Drawing:
    state = replace(state_over(DSM), textured=textured)
    made = Drawing.of(DSM, replace(state, view=state.view.model_copy(update=view)))
    assert made is not None
    return made


def test_the_mesh_stands_in_its_place_and_stretches_with_the_model() -> None:
    drawn = drawing(SCENE, show_textured=True)
    (node,) = textured_nodes(drawn)
    np.testing.assert_allclose(node.props["position"], drawn.frame.scene_from_model(SCENE.origin_m))
    taller = Drawing.of(DSM, exaggerated(drawn.state, 3.0))
    assert taller is not None
    (stretched,) = textured_nodes(taller)
    assert stretched.props["position"][2] == pytest.approx(3 * node.props["position"][2])
    assert (stretched.props["scale"], stretched.props["glb_data"]) == ((1.0, 1.0, 3.0), SCENE.glb)


def test_the_model_gives_way_to_a_mesh_that_is_there_and_to_nothing_else() -> None:
    for textured, view, has_model, has_mesh in (
        (SCENE, {"show_textured": True, "show_mesh": False}, False, True),
        (SCENE, {"show_textured": True, "show_mesh": True}, True, True),
        (SCENE, {"show_textured": False, "show_mesh": False}, True, False),
        (None, {"show_textured": True, "show_mesh": False}, True, False),
        (replace(SCENE, terrain_id="another"), {"show_textured": True, "show_mesh": False}, True, False),
    ):
        drawn = drawing(textured, **view)
        assert (bool(terrain_nodes(drawn)), bool(textured_nodes(drawn))) == (has_model, has_mesh)


def test_another_plan_sends_no_mesh_again() -> None:
    layer = next(layer for layer in layers(lambda handle: None) if layer.name == "textured")
    drawn = drawing(SCENE, show_textured=True)
    assert unchanged(layer.key(drawn), layer.key(replace(drawn, state=replace(drawn.state, plan=None))))
    assert not unchanged(layer.key(drawn), layer.key(drawing(SCENE, show_textured=False)))
