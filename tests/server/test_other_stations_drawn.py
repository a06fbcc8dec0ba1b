"""Other stations' vehicles in the 3D view: where they were seen, how high, how old; nothing where that is not known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from server.flying.apart import airspace
from server.flying.apart.airspace import Airspace
from server.flying.apart.others_placed import placed_vehicles
from server.scene.layers.other_stations_layer import AHEAD_S, PlacedVehicle, other_vehicle_nodes
from server.scene.layers.traffic_layer import TrafficStage
from tests.server.test_other_stations import NOW_S, other
from tests.server.test_scene_obstacles import placed


def shown(those: Any, now_s: float = NOW_S) -> list[PlacedVehicle]:
    return list(placed_vehicles(those, placed()[0].dsm, now_s))


def here(**more: Any) -> Any:
    origin = placed()[1].origin
    return other(lat_deg=origin.lat_deg, lon_deg=origin.lon_deg, **more)


def test_it_stands_as_high_above_the_ground_as_its_station_sees_it() -> None:
    dsm = placed()[0].dsm
    (low,), (high,) = shown([here(alt_surface_m=10.0)]), shown([here(alt_surface_m=35.0, east_m_s=8.0)])
    assert low.place_m[2] == pytest.approx(float(dsm.elevation_at(low.place_m[None, :2])[0]) + 10.0)
    assert high.place_m[2] - low.place_m[2] == pytest.approx(25.0)
    assert high.ahead_m is not None
    assert np.linalg.norm(high.ahead_m - high.place_m) == pytest.approx(8.0 * AHEAD_S, rel=0.01)
    assert (low.words, low.is_old) == ("Bravo: Wasp 10 m", False)


def test_what_is_old_says_so_and_what_is_nowhere_is_not_drawn() -> None:
    (old,) = shown([here(alt_surface_m=10.0)], NOW_S + 8.0)
    assert (old.words, old.is_old) == ("Bravo: Wasp 10 m, 8 s old", True)
    (uncompared,) = shown([here(alt_surface_m=10.0, age_s=None)])
    assert (uncompared.words, uncompared.is_old) == ("Bravo: Wasp 10 m, age ?", True)
    assert shown([here(alt_surface_m=None, alt_amsl_m=None), other(lat_deg=None, position_t_mono_s=None)]) == []


def test_it_is_drawn_grey_once_it_is_old_and_also_where_other_aircraft_are_hidden() -> None:
    drawing, _ = placed()
    (fresh,), (old,) = shown([here(alt_surface_m=10.0)]), shown([here(alt_surface_m=10.0)], NOW_S + 8.0)
    dots = [other_vehicle_nodes(drawing, [each])[0].props["colors"].ravel()[:3].tolist() for each in (fresh, old)]
    assert dots[0] != dots[1]
    hidden = drawing.state.view.model_copy(update={"show_traffic": False})
    assert len(other_vehicle_nodes(replace(drawing, state=replace(drawing.state, view=hidden)), [fresh])) == 3


def test_it_grows_old_in_the_view_also_when_nothing_new_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    canvas: Any = SimpleNamespace(draw=drawn.append)
    stage = TrafficStage(canvas)
    stage.redraw(placed()[0])
    clock = SimpleNamespace(monotonic=lambda: clock.now_s, now_s=NOW_S)
    monkeypatch.setattr(airspace, "time", clock)
    status = SimpleNamespace(vehicles=(here(alt_surface_m=10.0),))
    stations: Any = SimpleNamespace(status=status, line_of=lambda _: None)
    none: Any = SimpleNamespace(state=None), SimpleNamespace(status=None)
    view = Airspace(stage, [none], none, stations)
    view.draw()
    clock.now_s += 8.0
    view.draw()
    words = [node.props["text"] for step in drawn for node in step["traffic"] if node.name.endswith("words")]
    assert words == ["Bravo: Wasp 10 m", "Bravo: Wasp 10 m, 8 s old"]
    stations.status = SimpleNamespace(vehicles=())
    view.draw()
    assert drawn[-1] == {"traffic": []}
