"""Figures of one radar frame: range profile, range-Doppler map with its detections, azimuth spectrum."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mapping.radar.chain import RadarChain, Spectra
from mapping.radar.detections import Detections

NAMES = ("range-profile.png", "range-doppler.png", "azimuth-spectrum.png")
SHOWN_DB = 60.0
"""Below the strongest cell of a map."""
MOST_CURVES = 5
FINE_AZIMUTH = 512
"""Cells of the spectrum that is drawn."""
_ACCENT, _MARK = "#1f6f8b", "#e4572e"


def write_figures(folder: Path, chain: RadarChain, spectra: Spectra, found: Detections, title: str) -> list[Path]:
    """Three PNG files. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    draws = (_range_profile, _range_doppler, _azimuth)
    paths = [folder / name for name in NAMES]
    for path, draw in zip(paths, draws, strict=True):
        figure = Figure(figsize=(8.0, 5.0), dpi=120, layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure, figure.add_subplot(), chain, spectra, found)
        figure.suptitle(title, fontsize=10, color="#555555")
        figure.savefig(path, metadata={"Software": None})
    return paths


def _db(power: np.ndarray) -> np.ndarray:
    return 10.0 * np.log10(np.maximum(power, 1e-12))


def _range_profile(figure: Figure, axes: Axes, chain: RadarChain, spectra: Spectra, found: Detections) -> None:
    profile = _db(spectra.range_profile)
    axes.plot(spectra.range_m, profile, color=_ACCENT, linewidth=1.2)
    if len(found):
        level = profile[np.clip(np.searchsorted(spectra.range_m, found.range_m), 0, len(profile) - 1)]
        axes.plot(found.range_m, level, "v", color=_MARK, markersize=6, label=f"{len(found)} detections")
        axes.legend()
    axes.set(title="Range profile, all speeds", xlabel="range [m]", ylabel="power [dB]")
    axes.set_xlim(0.0, float(spectra.range_m[-1]))
    axes.grid(alpha=0.3)


def _range_doppler(figure: Figure, axes: Axes, chain: RadarChain, spectra: Spectra, found: Detections) -> None:
    speeds, power = spectra.range_doppler
    level = _db(power)
    top = float(level.max())
    image = axes.pcolormesh(
        spectra.range_m,
        speeds,
        level,
        vmin=top - SHOWN_DB,
        vmax=top,
        cmap="viridis",
        shading="nearest",
        rasterized=True,
    )
    figure.colorbar(image, ax=axes, label="power [dB]")
    if len(found):
        axes.plot(
            found.range_m, found.radial_speed_m_s, "o", markersize=9, markerfacecolor="none", markeredgecolor=_MARK,
            markeredgewidth=1.5, label=f"{len(found)} detections",
        )  # fmt: skip
        axes.legend(loc="upper right")
    axes.set(title="Range and speed", xlabel="range [m]", ylabel="radial speed [m/s], positive: away")


def _azimuth(figure: Figure, axes: Axes, chain: RadarChain, spectra: Spectra, found: Detections) -> None:
    axes.set(title="Azimuth of the strongest detections", xlabel="azimuth [deg], positive: right", ylabel="power [dB]")
    axes.set_xlim(-90.0, 90.0)
    axes.grid(alpha=0.3)
    if len(chain.rows.row) < 2 or not len(found):
        why = "one antenna tells no azimuth" if len(found) else "no detections"
        axes.text(0.5, 0.5, why, transform=axes.transAxes, ha="center", color="#555555")
        return
    strongest = found.where(np.argsort(-found.snr_db, kind="stable")[:MOST_CURVES])
    fine = RadarChain(chain.params, replace(chain.settings, azimuth_size=FINE_AZIMUTH))
    sine, power = fine.azimuth_spectra(spectra, strongest)
    order = np.argsort(sine, kind="stable")
    seen = order[np.abs(sine[order]) <= 1.0]
    for k, row in enumerate(power):
        curve = axes.plot(
            np.degrees(np.arcsin(sine[seen])), _db(row[seen] / row.max()), linewidth=1.2,
            label=f"{strongest.range_m[k]:.2f} m, {strongest.radial_speed_m_s[k]:+.2f} m/s, "
            f"{strongest.snr_db[k]:.0f} dB",
        )[0]  # fmt: skip
        axes.axvline(math.degrees(strongest.azimuth_rad[k]), color=curve.get_color(), linestyle=":", linewidth=1.0)
    axes.set_ylim(-30.0, 1.0)
    figure.legend(loc="outside lower center", fontsize=8, ncols=3, frameon=False)
