"""Sensors on the body (x right, y forward, z up): its turn to east, north, up as it really is, and a radar's frame."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64
from mapping.sensor_frames import RadarFrame, packed
from telemetry.topics.vehicle import SimTruth


def rotation_enu_body(roll_rad: float, pitch_rad: float, heading_rad: float) -> F64:
    """(3, 3) Rz(-heading) Rx(pitch) Ry(roll): nose up and right wing down are positive (Miccinesi 2022, eq. 3)."""
    ch, sh = math.cos(heading_rad), math.sin(heading_rad)
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    turn = np.array([[ch, sh, 0.0], [-sh, ch, 0.0], [0.0, 0.0, 1.0]])
    nose = np.array([[1.0, 0.0, 0.0], [0.0, cp, -sp], [0.0, sp, cp]])
    wing = np.array([[cr, 0.0, sr], [0.0, 1.0, 0.0], [-sr, 0.0, cr]])
    return turn @ nose @ wing  # Miccinesi 2022, eq. 3


def of_truth(truth: SimTruth) -> F64:
    return rotation_enu_body(truth.roll_rad, truth.pitch_rad, truth.heading_rad)


def radar_frame(truth: SimTruth, number: int, xyz_m: F64, speed_m_s: ArrayLike, snr_db: ArrayLike) -> RadarFrame:
    """What a radar measured there, in the body's frame."""
    columns = (packed(xyz_m), packed(speed_m_s), packed(snr_db))
    return RadarFrame(truth.t_mono_s, truth.t_utc_s, number, "simulated", *columns)


def quaternion_wxyz(rotation: F64) -> tuple[float, float, float, float]:
    """Unit quaternion of a rotation matrix, w not negative."""
    m = rotation
    squares = np.array(
        [1 + m[0, 0] + m[1, 1] + m[2, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2],
         1 - m[0, 0] + m[1, 1] - m[2, 2], 1 - m[0, 0] - m[1, 1] + m[2, 2]]
    )  # fmt: skip
    # The largest component is divided by: the others' signs come from sums and differences.
    products = np.array(
        [
            [squares[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], squares[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], squares[2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[3]],
        ]
    )
    q = products[int(np.argmax(squares))]
    q = q / np.linalg.norm(q) * (1.0 if q[0] >= 0 else -1.0)
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])
