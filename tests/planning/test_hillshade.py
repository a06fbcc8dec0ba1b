import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.terrain.dsm import Dsm
from planning.terrain.hillshade import SUN_ELEVATION_DEG, UNKNOWN_RGB, height_colors, hillshade, scale_rgb


def make(heights) -> Dsm:
    transform = Affine(2.0, 0.0, 0.0, 0.0, -2.0, 0.0)
    return Dsm(np.asarray(heights, dtype=np.float32), transform, CRS.from_epsg(32633), None, "")


def test_flat_ground_is_as_bright_as_the_sun_is_high():
    expected = round(255 * np.sin(np.radians(SUN_ELEVATION_DEG)))
    assert (hillshade(make(np.zeros((4, 5)))) == expected).all()


def test_a_slope_is_shaded_as_the_angle_to_the_sun_says():
    rows, cols = np.mgrid[0:6, 0:6]
    east_up, south_up = 0.3, -0.2
    shade = hillshade(make(2.0 * (east_up * cols + south_up * rows)))
    normal = np.array([-east_up, south_up, 1.0]) / np.sqrt(1 + east_up**2 + south_up**2)
    sun = np.array([-0.5, 0.5, np.sqrt(0.5)])
    assert shade[1:-1, 1:-1].tolist() == [[round(255 * float(normal @ sun))] * 4] * 4


def test_unknown_cells_do_not_spread_and_are_grey():
    rows, cols = np.mgrid[0:5, 0:5]
    heights = (rows + cols).astype(float)
    heights[2, 2] = np.nan
    shade, whole = hillshade(make(heights)), hillshade(make(rows + cols))
    known = np.isfinite(heights)
    assert np.abs(shade[known].astype(int) - whole[known]).max() <= 60
    assert tuple(height_colors(make(heights))[2, 2]) == UNKNOWN_RGB


def test_the_colour_scale_rises_evenly_in_lightness():
    rgb = scale_rgb(64) / 255.0
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    lightness = np.cbrt(linear @ [0.2126, 0.7152, 0.0722])
    steps = np.diff(lightness)
    assert (steps > 0).all()
    assert steps.max() < 2.5 * steps.min()


def test_colours_run_from_lowest_to_highest_or_between_given_heights():
    scale = scale_rgb(256)
    colors = height_colors(make([[0.0, 10.0]]))
    assert colors.tolist() == [[scale[0].tolist(), scale[-1].tolist()]]
    wide = height_colors(make([[0.0, 10.0]]), low_m=-10, high_m=10)
    assert wide[0, 0].tolist() == pytest.approx(scale[128].tolist(), abs=2)
    assert height_colors(make([[5.0, 5.0]])).shape == (1, 2, 3)
