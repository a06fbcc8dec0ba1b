"""Which radar targets are believed: what known ground, noise and side lobes cannot account for, seen more than once."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.poses import Pose
from mapping.perceiving.ground import GroundGrid
from mapping.perceiving.ground_beams import BeamShape
from mapping.perceiving.radar_near import Column, Weighted, columns, stronger_aside, weighted
from mapping.radar.radar_params import OBJECT_SPEED_CELL_M_S, OBJECT_SPEED_CELLS
from mapping.radar.targets import Gate, Polar

BESIDE_RAD = math.radians(3.0)
"""Of the gate, to both sides: the noise of azimuths."""


@dataclass(frozen=True, slots=True)
class EvidenceParams:
    """Of an AWR1843 and of ground at 77 GHz.

    The rule of known ground alone (a target whose beam cell meets the surface model is explained) would also explain
    a mast that stands on it, since the radar hardly tells elevations; and it would not explain the many echoes of
    ground below the gate that the error of the elevation brings into it. How strong a target is tells both apart.
    """

    beam: BeamShape = field(default_factory=BeamShape)
    rated_range_m: float = 120.0
    rated_snr_db: float = 17.8
    """Mean, of 1 m2 straight ahead at the rated range."""
    side_6db_rad: float = math.radians(50.0)
    """Off the axis in azimuth where one antenna's gain is down by 6 dB."""
    ground_db: float = -13.0
    """Cross section of ground over the area it shows; earth is -16, bush -11."""
    above_ground: float = 10.0
    """So many times stronger than the mean of the ground in its cell no fading echo of ground below the gate is."""
    above_met_ground: float = 30.0
    """The same where the ground itself reaches into the gate: rocks, walls and known trees among it."""
    least_m2: float = 0.01
    """Nothing smaller is an obstacle that is seen once or twice; noise at close range is far smaller."""
    small_m2: float = 0.1
    far_m: float = 30.0
    """A smaller one farther away than this is doubtful: the rim of a ridge or a crown that the surface model hides
    just so shows as much, and there is time to look again from nearer."""
    low_m: float = 2.0
    """Above known ground; lower, while it takes off and lands, every echo grazes it and nothing is believed."""
    elevation_error_rad: float = math.radians(21.0)
    """Three sigma."""
    side_lobe_sine: float = 0.357
    side_lobe_width_sine: float = 0.07
    side_lobe_range_m: float = 1.5
    side_lobe_below_db: float = 2.0
    speed_cell_m_s: float = OBJECT_SPEED_CELL_M_S
    speed_error: float = 0.05
    """Share of the vehicle's speed: its direction and the target's are not known any better."""
    folded_m_s: float = OBJECT_SPEED_CELLS * OBJECT_SPEED_CELL_M_S
    moves_m_s: float = 1.0
    """Over ground, along the line of sight: slower ones are not told from what stands still."""
    below_share: float = 1.0 - math.cos(math.radians(35.0))
    """By which the lowest that the beam reaches comes nearer more slowly than what is level."""
    azimuth_sigma_rad: float = math.radians(1.0)
    """Straight ahead; beside it grows as 1 / cos."""
    most_aside_m: float = 1.3
    """A target that may be farther off its place than this (one sigma) is not believed before it is seen from nearer:
    the map keeps it for good, in a voxel of 1 m."""
    same_place_m: float = 1.5
    """Targets within so much of each other, seen from above, are the same thing."""
    grows_m: float = 3.0
    """By so much at once a believed column grows upwards, as the vehicle climbs beside it."""
    memory_s: float = 1.5
    enough: float = 2.0
    """Frames in which a thing must have been seen; doubtful ones count half."""


@dataclass(frozen=True, slots=True)
class _Recent:
    t_s: float
    points_enu: F64
    seen: Weighted


