"""The surface model: elevations on a north-up grid of square cells in metres."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from affine import Affine
from pyproj import CRS, Proj, Transformer

from mapping.geometry.arrays import F32, F64, Bools
from planning.errors import ParameterError
from planning.terrain.cells.cells import Cells, square_cells
from planning.terrain.cells.squares import squares

LARGE_PX = 4_000_000
"""A model with more cells is read and looked at in part; a smaller one whole."""
SCALE_TOLERANCE = 0.01
"""Largest deviation of the CRS's metre from the true one; national grids and UTM stay below 0.002."""


FLIGHT_MARGIN_M = 300.0
"""Around a flight: nothing that is farther from it than this decides anything about it."""


class SurfaceModel(ABC):
    """Where a surface model lies, and how to look at a part of it: in memory (``Dsm``) or still in its file."""

    __slots__ = ()

    transform: Affine
    crs: CRS
    vertical_datum: str | None
    sha256: str
    name: str
    rms_m: float | None
    """RMS error of its heights where it tells one itself: a clearance allows for no less. None: it tells none."""
    place_m: float
    """How far from where it shows them things may stand, beside their cells; 0: it tells nothing of it."""

    @property
    def most_place_m(self) -> float:
        """The largest of it anywhere, where ``place_m`` is that around some places alone."""
        return self.place_m

    @property
    def said_of_look(self) -> dict[str, object]:
        """What a certificate writes down about the models around the flight, where it is of several."""
        return {}

    @property
    @abstractmethod
    def height_px(self) -> int: ...

    @property
    @abstractmethod
    def width_px(self) -> int: ...

    @abstractmethod
    def window(self, row0: int, col0: int, height_px: int, width_px: int) -> Dsm:
        """The part of the model that starts at (row0, col0), clipped to it; ParameterError where none is left."""

    @abstractmethod
    def whole(self) -> Dsm:
        """All of it."""

    @abstractmethod
    def elevation_at(self, xy_m: F64) -> F64:
        """Elevation of the (source) cell that holds each projected point (N, 2); NaN outside or unknown."""

    def around(self, xy_m: F64, margin_m: float) -> Dsm:
        """The part within ``margin_m`` of the bounding box of projected (N, 2) points; the nearest cell at least."""
        return self.window(*self.box_around(xy_m, margin_m))

    def over(self, xy_m: F64, margin_m: float = FLIGHT_MARGIN_M) -> SurfaceModel:
        """The model as a flight among projected (N, 2) places meets it, within ``margin_m`` of their bounding box.

        One model is the same everywhere. Of several, their grid and how far things may stand beside their place are
        those of the models around: all that plans, judges and flies begins with this, so that it means the same.
        """
        return self

    def box_around(self, xy_m: F64, margin_m: float) -> tuple[int, int, int, int]:
        """First row, first column, rows and columns of that part."""
        rows, columns = self.fractional_cell(np.array([xy_m.min(axis=0) - margin_m, xy_m.max(axis=0) + margin_m]))
        (row0, row1), (column0, column1) = _inside(rows, self.height_px), _inside(columns, self.width_px)
        return row0, column0, row1 - row0, column1 - column0

    @property
    def resolution_m(self) -> float:
        return float(self.transform.a)

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """(west, south, east, north) of the outer cell edges, projected metres."""
        west, north = self.transform.c, self.transform.f
        return (
            west,
            north - self.height_px * self.resolution_m,
            west + self.width_px * self.resolution_m,
            north,
        )

    def fractional_cell(self, xy_m: F64) -> tuple[F64, F64]:
        """Projected (N, 2) metres -> (rows, columns) float; k + 0.5 is the centre of cell k."""
        xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
        return (self.transform.f - xy[:, 1]) / self.resolution_m, (xy[:, 0] - self.transform.c) / self.resolution_m

    def lat_lon_from_xy(self, xy_m: F64) -> F64:
        """Projected (N, 2) metres -> WGS84 (N, 2) latitude, longitude in degrees."""
        xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
        lon, lat = _transformer(self.crs.to_wkt(), inverse=True).transform(xy[:, 0], xy[:, 1])
        return np.column_stack([lat, lon])

    def xy_from_lat_lon(self, lat_lon_deg: F64) -> F64:
        """WGS84 (N, 2) latitude, longitude in degrees -> projected (N, 2) metres; inf where undefined."""
        ll = np.asarray(lat_lon_deg, dtype=np.float64).reshape(-1, 2)
        x, y = _transformer(self.crs.to_wkt(), inverse=False).transform(ll[:, 1], ll[:, 0])
        return np.column_stack([x, y])


