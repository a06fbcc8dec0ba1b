"""What was seen as part of a plan: columns raise the model, stay on disk, and are missed with words when gone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planning.errors import PoiError
from planning.terrain.dsm import Dsm
from server.errors import NotFoundError, NotReadyError, StorageError
from server.library.seen_columns import check_home_stands_on_ground, load_planned_terrain, load_seen
from server.library.terrains import store_terrain
from server.plan.tasks import keep_seen
from server.scene.mirror import MapMirror, Voxels
from telemetry.errors import NotAllowedError
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.vehicle import HomePlace, VehicleState
from tests.server.obstacle_messages import delta
from tests.server.scene_fixtures import hill

HOME_XY = np.array([[500_040.5, 3_999_945.5]])
MAST_XY, WEST_XY, FAR_XY = (HOME_XY + np.array([east, 0.0]) for east in (10.0, -10.0, 500.0))


@pytest.fixture
def terrain(tmp_path: Path) -> tuple[Dsm, Path]:
    dsm = hill()
    (tmp_path / "terrains").mkdir()
    return dsm, tmp_path / "terrains" / store_terrain(tmp_path, dsm, name="Hill").id


def seen_map(dsm: Dsm, *, home_xy: np.ndarray = HOME_XY) -> Voxels:
    """A mast 10 m east of home, 9 m high, and known ground west of it."""
    lat_deg, lon_deg = dsm.lat_lon_from_xy(home_xy)[0].tolist()
    mirror = MapMirror("radar")
    mast, ground = [(10, 0, up) for up in range(9)], [(-10, 0, up) for up in range(20)]
    mirror.fold(delta(mast + ground, explained=[0] * 9 + [1] * 20, origin=MapOrigin(lat_deg, lon_deg, 500.0)))
    return mirror.voxels()


def quiet(step: str, share: float | None) -> None:
    del step, share


def test_a_mast_raises_its_cells_and_known_ground_raises_none(terrain: tuple[Dsm, Path]) -> None:
    dsm, directory = terrain
    seen_id = keep_seen(directory, [seen_map(dsm)], report=quiet)
    raised = load_planned_terrain(directory, seen_id)
    home_m = dsm.elevation_at(HOME_XY)[0]
    at_mast = raised.elevation_at(MAST_XY)[0]
    assert home_m + 9.0 <= at_mast <= home_m + 10.0
    assert raised.elevation_at(WEST_XY) == dsm.elevation_at(WEST_XY)
    known = np.isfinite(dsm.elevation_m)
    assert (raised.elevation_m[known] >= dsm.elevation_m[known]).all()
    assert load_seen(directory, seen_id).count == 9
    assert load_planned_terrain(directory, None).elevation_m.tobytes() == dsm.elevation_m.tobytes()


def test_a_map_of_another_home_stands_as_high_as_by_that_of_the_take_off(terrain: tuple[Dsm, Path]) -> None:
    """Its origin tells 500 m above the sea; the vehicle took off 4 m below that."""
    dsm, directory = terrain
    lat_deg, lon_deg = dsm.lat_lon_from_xy(HOME_XY)[0].tolist()
    told = {"home_lat_deg": lat_deg, "home_lon_deg": lon_deg, "home_alt_amsl_m": 500.0}
    state, took_off = VehicleState(1, 1, **told), HomePlace(lat_deg, lon_deg, 496.0)
    tops = [
        load_planned_terrain(directory, keep_seen(directory, [seen_map(dsm)], state, home, report=quiet))
        for home in (None, took_off)
    ]
    low_m, high_m = (float(each.elevation_at(MAST_XY)[0]) for each in tops)
    assert high_m - low_m == pytest.approx(4.0)
    for flies in (False, True):
        moved = replace(state, home_alt_amsl_m=496.0, armed=flies, landed="in_air" if flies else "on_ground")
        with pytest.raises(NotAllowedError, match="seen under another home") as refused:
            keep_seen(directory, [seen_map(dsm)], moved, None, report=quiet)
        assert ("land" in refused.value.advice, "empty the maps" in refused.value.advice) == (flies, not flies)


def test_a_home_on_what_was_seen_is_refused(terrain: tuple[Dsm, Path]) -> None:
    dsm, directory = terrain
    raised = load_planned_terrain(directory, keep_seen(directory, [seen_map(dsm)], report=quiet))
    at_home, at_mast = (tuple(dsm.lat_lon_from_xy(xy)[0].tolist()) for xy in (HOME_XY, MAST_XY))
    check_home_stands_on_ground(directory, raised, at_home)
    check_home_stands_on_ground(directory, raised, (None, None))
    with pytest.raises(PoiError, match="counted from its top"):
        check_home_stands_on_ground(directory, raised, at_mast)


def test_a_home_on_unknown_ground_is_refused(terrain: tuple[Dsm, Path]) -> None:
    dsm, directory = terrain
    with pytest.raises(NotReadyError, match="knows nothing"):
        keep_seen(directory, [seen_map(dsm, home_xy=FAR_XY)], report=quiet)


def test_what_is_gone_or_damaged_says_so(terrain: tuple[Dsm, Path]) -> None:
    dsm, directory = terrain
    seen_id = keep_seen(directory, [seen_map(dsm)], report=quiet)
    file = directory / f"seen-{seen_id}.npz"
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(StorageError, match="damaged"):
        load_planned_terrain(directory, seen_id)
    file.unlink()
    with pytest.raises(NotReadyError, match="has been deleted"):
        load_planned_terrain(directory, seen_id)
    with pytest.raises(NotFoundError):
        load_planned_terrain(directory, "../../etc/passwd")
