"""What stands around the simulated vehicle: ground that is flat or a surface model."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3


class Ground(Protocol):
    """Height of whatever stands highest at a place."""

    def up_m(self, north_m: float, east_m: float) -> float:
        """Metres above the origin of the frame."""
        ...


class Obstacles(Protocol):
    """What stands on the ground. Places are east, north, up."""

    def touching(self, p_enu: Vec3, radius_m: float) -> str | None:
        """The name of what a ball of this radius touches."""
        ...

    def at(self, t_s: float) -> Obstacles:
        """As they are at that simulated time: some may move."""
        ...

    def top_under_m(self, p_enu: Vec3) -> float:
        """Height of the highest thing under a place that carries a vehicle; -inf without one."""
        ...


class FlatGround:
    """Level at the height of the origin."""

    def up_m(self, north_m: float, east_m: float) -> float:
        return 0.0


class SurfaceGround:
    """A surface model, shifted so that its height at the origin is the origin's.

    Where the model knows nothing the ground is as low as its lowest cell.
    """

    def __init__(self, dsm: Dsm, frame: NeuFrame) -> None:
        self._dsm = dsm
        self._frame = frame
        self._lowest_m = float(np.nanmin(dsm.elevation_m))
        self._origin_m = self._elevation_m(0.0, 0.0)
        if np.isnan(self._origin_m):
            raise ParameterError(
                f"The surface model knows no height at {frame.lat_deg:.7f}, {frame.lon_deg:.7f}.",
                where="simulated vehicle",
                advice="Give a home inside the surface model.",
            )

    def up_m(self, north_m: float, east_m: float) -> float:
        elevation_m = self._elevation_m(north_m, east_m)
        return (self._lowest_m if np.isnan(elevation_m) else elevation_m) - self._origin_m

    def _elevation_m(self, north_m: float, east_m: float) -> float:
        lat_deg, lon_deg, _ = self._frame.geodetic_from_neu((north_m, east_m, 0.0))
        return float(self._dsm.elevation_at(self._dsm.xy_from_lat_lon(np.array([[lat_deg, lon_deg]])))[0])