@dataclass(frozen=True, slots=True)
class Dsm(SurfaceModel):
    """A digital surface model (DSM).

    Heights are in the model's own vertical datum (``alt_dsm_m`` throughout the code); only
    ``vertical_datum`` tells whether that is above mean sea level.
    """

    elevation_m: F32
    """(H, W) float32, row 0 northernmost; NaN where unknown; read-only."""
    transform: Affine
    """Pixel corner (column, row) -> projected (x east, y north) in metres; square cells, north up."""
    crs: CRS
    """Projected coordinate reference system in metres."""
    vertical_datum: str | None
    """Name of the vertical datum, e.g. "EGM96 height", "ellipsoid"; None when nobody declared it."""
    sha256: str
    """Hex digest of the file the model was read from."""
    source: Cells | None = None
    """The file's own cells where they are no squares of the grid; the grid is then nowhere lower than they are."""
    name: str = ""
    """Of its file; empty when nobody gave it one."""
    lowest_m: F32 | None = None
    """(H, W) how low a vehicle may stand on each cell; None: on its elevation."""
    seam: Bools | None = None
    """(H, W) where the surface between both is not known, for several models meet; None: nowhere."""
    rms_m: float | None = None
    place_m: float = 0.0

    def __post_init__(self) -> None:
        t = self.transform
        if self.elevation_m.ndim != 2 or self.elevation_m.dtype != np.float32:
            raise ParameterError(
                f"A surface model is a 2-D float32 grid, got {self.elevation_m.dtype} {self.elevation_m.shape}."
            )
        if not (t.a > 0 and np.isclose(t.a, -t.e, rtol=1e-6) and t.b == 0 and t.d == 0):
            raise ParameterError(f"A surface model's cells must be square and north up, got {tuple(t)[:6]}.")
        self.elevation_m.flags.writeable = False
        if (self.lowest_m is None) != (self.seam is None):
            raise ParameterError("Of a surface model of several the lowest heights and the seams are given together.")
        for name, beside, dtype in (("Lowest heights", self.lowest_m, np.float32), ("Seams", self.seam, np.bool_)):
            if beside is None:
                continue
            if beside.shape != self.elevation_m.shape or self.source is not None:
                raise ParameterError(f"{name} are {beside.shape}, the grid's own cells {self.elevation_m.shape}.")
            if beside.dtype != dtype:
                raise ParameterError(f"{name} are {np.dtype(dtype)}, got {beside.dtype}.")
        if self.rms_m is not None and not (math.isfinite(self.rms_m) and self.rms_m > 0.0):
            raise ParameterError(f"A surface model's RMS error is metres above 0, got {self.rms_m:g}.")
        if not (math.isfinite(self.place_m) and self.place_m >= 0.0):
            raise ParameterError(f"A surface model's horizontal error is metres of 0 or more, got {self.place_m:g}.")

    @property
    def height_px(self) -> int:
        return self.elevation_m.shape[0]

    @property
    def width_px(self) -> int:
        return self.elevation_m.shape[1]

    @property
    def cells(self) -> Cells:
        """The cells that the heights were measured in, as they lie on the ground: what clearance is proved against."""
        if self.source is not None:
            return self.source
        return square_cells(self.elevation_m, self.resolution_m, (self.transform.c, self.transform.f))

    def elevation_at(self, xy_m: F64) -> F64:
        if self.source is not None:
            return self.source.elevation_at(xy_m)
        row_f, col_f = self.fractional_cell(xy_m)
        out = np.full(row_f.shape, np.nan)
        inside = (row_f >= 0) & (row_f < self.height_px) & (col_f >= 0) & (col_f < self.width_px)
        out[inside] = self.elevation_m[row_f[inside].astype(np.intp), col_f[inside].astype(np.intp)]
        return out

    def with_elevation(self, elevation_m: F32) -> Dsm:
        """The same grid and provenance with other heights (same shape), which are nobody's measured cells."""
        return replace(self, elevation_m=elevation_m, source=None, lowest_m=None, seam=None)

    def as_grid(self) -> Dsm:
        """The grid alone, for what is nowhere to be lower than the surface but need not be exact."""
        if self.source is None and self.lowest_m is None:
            return self
        return replace(self, source=None, lowest_m=None, seam=None)

    def settled(self, apart_m: float) -> Dsm:
        """Unknown where models that meet are farther apart, errors included: a step between them is in none of them."""
        if self.lowest_m is None or self.seam is None:
            return self
        apart = self.seam & (self.elevation_m - self.lowest_m > apart_m)
        return self.with_elevation(np.where(apart, np.float32(np.nan), self.elevation_m))

    def with_cells(self, elevation_m: F32) -> Dsm:
        """The same model with other heights of its ``cells``; the grid follows them.

        A cell that is cut down is cut down at both ends; one that is raised may be as low as before.
        """
        if self.source is None:
            return replace(self, elevation_m=elevation_m, lowest_m=self._lowest_under(elevation_m))
        source = self.source.with_elevation(elevation_m)
        return replace(self, source=source, elevation_m=squares(source, self.transform, self.elevation_m.shape))

    def _lowest_under(self, elevation_m: F32) -> F32 | None:
        if self.lowest_m is None:
            return None
        cut_m = np.fmax(self.elevation_m - elevation_m, np.float32(0.0))
        return np.where(np.isnan(self.elevation_m), elevation_m, self.lowest_m - cut_m)

    def whole(self) -> Dsm:
        return self

    def window(self, row0: int, col0: int, height_px: int, width_px: int) -> Dsm:
        """No copy of the grid."""
        r0, c0 = max(0, row0), max(0, col0)
        r1, c1 = min(self.height_px, row0 + height_px), min(self.width_px, col0 + width_px)
        if r0 >= r1 or c0 >= c1:
            raise ParameterError("The window lies outside the surface model.")
        transform, source = self.transform @ Affine.translation(c0, r0), self.source
        if source is not None:
            low, high = transform @ (0, r1 - r0), transform @ (c1 - c0, 0)
            source = source.around(np.array(low), np.array(high))
        part = slice(r0, r1), slice(c0, c1)
        return replace(
            self,
            elevation_m=self.elevation_m[part],
            transform=transform,
            source=source,
            lowest_m=None if self.lowest_m is None else self.lowest_m[part],
            seam=None if self.seam is None else self.seam[part],
        )


