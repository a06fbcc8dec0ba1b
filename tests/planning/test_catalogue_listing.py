"""What a catalogue lists: folders, STAC documents, and documents that are damaged or mean harm."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.catalogue.listed_models import MOST_MODELS, Listing, listing_of
from planning.terrain.catalogue.stac import MOST_ASSETS, MOST_BYTES
from tests.planning.catalogue_samples import item


def folder_with(root: Path, *rasters: str) -> Path:
    folder = root / "maps"
    folder.mkdir()
    for name in rasters:
        (folder / name).write_bytes(b"II*\0")
    return folder


def listed(found: Listing) -> list[str]:
    return [model.path.name for model in found.models]


def test_a_folder_lists_all_its_rasters_with_what_is_told_of_them(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "new.tif", "old.tiff", ".hidden.tif", "100%25.tif")
    item(folder, "new.tif", name="flight", datetime="2024-05-01T10:00:00Z", hedgehop__vertical_rms_m=0.1, gsd=0.05)
    found = listing_of(folder)
    assert listed(found) == ["100%25.tif", "new.tif", "old.tiff"]
    told = {model.path.name: model.told for model in found.models}
    assert (told["new.tif"].name, told["new.tif"].vertical_rms_m, told["new.tif"].gsd_m) == ("flight", 0.1, 0.05)
    assert told["new.tif"].taken_utc is not None
    assert told["new.tif"].taken_utc.isoformat() == "2024-05-01T10:00:00+00:00"
    assert told["old.tiff"].vertical_rms_m is None
    assert not found.left_out


def test_a_collection_lists_what_it_names_below_its_folder(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a.tif", "b b.tif", "c.tif")
    item(folder, "a.tif")
    item(folder, "b b.tif")
    child = {"type": "Catalog", "stac_version": "1.0.0", "id": "c", "links": [{"rel": "item", "href": "b%20b.json"}]}
    child["links"] += [{"rel": "child", "href": "collection.json"}, {"rel": "root", "href": "/etc/passwd"}]
    (folder / "child.json").write_text(json.dumps(child))
    hrefs = ["./a.json", "child.json", "gone.json", "https://elsewhere.example/a.json", "../outside.json"]
    links = [{"rel": "item", "href": href} for href in hrefs]
    source = folder / "collection.json"
    source.write_text(json.dumps({"type": "Collection", "stac_version": "1.0.0", "id": "x", "links": links}))
    (tmp_path / "outside.json").write_text("{}")
    found = listing_of(source)
    assert listed(found) == ["a.tif", "b b.tif"]
    assert len(found.left_out) == 3
    assert all("no file" in out.why for out in found.left_out)


@pytest.mark.parametrize(
    "href",
    [
        "../out.tif",
        "/etc/hostname.tif",
        "file:///etc/hostname.tif",
        "https://elsewhere.example/dsm.tif",
        "/vsicurl/https://elsewhere.example/dsm.tif",
        "%2e%2e/out.tif",
        "link.tif",
        "a\0.tif",
        "x" * 5000 + ".tif",
        "folder.tif",
    ],
)
def test_nothing_outside_the_folder_is_listed(tmp_path: Path, href: str) -> None:
    folder = folder_with(tmp_path, "a.tif")
    (tmp_path / "out.tif").write_bytes(b"II*\0")
    (folder / "link.tif").symlink_to(tmp_path / "out.tif")
    (folder / "folder.tif").mkdir()
    path = item(folder, "a.tif")
    path.write_text(path.read_text().replace("./a.tif", "HREF").replace('"HREF"', json.dumps(href)))
    found = listing_of(path)
    assert not found.models
    assert [out.name for out in found.left_out] == ["a.json"]
    assert len(found.left_out[0].why) < 400


@pytest.mark.parametrize(
    ("properties", "why"),
    [
        ({"hedgehop__vertical_rms_m": 0}, "vertical_rms_m is 0"),
        ({"hedgehop__vertical_rms_m": -0.1}, "vertical_rms_m is -0.1"),
        ({"hedgehop__vertical_rms_m": 21}, "at most 20"),
        ({"hedgehop__vertical_rms_m": "0.1"}, "no STAC document"),
        ({"hedgehop__horizontal_rms_m": 1e9}, "at most 100"),
        ({"gsd": 0}, "gsd is 0"),
        ({"gsd": 1e300}, "at most 100"),
        ({"hedgehop__vertical_datum": "EGM96" * 30}, "vertical_datum"),
        ({"hedgehop__vertical_datum": "EGM96\u202e"}, "vertical_datum"),
        ({"datetime": "yesterday"}, "its date 'yesterday' is none"),
        ({"datetime": 2026}, "no STAC document"),
    ],
)
def test_what_cannot_be_told_is_said(tmp_path: Path, properties: dict[str, Any], why: str) -> None:
    folder = folder_with(tmp_path, "a.tif")
    path = item(folder, "a.tif", **properties)
    with pytest.raises(RasterFormatError) as error:
        listing_of(path)
    assert why.lower() in f"{error.value.what} {error.value.advice}".lower()
    # In a folder the raster stays, with nothing told of it, and the item is named.
    found = listing_of(folder)
    assert [model.told.vertical_rms_m for model in found.models] == [None]
    assert [out.name for out in found.left_out] == ["a.json"]


def assets(path: Path, made: dict[str, Any], **document: Any) -> None:
    """Puts other assets into an item: their keys, and each one's href or all of it."""
    whole = {key: {"href": asset} if isinstance(asset, str) else asset for key, asset in made.items()}
    found = json.loads(path.read_text())
    found["properties"] |= document
    path.write_text(json.dumps(found | {"assets": whole}))


