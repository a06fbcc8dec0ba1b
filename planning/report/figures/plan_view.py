"""The map of the report: path, points, home and worst point on the hill-shaded surface model."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from html import escape

import numpy as np
from PIL import Image

from mapping.geometry.arrays import F64, U8
from planning.basics.plan_model import FlownLine, Poi
from planning.certificate.certificate_model import Certificate
from planning.report.figures.chart import label, round_step
from planning.report.figures.curves import BAD, PATH, short_name
from planning.report.words import metres
from planning.safe_surface.surface import fit_within
from planning.terrain.dsm import Dsm
from planning.terrain.hillshade import height_colors, hillshade, scale_rgb

MAX_IMAGE_PX = 1000
MAP_PX, LEGEND_PX = 900.0, 80.0
MAX_MAP_HEIGHT_PX = 640.0
_IMAGE_COLORS = 160
_MOST_DOTS = 400


def plan_view(dsm: Dsm, line: FlownLine, certificate: Certificate, pois: Sequence[Poi]) -> str:
    """The map as one ``<svg>`` with the relief as an embedded PNG; north is up."""
    shown = fit_within(_around(dsm, line.points_m[:, :2]), MAX_IMAGE_PX)
    west, south, east, north = shown.bounds_m
    px_per_m = min(MAP_PX / (east - west), MAX_MAP_HEIGHT_PX / (north - south))
    size = np.array([(east - west) * px_per_m, (north - south) * px_per_m])

    def pixels(xy_m: F64) -> F64:
        return (np.asarray(xy_m).reshape(-1, 2) - [west, north]) * [px_per_m, -px_per_m]

    width, height = size
    parts = [
        f'<svg class="map" viewBox="0 0 {width + LEGEND_PX:.0f} {height:.0f}" role="img" aria-label="Map">',
        f'<image href="{_relief(shown)}" width="{width:.1f}" height="{height:.1f}" preserveAspectRatio="none"/>',
        _track(pixels(line.points_m[:, :2])),
        *_pois(pixels(_poi_xy(dsm, pois)), pois),
        _home(*pixels(np.array(line.home_xy_m))[0]),
        _worst(pixels(np.array([certificate.worst.x_m, certificate.worst.y_m]))[0], certificate),
        _north_arrow(width),
        _scale_bar(height, px_per_m, width),
        _height_legend(shown, width, height),
        "</svg>",
    ]
    return "\n".join(parts)


def _around(dsm: Dsm, xy_m: F64) -> Dsm:
    """The part of the model around the line, with a quarter of its size as margin."""
    row_f, col_f = dsm.fractional_cell(xy_m)
    margin = 0.25 * max(np.ptp(row_f), np.ptp(col_f), 40.0)
    row0, col0 = int(row_f.min() - margin), int(col_f.min() - margin)
    r0, c0 = max(0, row0), max(0, col0)
    return dsm.window(r0, c0, int(row_f.max() + margin) - r0 + 1, int(col_f.max() + margin) - c0 + 1)


def _relief(dsm: Dsm) -> str:
    exaggeration = 1.0 if dsm.resolution_m > 0.2 else 0.7
    shade = 0.35 + 0.75 * hillshade(dsm, exaggeration=exaggeration)[..., None] / 255.0
    known = np.isfinite(dsm.elevation_m)
    colors = height_colors(dsm) if known.any() else np.full((*known.shape, 3), 200, np.uint8)
    rgb = np.clip(np.where(known[..., None], _pale(colors) * shade, colors), 0, 255).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(rgb).quantize(_IMAGE_COLORS, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(out.getvalue()).decode()


def _pale(colors: U8) -> F64:
    """Height colours as a background that lines and labels stand out from."""
    return 0.55 * colors.astype(np.float64) + 0.45 * 235


def _poi_xy(dsm: Dsm, pois: Sequence[Poi]) -> F64:
    return dsm.xy_from_lat_lon(np.array([(p.lat_deg, p.lon_deg) for p in pois]).reshape(-1, 2))


def _track(px: F64) -> str:
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in px)
    shape = f'<polyline points="{points}" fill="none" stroke-linejoin="round" stroke-linecap="round"'
    lines = f'{shape} stroke="#fff" stroke-width="6" opacity="0.85"/>{shape} stroke="{PATH}" stroke-width="3"/>'
    if len(px) > _MOST_DOTS:
        return lines
    return lines + "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.3" fill="#fff" stroke="{PATH}" stroke-width="1.2"/>' for x, y in px
    )


def _pois(px: F64, pois: Sequence[Poi]) -> list[str]:
    named = len(pois) <= 60
    return [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="#ffd54f" stroke="#243b53" stroke-width="1.8"/>'
        + (
            f'<text x="{x + 10:.1f}" y="{y - 8:.1f}" class="halo big">{escape(short_name(poi, k))}</text>'
            if named
            else ""
        )
        for k, ((x, y), poi) in enumerate(zip(px, pois, strict=True))
    ]


def _home(x: float, y: float) -> str:
    return (
        f'<g transform="translate({x:.1f} {y:.1f})"><circle r="11" fill="#243b53" stroke="#fff" stroke-width="2"/>'
        '<path d="M-5 5V-1L0 -6L5 -1V5Z" fill="#fff"/></g>'
    )


def _worst(px: F64, certificate: Certificate) -> str:
    if not np.isfinite(px).all():
        return ""
    x, y = px
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="11" fill="none" stroke="#fff" stroke-width="5"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="11" fill="none" stroke="{BAD}" stroke-width="2.6"/>'
        f'<text x="{x + 15:.1f}" y="{y + 20:.1f}" class="halo big" fill="{BAD}">'
        f"worst {metres(certificate.min_distance_m)}</text>"
    )


def _north_arrow(width: float) -> str:
    return (
        f'<g transform="translate({width - 30:.1f} 36)"><circle r="21" fill="#fff" opacity="0.85"/>'
        '<path d="M0 -16L7 6L0 2L-7 6Z" fill="#243b53"/><text y="17" text-anchor="middle" class="big">N</text></g>'
    )


def _scale_bar(height: float, px_per_m: float, width: float) -> str:
    length_m = round_step(width / px_per_m, 7)
    length, y = length_m * px_per_m, height - 20
    text = f"{label(length_m / 1000, length_m / 1000)} km" if length_m >= 1000 else f"{label(length_m, length_m)} m"
    return (
        f'<rect x="10" y="{y - 22:.1f}" width="{length + 24:.1f}" height="34" rx="4" fill="#fff" opacity="0.85"/>'
        f'<path d="M22 {y - 5:.1f}v7h{length:.1f}v-7" fill="none" stroke="#243b53" stroke-width="2"/>'
        f'<text x="{22 + length / 2:.1f}" y="{y - 5:.1f}" text-anchor="middle" class="big">{text}</text>'
    )


def _height_legend(dsm: Dsm, width: float, height: float) -> str:
    known = dsm.elevation_m[np.isfinite(dsm.elevation_m)]
    if not len(known):
        return ""
    low, high, colors = float(known.min()), float(known.max()), _pale(scale_rgb(9)).round().astype(int)
    stops = "".join(f'<stop offset="{k / 8:.3f}" stop-color="rgb({r},{g},{b})"/>' for k, (r, g, b) in enumerate(colors))
    x, top, tall = width + 14, 26.0, min(220.0, height - 60)
    return (
        f'<defs><linearGradient id="heights" x1="0" y1="1" x2="0" y2="0">{stops}</linearGradient></defs>'
        f'<rect x="{x:.1f}" y="{top}" width="14" height="{tall:.1f}" fill="url(#heights)"/>'
        f'<text x="{x:.1f}" y="{top - 10}">DSM (m)</text><text x="{x + 19:.1f}" y="{top + 9}">{high:.1f}</text>'
        f'<text x="{x + 19:.1f}" y="{top + tall:.1f}">{low:.1f}</text>'
    )
