"""What the plan lane's worker does to take maps into a plan: their unexplained voxels become columns on its model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapping.geometry.frames import LocalFrame
from planning.evading.seen import columns_from_voxels
from server.errors import NotReadyError
from server.library.seen_columns import SeenColumns, store_seen
from server.library.terrains import load_terrain
from server.scene.mirror import Voxels
from server.work.jobs import Progress


def keep_seen(directory: Path, maps: list[Voxels], *, report: Progress) -> str:
    """The id under which the columns are kept beside the model. Raises NotReadyError."""
    report("Taking in what was seen", None)
    dsm = load_terrain(directory)
    columns = []
    for voxels in maps:
        origin = voxels.origin
        assert origin is not None
        home_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([[origin.lat_deg, origin.lon_deg]])))[0])
        if not np.isfinite(home_m):
            raise NotReadyError(
                "The vehicle took off where this plan's surface model knows nothing.",
                advice="Open the plan that is flown.",
            )
        frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
        centres = voxels.centres_enu_m[~voxels.explained]
        columns.append(columns_from_voxels(centres, voxels.resolution_m, frame=frame, dsm=dsm, home_alt_dsm_m=home_m))
    return store_seen(directory, SeenColumns(tuple(columns)))
