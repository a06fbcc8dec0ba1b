"""A camera that follows a vehicle from behind and above, as near as what it flies towards allows.

It goes with the vehicle and turns with its nose, slowly. While a hand is on the camera it waits, and then follows from
where the hand has left it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from server.scene.cameras.projection import Pose

BACK_M, ABOVE_M, AHEAD_M = 17.0, 9.0, 5.0
"""Of the camera from the vehicle, and of where it looks: a region of 10 m fills the middle of the picture."""
TURN_S = 1.5
"""Time constant of turning with the nose."""
SETTLE_S = 0.4
"""After the hand: its last movement is still on its way."""
_NARROW = 1.2
"""Width to height below which it stands farther back, so that a region still fits sideways."""
_LEAST_ABOVE_GROUND_M = 3.0


@dataclass(frozen=True, slots=True)
class Offset:
    """Of the camera from where it looks, in a frame that turns with the vehicle."""

    back_m: float
    right_m: float
    up_m: float


@dataclass(frozen=True, slots=True)
class Chase:
    """One page's camera behind one vehicle."""

    offset: Offset
    heading_rad: float
    """Clockwise from north, smoothed."""
    t_s: float
    held: bool = False
    released_s: float = -math.inf

    @staticmethod
    def behind(heading_rad: float, t_s: float, *, aspect: float) -> Chase:
        farther = max(1.0, _NARROW / max(aspect, 0.3))
        return Chase(Offset((BACK_M + AHEAD_M) * farther, 0.0, ABOVE_M * farther), heading_rad, t_s)

    def onward(self, heading_rad: float, t_s: float) -> Chase:
        """Turned towards the vehicle's heading by as much as the time since the last step allows."""
        turn = math.remainder(heading_rad - self.heading_rad, math.tau)
        share = 1.0 - math.exp(-max(0.0, t_s - self.t_s) / TURN_S)
        return replace(self, heading_rad=self.heading_rad + share * turn, t_s=t_s)

    def hold(self, t_s: float, *, held: bool) -> Chase:
        return replace(self, held=held, released_s=self.released_s if held else t_s)

    def is_waiting(self, t_s: float) -> bool:
        return self.held or t_s - self.released_s < SETTLE_S

    def left_at(self, pose: Pose) -> Chase:
        """From now on from where the hand has left the camera."""
        ahead, right = _axes(self.heading_rad)
        away = pose.position - pose.look_at
        offset = Offset(-float(away @ ahead), float(away @ right), float(away[2]))
        return replace(self, offset=offset, released_s=-math.inf)

    @property
    def is_to_be_left(self) -> bool:
        return not self.held and math.isfinite(self.released_s)

    def pose(self, vehicle: F64, *, ground: float) -> Pose:
        """(3,) the vehicle in the scene; ``ground``: height of what is drawn under the camera, see ``under``."""
        ahead, _ = _axes(self.heading_rad)
        look_at = vehicle + AHEAD_M * ahead
        position = look_at + self._away()
        position[2] = max(position[2], ground + _LEAST_ABOVE_GROUND_M)
        return Pose(position, look_at)

    def under(self, vehicle: F64) -> F64:
        """(3,) where the camera stands unless the ground is higher."""
        ahead, _ = _axes(self.heading_rad)
        return vehicle + AHEAD_M * ahead + self._away()

    def _away(self) -> F64:
        ahead, right = _axes(self.heading_rad)
        return -self.offset.back_m * ahead + self.offset.right_m * right + np.array([0.0, 0.0, self.offset.up_m])


def _axes(heading_rad: float) -> tuple[F64, F64]:
    """Ahead and to the right, in the scene: x east, y north."""
    ahead = np.array([math.sin(heading_rad), math.cos(heading_rad), 0.0])
    return ahead, np.array([ahead[1], -ahead[0], 0.0])