class RadarEvidence:
    """Remembers targets for a moment, and for good the places that are believed, as columns one metre wide with their
    tops."""

    def __init__(self, params: EvidenceParams | None = None) -> None:
        self._params = params or EvidenceParams()
        self.clear()

    def set_gate(self, gate: Gate) -> None:
        """Where targets are looked for, and the noise of their azimuths beside it."""
        beam = replace(
            self._params.beam,
            azimuth_rad=gate.azimuth_rad + BESIDE_RAD,
            elevation_low_rad=gate.elevation_low_rad,
            elevation_high_rad=gate.elevation_high_rad,
        )
        self._params = replace(self._params, beam=beam)

    def clear(self) -> None:
        self._recent: deque[_Recent] = deque()
        self._believed: dict[Column, float] = {}

    def judge(self, t_mono_s: float, points_enu: F64, weight: F64) -> tuple[Bools, F64]:
        """Targets (N, 3) of a frame and the weight of each -> which are believed, and earlier ones that are now.

        The first is (N,), the second (M, 3).
        """
        p = self._params
        while self._recent and self._recent[0].t_s < t_mono_s - p.memory_s:
            self._recent.popleft()
        kept = weight > 0
        counted = points_enu[kept]
        self._recent.append(_Recent(t_mono_s, counted, weighted(counted, weight[kept])))
        score = np.zeros(len(points_enu))
        for recent in self._recent:
            score += recent.seen.heaviest_near(points_enu, p.same_place_m)
        sure = kept & (score >= p.enough)
        fresh = self._believe(points_enu[sure])
        return sure | self._are_known(points_enu), self._earlier_near(fresh)

    def disbelieve(self, gone: Iterable[Column]) -> None:
        """What was believed there has gone."""
        for column in gone:
            self._believed.pop(column, None)

    def _believe(self, points: F64) -> F64:
        """Those of which the column is believed only now."""
        fresh = points[~self._are_known(points)]
        for column, top_m in zip(columns(points), points[:, 2].tolist(), strict=True):
            self._believed[column] = max(top_m, self._believed.get(column, -math.inf))
        return fresh

    def _are_known(self, points: F64) -> Bools:
        """(N,) In a believed column, or little above it: noise far above would make a mast of a hut."""
        tops_m = [self._believed.get(column, -math.inf) for column in columns(points)]
        return points[:, 2] <= np.array(tops_m) + self._params.grows_m

    def _earlier_near(self, fresh: F64) -> F64:
        if not len(fresh):
            return fresh
        now, within_m = weighted(fresh, np.ones(len(fresh))), self._params.same_place_m
        earlier = [recent.points_enu for recent in list(self._recent)[:-1]]
        near = [points[now.heaviest_near(points, within_m) > 0] for points in earlier]
        return np.concatenate([np.empty((0, 3)), *near])

    def weights(self, targets: Polar, snr_db: F64, radial_speed_m_s: F64, pose: Pose, ground: GroundGrid | None) -> F64:
        """(N,) what each target counts: 1 unaccounted for, 0.5 doubtful, 0 accounted for."""
        p = self._params
        if ground is not None and pose.position_enu_m[2] - ground.up(pose.position_enu_m[None, :])[0] < p.low_m:
            return np.zeros(len(snr_db))
        size_m2 = self._cross_section_m2(targets, snr_db)
        gaps, ground_m2 = np.full(len(size_m2), np.inf), np.zeros(len(size_m2))
        if ground is not None:
            gaps, shown_m2 = self._expected(targets, pose, ground)
            ground_m2 = shown_m2 * 10 ** (p.ground_db / 10)
        times = np.where(gaps <= 0.0, p.above_met_ground, p.above_ground)
        strong = size_m2 > np.maximum(p.least_m2, times * ground_m2)
        fixed = self._is_fixed(targets, radial_speed_m_s, pose)
        free = gaps > p.elevation_error_rad
        sure = fixed & ((size_m2 > p.small_m2) | (targets.range_m < p.far_m))
        aside_m = targets.range_m * p.azimuth_sigma_rad / np.maximum(np.cos(targets.azimuth_rad), 0.3)
        weight = np.where(strong, np.where(sure, 1.0, 0.5), np.where(free & fixed, 0.5, 0.0))
        return np.where(aside_m <= p.most_aside_m, weight, 0.0)

    def _expected(self, targets: Polar, pose: Pose, ground: GroundGrid) -> tuple[F64, F64]:
        """Of the ground: gap and area in the targets' cells."""
        farthest_m = float(targets.range_m.max(initial=0.0))
        fan = ground.fan(pose.position_enu_m, pose.rotation_enu_body, farthest_m=farthest_m, shape=self._params.beam)
        return fan.look(targets.azimuth_rad, targets.range_m)

    def _cross_section_m2(self, targets: Polar, snr_db: F64) -> F64:
        """From the radar equation, as if straight ahead in elevation."""
        p = self._params
        off = np.minimum(np.abs(targets.azimuth_rad) / p.side_6db_rad, 1.0)
        db = snr_db - p.rated_snr_db + 40 * np.log10(targets.range_m / p.rated_range_m) + 12 * off**2
        return 10 ** (np.clip(db, -100, 100) / 10)

    def moving(self, targets: Polar, snr_db: F64, radial_speed_m_s: F64, pose: Pose) -> Bools:
        """(N,) Which move over ground for sure, by their radial speed.

        No ground accounts for them, however weak they are: it would stand in another cell of speed. But what is seen
        far below, and measured level, comes nearer more slowly than the vehicle flies.
        """
        p = self._params
        off, ahead, known_to = self._off_fixed(targets, radial_speed_m_s, pose)
        low = max(p.moves_m_s, known_to)
        high = np.maximum(p.moves_m_s, known_to + p.below_share * np.maximum(ahead, 0.0))
        return ((off < -low) | (off > high)) & (self._cross_section_m2(targets, snr_db) > p.least_m2)

    def over_ground_m_s(self, targets: Polar, radial_speed_m_s: F64, pose: Pose) -> F64:
        """(N,) Radial speeds less those of things that stand still."""
        return self._off_fixed(targets, radial_speed_m_s, pose)[0]

    def _is_fixed(self, targets: Polar, radial_speed_m_s: F64, pose: Pose) -> Bools:
        """Whether a target's radial speed is that of a thing that stands still."""
        off, _, known_to = self._off_fixed(targets, radial_speed_m_s, pose)
        return np.abs(off) <= known_to

    def _off_fixed(self, targets: Polar, radial_speed_m_s: F64, pose: Pose) -> tuple[F64, F64, float]:
        """(N,) radial speeds less those of things that stand still, (N,) the vehicle's speed towards these, and how
        well the first is known."""
        p = self._params
        a = targets.azimuth_rad + pose.heading_rad
        v = pose.velocity_enu_m_s
        ahead = v[0] * np.sin(a) + v[1] * np.cos(a)
        off = radial_speed_m_s + ahead * np.cos(targets.elevation_rad)
        off = np.remainder(off + p.folded_m_s / 2, p.folded_m_s) - p.folded_m_s / 2
        climbing = abs(v[2]) * math.sin(p.elevation_error_rad)
        return off, ahead, 1.5 * p.speed_cell_m_s + p.speed_error * float(np.linalg.norm(v)) + climbing


def side_lobes(targets: Polar, snr_db: F64, params: EvidenceParams | None = None) -> Bools:
    """(N,) Which targets are ghosts: at the range of a stronger one, where its first side lobe looks.

    Give it all targets of a frame: the stronger one may itself have been measured outside the gate.
    """
    p = params or EvidenceParams()
    return stronger_aside(
        targets.range_m,
        np.sin(targets.azimuth_rad),
        snr_db,
        within_m=p.side_lobe_range_m,
        aside=p.side_lobe_sine,
        width=p.side_lobe_width_sine,
        by_db=p.side_lobe_below_db,
    )
