"""What the flight lane's worker makes of a map: a file of one of four formats, like those of ``hedgehop map``."""

from __future__ import annotations

from server.scene.mirror import Voxels
from server.schemas import MapFormat
from server.work.jobs import Progress
from telemetry.topics.obstacles import MapDelta, MapName


def map_file(voxels: Voxels, name: MapName, kind: MapFormat, *, report: Progress) -> bytes:
    """Raises ExportError for a map that the format cannot hold."""
    from telemetry.rebuilding.export import exported
    from telemetry.topics import deltas

    report("Writing the map", None)
    assert voxels.origin is not None
    last = MapDelta(name, 0.0, 0.0, 0, True, 0, 1, voxels.origin, voxels.resolution_m, b"", b"", b"")
    kept = deltas.Voxels(voxels.keys, voxels.probability, voxels.explained.astype("u1"))
    return exported(kind, deltas.FoldedMap(last, kept))
