"""Raw samples of an FMCW radar become targets: range FFT, Doppler FFT, CFAR, direction of arrival.

python examples/detect_radar_targets.py [cube.npy] [--radar awr1843]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping import AWR1843, POSITION2GO, POSITION2GO_SETTINGS, ChainSettings, FmcwParams, RadarChain

RADARS = {"awr1843": (AWR1843, ChainSettings()), "position2go": (POSITION2GO, POSITION2GO_SETTINGS)}
LIGHT_M_S = 299_792_458.0


def two_targets(radar: FmcwParams) -> NDArray[np.complex64]:
    """(chirps, antennas, samples) in noise: one stands 8 m ahead, one comes from 5 m, 20 degrees right, at 1.5 m/s."""
    rng = np.random.default_rng(1)
    cube = (rng.standard_normal(radar.shape) + 1j * rng.standard_normal(radar.shape)).astype(np.complex128)
    sample_s = np.arange(radar.samples) / radar.sample_rate_hz
    sent_s = np.arange(radar.chirps)[:, None] * radar.chirp_interval_s + radar.offset_s
    for range_m, speed_m_s, azimuth_rad in ((8.0, 0.0, 0.0), (5.0, -1.5, np.radians(20.0))):
        way_m = range_m + speed_m_s * sent_s[:, :, None]
        beat = radar.slope_hz_per_s * 2 * way_m / LIGHT_M_S * sample_s
        nearer = radar.position_wavelengths[:, 0, None] * np.sin(azimuth_rad)
        cube += 2.0 * np.exp(2j * np.pi * (beat + 2 * way_m / radar.wavelength_m - nearer))
    return cube.astype(np.complex64)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "cube", type=Path, nargs="?", help=".npy, complex (chirps, antennas, samples); default: made up"
    )
    parser.add_argument("--radar", choices=RADARS, default="awr1843")
    given = parser.parse_args(arguments)

    radar, settings = RADARS[given.radar]
    cube = np.load(given.cube, allow_pickle=False) if given.cube else two_targets(radar)
    found = RadarChain(radar, settings).process(cube)

    print(f"cells of {radar.range_resolution_m:.2f} m to {radar.max_range_m:.0f} m,", end=" ")
    print(f"{radar.velocity_resolution_m_s:.2f} m/s to {radar.max_velocity_m_s:.1f} m/s; {len(found)} targets")
    for i in range(len(found)):
        x_m, y_m, _ = found.xyz_m[i]
        print(
            f"{found.range_m[i]:6.2f} m, {found.radial_speed_m_s[i]:+5.2f} m/s, "
            f"{np.degrees(found.azimuth_rad[i]):+6.1f} deg to the right, {found.snr_db[i]:4.1f} dB: "
            f"{x_m:.2f} m right, {y_m:.2f} m ahead"
        )


if __name__ == "__main__":
    main()
