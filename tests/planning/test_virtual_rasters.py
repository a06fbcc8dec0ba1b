"""Virtual rasters: lists of tiles and no more, that reach nothing outside their folder."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.errors import RasterError, RasterFormatError
from planning.terrain.geotiff import open_dsm, read_dsm, read_dsm_reported
from planning.terrain.rasters import dsm_file
from tests.planning.geotiff_samples import HALF_METRE, hill, write_raster
from tests.planning.tile_samples import vrt


@pytest.mark.parametrize(
    ("named", "match"),
    [
        ("../secret.tif", "outside its folder"),
        ("/etc/passwd", "outside its folder"),
        ("link.tif", "outside its folder"),
        ("/vsicurl/http://127.0.0.1/x.tif", "no file of its folder"),
        ("http://127.0.0.1/x.tif", "no file of its folder"),
        ("GTIFF_DIR:1:http://127.0.0.1/x.tif", "no file of its folder"),
        ("missing.tif", "no such file"),
    ],
)
def test_a_virtual_raster_reaches_nothing_but_its_folder(tmp_path: Path, named: str, match: str) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    write_raster(tmp_path / "secret.tif", hill())
    (folder / "link.tif").symlink_to(tmp_path / "secret.tif")
    with pytest.raises(RasterError, match=match):
        read_dsm(vrt(folder / "x.vrt", [named]), virtual=True)


@pytest.mark.parametrize(
    "how",
    [
        {"source": "ComplexSource", "more": "<ScaleRatio>0.5</ScaleRatio>"},
        {"source": "ComplexSource", "more": "<ScaleOffset>5</ScaleOffset>"},
        {"source": "ComplexSource", "more": "<LUT>0:5,9:7</LUT>"},
        {"source": "ComplexSource", "more": "<UseMaskBand>true</UseMaskBand>"},
        {"more": '<OpenOptions><OOI key="OVERVIEW_LEVEL">0</OOI></OpenOptions>'},
        {"source": "AveragedSource"},
        {"band": "<Scale>2</Scale><Offset>30</Offset>"},
        {"band": "<Offset>30</Offset>"},
        {"band": "<Scale>nonsense</Scale>"},
        {"band": "<scale>2</scale>"},
        {"band": "<UnitType>ft</UnitType>"},
        {"band": "<HideNoDataValue>1</HideNoDataValue>"},
        {"band": "<NoDataValue>none</NoDataValue>"},
        {"band": "<ColorTable/>"},
        {"band": "<MaskBand/>"},
        {"dataset": "<MaskBand/>"},
        {"dataset": "<GCPList/>"},
        {"dataset": "<SRS>EPSG:32634</SRS>"},
        {"dataset": "<SRS>EPSG:32633+5773</SRS>"},
        {"dataset": "<SRS>nowhere</SRS>"},
        {"dataset": '<Metadata><MDI key="HEDGEHOP_VERTICAL_DATUM">ellipsoid</MDI></Metadata>'},
        {"attributes": ' subClass="VRTWarpedDataset"'},
        {"attributes": ' strange="1"'},
        {"changed": {'dataType="Float32"': 'dataType="Byte"'}},
        {"changed": {' dataType="Float32"': ""}},
        {"changed": {'<SrcRect xOff="0"': '<SrcRect xOff="5"'}},
        {"changed": {'xSize="50"': 'xSize="40"'}},
        {"changed": {'<DstRect xOff="0"': '<DstRect xOff="2"'}},
        {"changed": {'<DstRect xOff="0" yOff="0" xSize="50"': '<DstRect xOff="0" yOff="0" xSize="25"'}},
        {"changed": {'rasterXSize="50"': 'rasterXSize="30"'}},
        {"changed": {"<SrcRect": "<Nothing"}},
        {"changed": {"500000.0, 0.5": "500001.0, 0.5"}},
        {"changed": {"500000.0, 0.5": "500000.0, 0.51"}},
        {"changed": {"<GeoTransform>": "<GeoTransform>1,"}},
        {"changed": {"<SourceBand>1": "<SourceBand>mask,1"}},
    ],
)
def test_a_virtual_raster_that_says_more_than_its_tiles_is_refused(tmp_path: Path, how: dict[str, Any]) -> None:
    write_raster(tmp_path / "a.tif", hill())
    with pytest.raises(RasterFormatError, match="more than a list of tiles"):
        read_dsm(vrt(tmp_path / "x.vrt", ["a.tif"], **how), virtual=True)


def test_a_hostile_virtual_raster_is_refused(tmp_path: Path) -> None:
    bomb = '<!DOCTYPE a [<!ENTITY b "c">]><VRTDataset>&b;</VRTDataset>'
    (tmp_path / "bomb.vrt").write_text(f'<?xml version="1.0"?>{bomb}')
    with pytest.raises(RasterFormatError, match="cannot be read"):
        read_dsm(tmp_path / "bomb.vrt", virtual=True)


def test_what_a_virtual_raster_says_as_its_tiles_do_is_let_pass(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill(), unit="m", scale=(0.5, 3.0), nodata=-9999.0)
    listed = vrt(
        tmp_path / "x.vrt",
        ["a.tif"],
        dataset='<SRS dataAxisToSRSAxisMapping="1,2">EPSG:32633</SRS><OverviewList>2</OverviewList>',
        band="<Scale>0.5</Scale><Offset>3</Offset><UnitType>m</UnitType><NoDataValue>-9999</NoDataValue>"
        "<ColorInterp>Gray</ColorInterp>",
        source="ComplexSource",
        more="<NODATA>-9999</NODATA>",
    )
    as_list, as_folder = read_dsm(listed, virtual=True), read_dsm(tmp_path)
    np.testing.assert_array_equal(as_list.elevation_m, as_folder.elevation_m)
    assert as_list.sha256 == as_folder.sha256


VALUES = (0.0, -9999.0, 7.0, 120.5)


@settings(max_examples=12, deadline=None)
@given(
    st.sampled_from(["float32", "int16"]),
    st.sampled_from([None, *VALUES[:3]]),
    st.sampled_from([None, *VALUES]),
    st.sampled_from([None, *VALUES]),
    st.integers(0, 2**32 - 1),
)
def test_what_a_virtual_raster_calls_unknown_is_unknown(
    dtype: str, own: float | None, in_band: float | None, in_source: float | None, seed: int
) -> None:
    """No cell is known that the list, or its tile, calls unknown; all others are those of one merged file."""
    heights = np.random.default_rng(seed).choice([*VALUES, 100.0, 101.0, 102.0], (30, 40)).astype(dtype)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for column in (0, 15):
            at = HALF_METRE @ Affine.translation(column, 0)
            tile = heights[:, column : column + (15 if column == 0 else 25)]
            write_raster(folder / f"{column}.tif", tile, transform=at, nodata=own)
        listed = vrt(
            folder / "x.vrt",
            ["0.tif", "15.tif"],
            band="" if in_band is None else f"<NoDataValue>{in_band}</NoDataValue>",
            source="SimpleSource" if in_source is None else "ComplexSource",
            more="" if in_source is None else f"<NODATA>{in_source}</NODATA>",
        )
        model = read_dsm(listed, virtual=True)
        others = {in_band, in_source} - {None, own}
        assert (model.sha256 == read_dsm(folder).sha256) == (not others)
    unknown = [value for value in (own, *others, -9999.0) if value is not None]
    np.testing.assert_array_equal(model.elevation_m, np.where(np.isin(heights, unknown), np.nan, heights))


def test_a_list_that_calls_other_numbers_unknown_meanwhile_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    write_raster(tmp_path / "a.tif", hill())
    listed = vrt(tmp_path / "x.vrt", ["a.tif"])
    model = open_dsm(listed, virtual=True)
    vrt(listed, ["a.tif"], band="<NoDataValue>100</NoDataValue>")
    with pytest.raises(RasterError, match="changed"):
        model.window(0, 0, 5, 5)


def test_without_being_told_so_a_virtual_raster_is_none(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill())
    listed = vrt(tmp_path / "x.vrt", ["a.tif"])
    with pytest.raises(RasterFormatError, match="VRT"):
        read_dsm(listed)
    dsm, report = read_dsm_reported(listed, virtual=True)
    np.testing.assert_array_equal(dsm.elevation_m, hill())
    assert report.warnings == ()
