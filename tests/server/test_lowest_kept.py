"""What a surface model of several knows beside its heights is kept wherever the model is kept."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import Opened
from planning.terrain.dsm import Dsm
from planning.terrain.rasters.header import RasterLimits
from server.library.terrains import FOLDER, load_terrain, store_terrain
from telemetry.errors import RecordingError
from telemetry.recording import carried_ground
from telemetry.recording.mcap_files.reader import Recording
from tests.planning.catalogue_samples import in_memory


@pytest.fixture(scope="module")
def dsm() -> Dsm:
    heights = np.arange(64, dtype=np.float32).reshape(8, 8)
    models = (in_memory(heights, name="new", year=2024), in_memory(heights + 2, rms_m=0.3, east_m=20.0, name="old"))
    return replace(Catalogue(Opened(models, (), ()), "both", RasterLimits()).whole(), place_m=0.6)


def same(one: Dsm, other: Dsm) -> bool:
    assert other.lowest_m is not None
    assert other.seam is not None
    np.testing.assert_array_equal(one.elevation_m, other.elevation_m)
    np.testing.assert_array_equal(np.asarray(one.lowest_m), other.lowest_m)
    np.testing.assert_array_equal(np.asarray(one.seam), other.seam)
    return (one.rms_m, one.place_m, one.sha256, one.transform) == (
        other.rms_m,
        other.place_m,
        other.sha256,
        other.transform,
    )


def test_in_a_recording(dsm: Dsm, monkeypatch: pytest.MonkeyPatch) -> None:
    assert dsm.rms_m == 0.1
    assert same(dsm, carried_ground._unpacked(carried_ground.packed(dsm)))
    plain = carried_ground._unpacked(carried_ground.packed(replace(dsm.as_grid(), rms_m=None, place_m=0.0)))
    assert (plain.lowest_m, plain.seam, plain.rms_m, plain.place_m) == (None, None, None, 0.0)
    monkeypatch.setattr(carried_ground, "MOST_BYTES", dsm.elevation_m.nbytes + 1)
    with pytest.raises(RecordingError, match="too large"):
        carried_ground.packed(dsm)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lowest_m", np.zeros((8, 8))),
        ("lowest_m", np.full((8, 8), "x")),
        ("seam", np.ones((8, 8), np.float32)),
        ("rms_m", np.array(np.nan)),
        ("rms_m", np.array(-0.1)),
        ("rms_m", np.array("x")),
        ("place_m", np.array(-1.0)),
        ("rms_m", np.array([0.1, 0.2])),
    ],
)
def test_a_foreign_recording_with_something_else_is_refused(dsm: Dsm, name: str, value: np.ndarray) -> None:
    with np.load(io.BytesIO(carried_ground.packed(dsm))) as fields:
        others: dict[str, Any] = {key: fields[key] for key in fields} | {name: value}
    out = io.BytesIO()
    np.savez_compressed(out, **others)
    recording = cast(Recording, SimpleNamespace(name="flight.mcap", attachment=lambda name: out.getvalue()))
    with pytest.raises(RecordingError, match="surface model in the recording cannot be read"):
        carried_ground.carried_ground(recording)


def test_in_the_library(dsm: Dsm, tmp_path: Path) -> None:
    (tmp_path / FOLDER).mkdir()
    stored = store_terrain(tmp_path, dsm, name="both")
    assert same(dsm, load_terrain(tmp_path / FOLDER / stored.id))
    stored = store_terrain(tmp_path, replace(dsm.as_grid(), rms_m=None), name="plain")
    plain = load_terrain(tmp_path / FOLDER / stored.id)
    assert (plain.lowest_m, plain.seam, plain.rms_m) == (None, None, None)
