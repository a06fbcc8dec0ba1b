"""Raw radar files in numbers, for command line and console alike: parameters and detections."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mapping.radar.detections import Detections
    from mapping.radar.radar_params import FmcwParams
    from telemetry.sensors.adc.adc_file import AdcFile


def parameters(sensor: str, opened: AdcFile) -> dict[str, Any]:
    """What the frames were taken for."""
    p: FmcwParams = opened.params
    return {
        "sensor": sensor,
        "chirps": p.chirps,
        "antennas": len(p.antennas),
        "samples": p.samples,
        "start_frequency_hz": p.start_frequency_hz,
        "slope_hz_per_s": p.slope_hz_per_s,
        "sample_rate_hz": p.sample_rate_hz,
        "chirp_interval_s": p.chirp_interval_s,
        "frame_period_s": opened.period_s,
        "wavelength_m": p.wavelength_m,
        "range_resolution_m": p.range_resolution_m,
        "max_range_m": p.max_range_m,
        "velocity_resolution_m_s": p.velocity_resolution_m_s,
        "max_velocity_m_s": p.max_velocity_m_s,
    }


def detection_rows(found: Detections) -> list[dict[str, Any]]:
    """All that is known of each detection, the strongest first."""
    azimuth_deg, elevation_deg, xyz_m = np.degrees(found.azimuth_rad), np.degrees(found.elevation_rad), found.xyz_m
    return [
        {
            "range_m": round(float(found.range_m[k]), 4),
            "radial_speed_m_s": round(float(found.radial_speed_m_s[k]), 4),
            "azimuth_deg": round(float(azimuth_deg[k]), 3),
            "elevation_deg": round(float(elevation_deg[k]), 3),
            "x_right_m": round(float(xyz_m[k, 0]), 4),
            "y_forward_m": round(float(xyz_m[k, 1]), 4),
            "z_up_m": round(float(xyz_m[k, 2]), 4),
            "snr_db": round(float(found.snr_db[k]), 2),
            "doppler_cell": int(found.cells[k, 0]),
            "range_cell": int(found.cells[k, 1]),
        }
        for k in np.argsort(-found.snr_db, kind="stable")
    ]
