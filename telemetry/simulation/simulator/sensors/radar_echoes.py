"""Everything in a world that sends the radar's signal back: patches of ground and shapes, corner reflectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64, I32
from telemetry.simulation.simulator.scene.world import World
from telemetry.simulation.simulator.sensors.radar_model import RadarModel
from telemetry.simulation.simulator.sensors.radar_rays import rays

NEAREST_M = 0.3
_MARGIN_RAD = 0.3


@dataclass(frozen=True, slots=True)
class Echoes:
    """Scatterers, each a small patch."""

    offset_enu: F64
    """(N, 3) from the radar"""
    range_m: F64
    cross_section_m2: F64
    velocity_enu_m_s: F64
    """(N, 3) Of the scatterers, over ground."""

    def radial_speed_m_s(self, own_velocity_enu_m_s: ArrayLike) -> F64:
        """(N,) As a radar that moves itself sees them; positive: moving away."""
        relative = self.velocity_enu_m_s - np.asarray(own_velocity_enu_m_s, np.float64)
        return (self.offset_enu * relative).sum(axis=1) / self.range_m


def echoes(world: World, model: RadarModel, position_enu: F64, body_enu: F64, random: np.random.Generator) -> Echoes:
    """What the radar's beam lights. ``body_enu`` (3, 3) is R_enu_body.

    The ground is looked at with rays one degree apart, every shape with rays of its own, so that thin things are
    neither missed nor made thicker: each ray stands for its solid angle, and a surface of reflectivity g sends back
    g times the area that it shows (the ray's area across, whatever the slant). All rays move a little every frame.
    """
    near = world.ahead(
        position_enu, body_enu[:, 1], within_m=model.range_m, half_angle_rad=model.half_width_rad + _MARGIN_RAD
    )
    plain = near[world.placed.corner_m2[near] == 0]
    sent = rays(model, world.placed.rows[plain], plain, position_enu, body_enu, random)
    luck = 1.0 - random.random(len(sent.wanted))
    hits = world.cast(position_enu, sent.direction_enu, luck, most_m=model.range_m, near=near)
    kept = np.flatnonzero((hits.what == sent.wanted) & (hits.distance_m > NEAREST_M))
    range_m = hits.distance_m[kept]
    patches = Echoes(
        sent.direction_enu[kept] * range_m[:, None],
        range_m,
        world.reflectivity(hits.what[kept]) * sent.solid_angle[kept] * range_m**2,
        world.velocity_enu_m_s(hits.what[kept]),
    )
    return _joined(patches, _corners(world, position_enu, near, model.range_m))


def _corners(world: World, position_enu: F64, near: I32, most_m: float) -> Echoes:
    """Corner reflectors in sight: points with a cross section of their own."""
    numbers = near[world.placed.corner_m2[near] > 0]
    rows = world.placed.rows[numbers]
    offset = np.column_stack([rows[:, 1], rows[:, 2], (rows[:, 3] + rows[:, 4]) / 2]) - position_enu
    range_m = np.linalg.norm(offset, axis=1)
    direction = offset / np.maximum(range_m, 1e-9)[:, None]
    # Half of what is sent gets past the leaves within ln 2 of their mean way.
    hits = world.cast(position_enu, direction, np.full(len(numbers), 0.5), most_m=most_m, near=near)
    seen = (hits.what == numbers) & (range_m > NEAREST_M)
    velocity = world.velocity_enu_m_s(numbers)
    return Echoes(offset[seen], range_m[seen], world.placed.corner_m2[numbers][seen], velocity[seen])


def _joined(a: Echoes, b: Echoes) -> Echoes:
    return Echoes(
        np.concatenate([a.offset_enu, b.offset_enu]),
        np.concatenate([a.range_m, b.range_m]),
        np.concatenate([a.cross_section_m2, b.cross_section_m2]),
        np.concatenate([a.velocity_enu_m_s, b.velocity_enu_m_s]),
    )
