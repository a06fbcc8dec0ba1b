"""A vertical slice through the maps where the vehicle is, as the paper draws them (Miccinesi 2022, figs 14, 18).

And the radar's newest targets in its own frame (fig. 12), and maps as files. All are asked for by pages.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence

import numpy as np

from mapping.geometry.arrays import F64
from mapping.sensor_frames import rows
from server.obstacles.obstacle_watch import Watch
from server.scene.layers.sights import Sights
from server.scene.mirror import Voxels
from server.schemas import MapFormat, RadarTargetsDoc, SectionAsked, SectionDoc, SectionMap, Source
from server.work.jobs import Progress
from telemetry.topics.obstacles import MAP_NAMES, MapDelta, MapName, MapOrigin, PerceptionStatus

MOST_CELLS = 4_000
"""Of one map: more than a panel has pixels for."""
_GROUND_SAMPLES = 121


class Looking:
    """What pages look at beside the 3D view; nothing here changes anything."""

    def __init__(self, watches: Mapping[Source, Watch], grounds: Sights | None) -> None:
        self._watches, self._grounds = watches, grounds

    async def section(self, asked: SectionAsked) -> SectionDoc:
        """Where the vehicle is, or was at the replay's time. Takes milliseconds."""
        return await asyncio.to_thread(self._section, asked)

    def _section(self, asked: SectionAsked) -> SectionDoc:
        watch, thickness_m, reach_m = self._watches[asked.source], asked.thickness_m, asked.reach_m
        found = SectionDoc(across=asked.across, thickness_m=thickness_m, reach_m=reach_m)
        status = placed_status(list(watch.statuses.values()))
        if status is None or status.region is None or status.origin is None:
            return found.model_copy(update={"text": "No sensor tells where the vehicle is."})
        at, heading_rad = np.array(status.region.enu_m), status.region.heading_rad
        axis = level_axis(heading_rad + (math.pi / 2 if asked.across else 0.0))
        maps = [watch.mirrors[name].voxels() for name in MAP_NAMES if watch.mirrors[name].origin == status.origin]
        s_m, up_m = self._ground(status.origin, at, axis, reach_m)
        return found.model_copy(
            update={
                "vehicle_up_m": float(at[2]),
                "heading_deg": math.degrees(heading_rad) % 360.0,
                "ground_s_m": s_m,
                "ground_up_m": up_m,
                "maps": [sliced(m, at, axis, thickness_m=thickness_m, reach_m=reach_m) for m in maps if len(m.keys)],
            }
        )

    def _ground(self, origin: MapOrigin, at: F64, axis: F64, reach_m: float) -> tuple[list[float], list[float | None]]:
        if self._grounds is None:
            return [], []
        s_m = np.linspace(-reach_m, reach_m, _GROUND_SAMPLES)
        up_m = self._grounds.ground_up_m(origin, at + s_m[:, None] * axis)
        return s_m.round(2).tolist(), [round(float(up), 2) if math.isfinite(up) else None for up in up_m]

    async def targets(self, source: Source) -> RadarTargetsDoc:
        look = self._watches[source].radar_look
        if look is None:
            return RadarTargetsDoc()
        xyz = rows(look.xyz_m, 3).astype(np.float64).round(2)
        return RadarTargetsDoc(
            t_mono_s=look.t_mono_s,
            right_m=xyz[:, 0].tolist(),
            ahead_m=xyz[:, 1].tolist(),
            up_m=xyz[:, 2].tolist(),
            kept=[bool(kept) for kept in look.kept],
            azimuth_deg=math.degrees(look.azimuth_rad),
            low_deg=math.degrees(look.low_rad),
            high_deg=math.degrees(look.high_rad),
            nearest_m=look.nearest_m,
            farthest_m=look.farthest_m,
        )


def placed_status(statuses: Sequence[PerceptionStatus]) -> PerceptionStatus | None:
    """By which the vehicle's place is known: the radar's before the others', for it stands in GNSS positions."""
    known = [s for s in statuses if s.placed and s.region is not None and s.origin is not None]
    return min(known, key=lambda s: (s.sensor != "radar", -s.t_mono_s), default=None)


def level_axis(bearing_rad: float) -> F64:
    """(3,) a level unit vector, clockwise from north."""
    return np.array([math.sin(bearing_rad), math.cos(bearing_rad), 0.0])


def sliced(voxels: Voxels, at: F64, axis: F64, *, thickness_m: float, reach_m: float) -> SectionMap:
    """Voxels within the slice, laid onto its plane: (s along ``axis`` from ``at``, up above home), each cell once.

    A cell in which anything stands that is not known ground is no known ground.
    """
    away = voxels.centres_enu_m - at
    aside = np.array([axis[1], -axis[0], 0.0])
    half_m = max(thickness_m, voxels.resolution_m) / 2
    inside = (np.abs(away @ aside) <= half_m) & (np.abs(away @ axis) <= reach_m)
    edge_m = voxels.resolution_m
    cells = np.column_stack([np.rint((away[inside] @ axis) / edge_m), voxels.keys[inside, 2]]).astype(np.int64)
    cells, where = np.unique(cells, axis=0, return_inverse=True)
    seen = np.zeros(len(cells), np.bool_)
    seen[where.ravel()[~voxels.explained[inside]]] = True
    chosen = np.argsort(~seen, kind="stable")[:MOST_CELLS]
    return SectionMap(
        name=voxels.sensor,
        resolution_m=edge_m,
        s_m=(cells[chosen, 0] * edge_m).round(2).tolist(),
        up_m=((cells[chosen, 1] + 0.5) * edge_m).round(2).tolist(),
        known_ground=(~seen[chosen]).tolist(),
        left_out=len(cells) - len(chosen),
    )


def map_file(voxels: Voxels, name: MapName, kind: MapFormat, *, report: Progress) -> bytes:
    """Like the files of ``hedgehop map``; for a worker. Raises ExportError for a map that the format cannot hold."""
    from telemetry.perception.rebuilding.export import exported
    from telemetry.topics import deltas

    report("Writing the map", None)
    assert voxels.origin is not None
    last = MapDelta(name, 0.0, 0.0, 0, True, 0, 1, voxels.origin, voxels.resolution_m, b"", b"", b"")
    kept = deltas.Voxels(voxels.keys, voxels.probability, voxels.explained.astype("u1"))
    return exported(kind, deltas.FoldedMap(last, kept))
