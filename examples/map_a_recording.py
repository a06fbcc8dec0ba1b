"""Build the map of obstacles once more from a recorded flight, at any resolution, as a point cloud.

python examples/map_a_recording.py [flight.mcap] [--sensor radar] [--resolution-m 0.5] [--out radar.ply]
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapping import LocalFrame
from mapping.sensor_frames import RadarFrame
from telemetry.perception.rebuilding.export import exported
from telemetry.perception.rebuilding.rebuild import OtherMap, rebuild
from telemetry.perception.sensor_kinds import KINDS
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState

HOME = (45.0, 10.0, 120.0)
UP_M, SPEED_M_S, WALL_NORTH_M = 10.0, 3.0, 40.0


def record(path: Path, seconds: float = 6.0) -> None:
    """A vehicle flies north at 10 m above home, towards a wall that its radar sees ten times a second."""
    rng, local, clock = np.random.default_rng(1), LocalFrame(*HOME), [0.0]
    writer = RecordingWriter(path, t_utc_s=1.7e9, t_mono_s=0.0, name="example", now=lambda: clock[0])
    for number in range(int(10 * seconds)):
        clock[0] = t_s = number / 10
        lat_deg, lon_deg, _ = local.to_geodetic([[0.0, SPEED_M_S * t_s, UP_M]])[0].tolist()
        state = VehicleState(
            1, 1, t_utc_s=1.7e9 + t_s, position_t_mono_s=t_s, lat_deg=lat_deg, lon_deg=lon_deg, alt_rel_home_m=UP_M,
            attitude_t_mono_s=t_s, heading_rad=0.0, pitch_rad=0.0, roll_rad=0.0, gnss_fix="rtk_fixed", armed=True,
            alt_amsl_m=HOME[2] + UP_M, home_lat_deg=HOME[0], home_lon_deg=HOME[1], home_alt_amsl_m=HOME[2],
        )  # fmt: skip
        away_m = WALL_NORTH_M - SPEED_M_S * t_s
        xyz_m = np.column_stack([rng.uniform(-6, 6, 12), rng.normal(away_m, 0.1, 12), rng.uniform(0, 0.5, 12)])
        frame = RadarFrame.of(
            xyz_m, np.full(12, -SPEED_M_S), np.full(12, 30.0),
            t_mono_s=t_s, t_utc_s=1.7e9 + t_s, number=number, source="example",
        )  # fmt: skip
        writer.write(Topic.VEHICLE, state, 1.7e9 + t_s)
        writer.write(Topic.RADAR_FRAME, frame, 1.7e9 + t_s)
    writer.close()


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path, nargs="?", help="of a flight, .mcap; default: a made-up one")
    parser.add_argument("--sensor", choices=sorted(KINDS), default="radar")
    parser.add_argument("--resolution-m", type=float, help="edge of a voxel; default: as in flight")
    parser.add_argument("--out", type=Path, help="point cloud of the occupied voxels, .ply")
    given = parser.parse_args(arguments)

    with tempfile.TemporaryDirectory() as folder:
        recording = given.recording or Path(folder, "flight.mcap")
        if not given.recording:
            record(recording)
        built = rebuild(recording, KINDS[given.sensor], other=OtherMap(resolution_m=given.resolution_m))

    east_m, north_m, up_m = built.extent_m
    print(f"{built.frames} frames with {built.points} points, {built.dropped} frames were not taken")
    print(f"{built.voxels_occupied} occupied voxels of {built.resolution_m:g} m")
    print(f"they reach over {east_m:.1f} m east, {north_m:.1f} m north, {up_m:.1f} m up")
    if given.out:
        given.out.write_bytes(exported("ply", built.folded))
        print(f"written to {given.out}")


if __name__ == "__main__":
    main()
