"""``RFND``, ``PRX`` and ``PRXR`` of ArduPilot's DataFlash logs as single ranges.

RFND says by its status whether a distance is one. PRX and PRXR hold the nearest distance of each of eight sectors for
each layer of elevation, and where nothing is always the same one, farther than all others, without saying which it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.mavlink.ranges import Limits, Scan, direction_of, single_range
from telemetry.recording.tlog import Data
from telemetry.recording.vehicle_logs.dataflash import DataFlash, read_dataflash
from telemetry.recording.vehicle_logs.dataflash_flight import parameters_of, timed
from telemetry.recording.vehicle_logs.logged_ranges import LoggedRanges
from telemetry.recording.vehicle_logs.rows import Rows

FINDER, FILTERED, RAW = "RFND", "PRX", "PRXR"
_GOOD = 4
_MEASURED = (2, 3, _GOOD)
"""RFND.Stat: too near, too far, good."""
_HEALTHY = 2
"""PRX.He: not connected, no data, good."""
_SECTORS = ("D0", "D45", "D90", "D135", "D180", "D225", "D270", "D315")
_SECTOR_RAD, _LAYER_RAD, _LEVEL_LAYER = math.radians(45.0), math.radians(30.0), 2
_LAYERS = range(5)
_NEAREST_M = 0.1
_FAR_SHARE, _CLEARLY = 0.25, 20
"""What is told for nothing is told so many times as often as any other distance beyond this share of it."""
_COARSE = (
    "PRX and PRXR tell the nearest thing of a sector 45° wide and 30° high, up to 1 s old: it may stand up to half of "
    "that, and as far as was flown meanwhile, beside where the map has it."
)
_SMOOTHED = "PRX is smoothed by the autopilot (PRX_FILT) and lags behind a vehicle that moves; PRX_LOG_RAW 1 logs PRXR."


def read_dataflash_ranges(data: Data) -> LoggedRanges:
    """Of proximity sensors what was measured (PRXR), where the log has it, else what was smoothed (PRX)."""
    flash, found = read_dataflash(data, {FINDER, FILTERED, RAW, "PARM"}), LoggedRanges()
    _finders(flash, found)
    name = RAW if len(flash.rows(RAW)) else FILTERED
    rows, t_s = timed(flash, name)
    if len(rows):
        _layers(rows, t_s, name, found)
        found.notes += [_COARSE, *([_SMOOTHED] if name == FILTERED else [])]
    return found


@dataclass(frozen=True, slots=True)
class _Columns:
    """Newer logs have a row per sensor; older ones two sensors in a row."""

    number: str
    """Of the sensor; empty: the row tells it."""

    def of(self, rows: Rows) -> F64:
        """(N, 4) number of the sensor from 0, distance in m, status, orientation"""
        instance = rows.column("Instance") if not self.number else np.full(len(rows), float(self.number) - 1.0)
        names = (f"{name}{self.number}" for name in ("Dist", "Stat", "Orient"))
        return np.column_stack([instance, *(rows.column(name) for name in names)])


def _finders(flash: DataFlash, found: LoggedRanges) -> None:
    rows, t_s = timed(flash, FINDER)
    limits = _limits(parameters_of(flash))
    for number in ("", "1", "2"):
        if rows.has(f"Dist{number}"):
            for t, row in zip(t_s.tolist(), _Columns(number).of(rows).tolist(), strict=True):
                _finder(t, row, limits, found)


def _finder(t_s: float, row: list[float], limits: dict[int, Limits], found: LoggedRanges) -> None:
    instance, range_m, status, orientation = row
    if not all(map(math.isfinite, row)):
        found.not_valid[f"{FINDER}: without distance, status or orientation"] += 1
        return
    sensor, direction = f"{FINDER} {instance:g}", direction_of(int(orientation))
    if direction is None:
        found.not_valid[f"{sensor}: orientation {orientation:g} is not understood"] += 1
    elif status not in _MEASURED:
        found.not_valid[f"{sensor}: not connected, or no data"] += 1
    else:
        within = limits.get(int(instance), Limits(0.0, math.inf))
        found.take(sensor, t_s, single_range(range_m if status == _GOOD else math.nan, within, direction, 0.0))


def _limits(parameters: dict[str, float]) -> dict[int, Limits]:
    """By the sensor's number from 0: metres since 4.6, centimetres before, and once without a number."""
    found: dict[int, Limits] = {}
    for instance, letter in enumerate("123456789A"):
        names = [f"RNGFND{letter}", *(["RNGFND"] if instance == 0 else [])]
        nearest_m, farthest_m = (_metres(parameters, names, end) for end in ("MIN", "MAX"))
        if farthest_m is not None and farthest_m > 0.0:
            found[instance] = Limits(nearest_m or 0.0, farthest_m)
    return found