def _inside(places: F64, count: int) -> tuple[int, int]:
    """First and past-the-last of ``count`` cells that an interval touches; the nearest one when it touches none."""
    first, last = (min(max(math.floor(place), 0), count - 1) for place in (places.min(), places.max()))
    return first, last + 1


@lru_cache(maxsize=32)
def _transformer(wkt: str, *, inverse: bool) -> Transformer:
    wgs84, projected = CRS.from_epsg(4326), CRS.from_wkt(wkt)
    pair = (projected, wgs84) if inverse else (wgs84, projected)
    return Transformer.from_crs(*pair, always_xy=True)


def true_cells(dsm: Dsm, xy_m: F64) -> Cells:
    """The model's cells in metres no longer than those on the ground at any of the projected (N, 2) places."""
    return dsm.cells.measured_in(stretch_at(dsm, xy_m))


def stretch_at(dsm: Dsm, xy_m: F64) -> float:
    """Metres of the CRS in a metre on the ground, in the direction and at the place where they are most; 1 at least.

    Where they are fewer than one, distances are longer on the ground than in the CRS, in which they are judged then.
    More than are tolerated at all are not counted: such a model is refused.
    """
    lat_deg, lon_deg = dsm.lat_lon_from_xy(xy_m).T
    longest = float(np.max(Proj(dsm.crs).get_factors(lon_deg, lat_deg).tissot_semimajor))
    return min(max(1.0, longest), 1.0 + SCALE_TOLERANCE) if math.isfinite(longest) else 1.0