@pytest.mark.parametrize(
    ("made", "title", "model"),
    [
        ({"dsm": "./a.tif", "dtm": "./b.tif"}, "", "a.tif"),
        ({"data": "./a.tif", "terrain": "./b.tif"}, "", "a.tif"),
        ({"a": "./a.tif", "b": {"href": "./b.tif", "title": "Bare earth"}}, "", "a.tif"),
        ({"data": {"href": "./a.tif", "title": "Digital Terrain Model"}, "dsm": "./b.tif"}, "", "b.tif"),
        ({"dsm": "./a.tif", "ortho": "https://elsewhere.example/b.tif", "dtm": "../b.tif"}, "", "a.tif"),
        ({"dsm": "./a.tif", "height": "./b.tif"}, "Terrain of the valley", "a.tif"),
        ({"dsm": {"href": "./a.tif", "roles": ["thumbnail"]}, "one": "./b.tif"}, "", "b.tif"),
        ({"dtm": "./a.tif"}, "", None),
        ({"data": "./a.tif"}, "Terrain model 2019", None),
        ({"data": {"href": "./a.tif", "title": "DTM"}, "dtm": "./b.tif"}, "", None),
        ({"left": "./a.tif", "right": "./b.tif"}, "", None),
        ({"dsm": "./a.tif", "surface": "./b.tif"}, "", "a.tif"),
        ({"data": "./b.tif", "DSM": "./a.tif"}, "", "a.tif"),
        ({"dsm": "./a.tif", "DSM": "./b.tif"}, "", None),
        ({"data": "./a.tif", "elevation": "./b.tif"}, "", None),
    ],
)
def test_bare_terrain_and_what_else_an_item_names_are_no_surface_models(
    tmp_path: Path, made: dict[str, Any], title: str, model: str | None
) -> None:
    """Neither by the item nor as a raster of the folder that nothing is told of."""
    folder = folder_with(tmp_path, "a.tif", "b.tif")
    path = item(folder, "a.tif")
    assets(path, made, title=title)
    named, every = listing_of(path), listing_of(folder)
    assert listed(named) == [model] * (model is not None)
    unnamed = [] if "./b.tif" in json.dumps(made).replace("../", "") else ["b.tif"]
    assert listed(every) == sorted([*listed(named), *unnamed])
    assert len(named.left_out) == (model is None)
    assert len(every.left_out) == (model is None) + 2 - len(listed(every))