def _metres(parameters: dict[str, float], names: list[str], end: str) -> float | None:
    for name in names:
        if (metres := parameters.get(f"{name}_{end}")) is not None:
            return metres
        if (centimetres := parameters.get(f"{name}_{end}_CM")) is not None:
            return centimetres / 100.0
    return None


def _layers(rows: Rows, t_s: F64, name: str, found: LoggedRanges) -> None:
    distances_m = np.column_stack([rows.column(sector) for sector in _SECTORS])
    layers = rows.column("Layer") if rows.has("Layer") else np.full(len(rows), float(_LEVEL_LAYER))
    is_healthy = rows.column("He", "Health")
    nothing_m = _nothing_m(distances_m)
    found.notes += _doubts(distances_m, nothing_m, name)
    for t, layer, health, row_m in zip(t_s.tolist(), layers.tolist(), is_healthy.tolist(), distances_m, strict=True):
        if name == FILTERED and health != _HEALTHY:
            found.not_valid[f"{name}: not healthy"] += 1
        elif layer not in _LAYERS:
            found.not_valid[f"{name}: layer {layer:g} is not understood"] += 1
        else:
            found.take(f"{name} layer {layer:g}", t, _layer(row_m.tolist(), layer, nothing_m))


def _nothing_m(distances_m: F64) -> float:
    """The farthest that is told twice: a single one may be a broken record's, and then all others would be hits."""
    values, counts = np.unique(distances_m[np.isfinite(distances_m)], return_counts=True)
    again = values[counts > 1]
    return float(again[-1]) if len(again) else math.inf


def _doubts(distances_m: F64, nothing_m: float, name: str) -> list[str]:
    """Whether another distance may stand for nothing, as where a limit was changed or nothing is never told."""
    far_m = distances_m[np.isfinite(distances_m) & (distances_m > _FAR_SHARE * nothing_m) & (distances_m <= nothing_m)]
    values, counts = np.unique(far_m, return_counts=True)
    if len(values) < 2 or int(counts[-1]) >= _CLEARLY * int(counts[:-1].max()):
        return []
    most = int(np.argmax(counts[:-1]))
    return [
        f"{name}: {nothing_m:g} m, the farthest that was told twice, is taken for nothing seen. It was told "
        f"{counts[-1]} times and {values[most]:g} m {counts[most]} times: if that stood for nothing too, what the map "
        f"has there is not real; if {nothing_m:g} m was measured, what stood there and beyond is missing."
    ]


def _layer(distances_m: list[float], layer: float, nothing_m: float) -> Scan:
    elevation_rad = (layer - _LEVEL_LAYER) * _LAYER_RAD
    hits = [
        (number * _SECTOR_RAD, elevation_rad, range_m)
        for number, range_m in enumerate(distances_m)
        if _NEAREST_M <= range_m < nothing_m
    ]
    return Scan(hits, [], _SECTOR_RAD, Limits(_NEAREST_M, nothing_m), "body")
