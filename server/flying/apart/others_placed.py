"""Other stations' vehicles put onto the surface model on show."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg
from planning.terrain.dsm import Dsm
from planning.terrain.vertical_datum import is_amsl
from server.flying.apart.other_stations import OLD_S, age_s
from server.flying.apart.others_lines import ahead_of
from server.scene.layers.other_stations_layer import AHEAD_S, PlacedVehicle
from telemetry.stations.plan_lines import PlanLine
from telemetry.topics.station_vehicles import FleetVehicle, OtherVehicle


def placed_vehicles(
    vehicles: Sequence[OtherVehicle],
    dsm: Dsm,
    now_s: float,
    line_of: Callable[[OtherVehicle], PlanLine | None] = lambda _: None,
) -> Iterator[PlacedVehicle]:
    """Those whose place and height are known on this model."""
    for other in vehicles:
        it, age = other.it, age_s(other, now_s)
        if age is None or it.lat_deg is None or it.lon_deg is None:
            continue
        here = it.lat_deg, it.lon_deg
        east_m_s, north_m_s, up_m_s = it.v_enu_m_s or (0.0, 0.0, 0.0)
        xy_m = dsm.xy_from_lat_lon(np.array([here, moved_deg(here, AHEAD_S * east_m_s, AHEAD_S * north_m_s)]))
        alt_m = _alt_dsm_m(it, dsm, xy_m[:1])
        if alt_m is None or not np.isfinite([*xy_m.ravel(), alt_m]).all():
            continue
        is_old = age > OLD_S
        yield PlacedVehicle(
            other.station,
            it.number,
            _words(other, age, is_old=is_old),
            np.array([*xy_m[0], alt_m]),
            np.array([*xy_m[1], alt_m + AHEAD_S * up_m_s]) if it.v_enu_m_s is not None else None,
            is_old,
            None if is_old else _left_m(other, line_of(other), dsm, float(alt_m)),
        )


def _left_m(other: OtherVehicle, line: PlanLine | None, dsm: Dsm, alt_dsm_m: float) -> F64 | None:
    """(N, 3) of its line, as much higher or lower than the vehicle as the line is; None: nothing is known of it."""
    it = other.it
    left = None if line is None or it.line_s is None else ahead_of(line, it.line_s)
    if left is None or it.alt_amsl_m is None:
        return None
    ahead = left[0]
    line_m = np.column_stack([dsm.xy_from_lat_lon(ahead.lat_lon_deg), ahead.alt_rel_home_m - it.alt_amsl_m + alt_dsm_m])
    return line_m if np.isfinite(line_m).all() else None


def _alt_dsm_m(it: FleetVehicle, dsm: Dsm, xy_m: np.ndarray) -> float | None:
    """As its own station sees it above the ground, else above the sea where the model's heights are that, too."""
    if it.alt_surface_m is not None:
        ground_m = float(dsm.elevation_at(xy_m)[0])
        if np.isfinite(ground_m):
            return ground_m + it.alt_surface_m
    return it.alt_amsl_m if is_amsl(dsm.vertical_datum) else None


def _words(other: OtherVehicle, age: float, *, is_old: bool) -> str:
    """ "Bravo: Bee 12 m, 8 s old" """
    it = other.it
    height_m = next((alt_m for alt_m in (it.alt_surface_m, it.alt_rel_home_m) if alt_m is not None), None)
    height = "height ?" if height_m is None else f"{height_m:.0f} m"
    if other.oldest_t_mono_s is None:
        return f"{other.station}: {it.name} {height}, age ?"
    return f"{other.station}: {it.name} {height}" + (f", {age:.0f} s old" if is_old else "")