def test_a_raster_that_one_item_calls_terrain_and_another_its_surface_is_in_doubt(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a.tif", "b.tif")
    first, second = item(folder, "a.tif"), item(folder, "b.tif")
    assets(first, {"dsm": "./a.tif", "dtm": "./b.tif"})
    assert listed(listing_of(folder)) == ["a.tif"]
    second.rename(folder / "0.json")  # read first
    assert listed(listing_of(folder)) == ["a.tif"]


def test_too_many_links_and_assets_are_refused(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a.tif")
    path = item(folder, "a.tif")
    assets(path, {str(k): "./a.tif" for k in range(MOST_ASSETS + 1)})
    with pytest.raises(RasterError, match="more than 100 assets"):
        listing_of(path)
    assets(path, {"dsm": "./a.tif"})
    links = [{"rel": "item", "href": "a.json"}] * 100_000
    source = folder / "catalog.json"
    source.write_text(json.dumps({"type": "Catalog", "stac_version": "1.0.0", "id": "x", "links": links}))
    with pytest.raises(RasterTooLargeError, match="more than 1,000 links"):
        listing_of(source)


def test_documents_that_name_each_other_are_read_once(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a.tif")
    item(folder, "a.tif")
    for name, other in (("one", "two"), ("two", "one")):
        links = [{"rel": "child", "href": f"{other}.json"}, {"rel": "child", "href": f"{name}.json"}]
        links.append({"rel": "item", "href": "a.json"})
        made = {"type": "Catalog", "stac_version": "1.0.0", "id": name, "links": links}
        (folder / f"{name}.json").write_text(json.dumps(made))
    assert listed(listing_of(folder / "one.json")) == ["a.tif"]


def test_two_items_that_differ_leave_their_raster_out(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a.tif")
    path = item(folder, "a.tif", datetime="2024-05-01T00:00:00Z")
    (folder / "again.json").write_text(path.read_text())
    assert listed(listing_of(folder)) == ["a.tif"]
    (folder / "again.json").write_text(path.read_text().replace("2024", "2025"))
    found = listing_of(folder)
    assert not found.models
    assert "Two items" in found.left_out[0].why


def test_too_many_and_too_long_are_refused(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, *(f"{k}.tif" for k in range(MOST_MODELS + 1)))
    with pytest.raises(RasterTooLargeError, match="more than 64 surface models"):
        listing_of(folder)
    long = folder / "long.json"
    with long.open("wb") as file:
        os.truncate(file.fileno(), MOST_BYTES + 1)
    with pytest.raises(RasterError, match="longer than"):
        listing_of(long)
    deep = folder / "deep.json"
    deep.write_text('{"a":' * 100_000)
    with pytest.raises(RasterFormatError, match="no STAC document"):
        listing_of(deep)
    with pytest.raises(RasterFormatError, match="no catalogue"):
        listing_of(folder / "0.tif")


@pytest.mark.parametrize(
    ("made", "why"),
    [
        ({"stac_version": "0.9.0", "type": "Feature", "properties": {"eo:gsd": 2.0}}, "It is STAC 0.9.0"),
        ({"stac_version": "0.8.1", "description": "older catalogues have no type"}, "It is STAC 0.8.1"),
        ({"stac_version": "1.0.0"}, "it has no type"),
        ({"stac_version": "1.0.0", "type": "Topology"}, "Invalid enum value 'Topology'"),
    ],
)
def test_a_document_that_names_its_fields_otherwise_is_refused(tmp_path: Path, made: dict[str, Any], why: str) -> None:
    path = folder_with(tmp_path, "a.tif") / "a.json"
    path.write_text(json.dumps({"id": "a", "assets": {"dsm": {"href": "./a.tif"}}, **made}))
    with pytest.raises(RasterFormatError, match=why):
        listing_of(path)
    found = listing_of(path.parent)
    assert [(out.name, why in out.why) for out in found.left_out] == [("a.json", True)]


def mutated(document: Any) -> Iterator[Any]:
    """Every value of a document put otherwise, one at a time."""
    odd: list[Any] = [
        None,
        True,
        1e308,
        -1,
        "",
        "../../x.tif",
        [],
        {},
        [[]],
        "\ud800".encode("utf-8", "replace").decode(),
    ]
    if isinstance(document, dict):
        for key, value in document.items():
            yield {k: v for k, v in document.items() if k != key}
            for other in (*odd, *mutated(value)):
                yield {**document, key: other}
    elif isinstance(document, list):
        for number, value in enumerate(document):
            for other in (*odd, *mutated(value)):
                yield [*document[:number], other, *document[number + 1 :]]


def test_mutants_of_an_item_are_listed_inside_or_refused_in_words(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a.tif")
    properties = {"datetime": "2024-05-01T10:00:00Z", "gsd": 0.1, "hedgehop__vertical_rms_m": 0.1}
    path = item(folder, "a.tif", **properties)
    listed_count, refused = 0, list[str]()
    for mutant in mutated(json.loads(path.read_text())):
        path.write_text(json.dumps(mutant))
        try:
            found = listing_of(path)
        except RasterError as error:
            refused.append(error.what)
            continue
        assert all(model.path.is_relative_to(folder) for model in found.models)
        listed_count += len(found.models)
    assert listed_count > 20
    assert len(refused) > 20
    assert all(0 < len(what) < 500 for what in refused)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400), place=st.integers(0, 400), cut=st.integers(0, 40))
def test_bytes_of_any_kind_are_refused_in_words(tmp_path: Path, data: bytes, place: int, cut: int) -> None:
    folder = tmp_path / "maps"
    folder.mkdir(exist_ok=True)
    (folder / "a.tif").write_bytes(b"II*\0")
    path = item(folder, "a.tif", datetime="2024-05-01T10:00:00Z")
    whole = path.read_bytes()
    path.write_bytes(whole[:place] + data + whole[place + cut :])
    try:
        found = listing_of(path)
    except RasterError:
        return
    assert all(model.path.is_relative_to(folder) for model in found.models)
