"""A textured mesh on a surface model: in the model's places and heights, or why it cannot be laid there.

A mesh is a picture. Where its heights are another datum's it is put on the model by the difference that is measured
between both, and that is said; nothing is judged by it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

import numpy as np
from pyproj import CRS, Transformer

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.frames import geodetic_from_ecef
from planning.errors import RasterFormatError
from planning.terrain.clouds.compare import ABOVE_M, Compared, compared
from planning.terrain.dsm import Dsm
from planning.terrain.meshes.gltf import Z_UP_FROM_Y_UP
from planning.terrain.meshes.mesh_file import Mesh, MeshPart
from planning.terrain.vertical_datum import is_same_ellipsoid

_EARTH_M = (6.30e6, 6.40e6)
"""Between which distances from the Earth's centre all of its surface lies."""
_LEAST_SHARE = 0.6
_CELL_M = 1.0
_MOST_GEOID_M = 110.0
"""Geoids lie between 107 m below and 86 m above the ellipsoid."""
_MARGIN_M = 50.0
_WGS84 = "ellipsoid WGS 84"
_UTM = re.compile(r"WGS84 UTM (\d{1,2})([NS])$")


@dataclass(frozen=True, slots=True)
class PlacedMesh:
    """A mesh whose ``xyz_m`` are x, y, alt_dsm of its surface model."""

    mesh: Mesh
    shift_m: float
    """By how much its heights were moved onto the model's; 0: they are its own."""
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Way:
    xyz_m: F64
    is_ellipsoid: bool = False
    note: str | None = None


def placed_on(dsm: Dsm, mesh: Mesh, *, name: str) -> PlacedMesh:
    """Raises RasterFormatError with what to do where it lies elsewhere, or nothing tells where."""
    ways = _ways(dsm, mesh, name)
    judged = [(_share_over(dsm, _tops(way.xyz_m, dsm)), way) for way in ways]
    there = [way for share, way in judged if share >= _LEAST_SHARE]
    if not there:
        raise _elsewhere(name, mesh, dsm, max(share for share, _ in judged))
    found = [(_heights(dsm, way), way) for way in there]
    heights, way = min(found, key=lambda each: each[0].off_m if not each[1].is_ellipsoid else 0.0)
    shift_m, notes = 0.0, [] if way.note is None else [way.note]
    if way.is_ellipsoid and not is_same_ellipsoid(_WGS84, dsm.vertical_datum or ""):
        shift_m = -heights.median_m
        heights = _heights(dsm, replace(way, xyz_m=_raised(way.xyz_m, shift_m)))
        datum = dsm.vertical_datum or "a datum that nobody told"
        notes.append(
            f"{name} has heights above the ellipsoid, the surface model in {datum}: the mesh was moved by "
            f"{shift_m:+.1f} m, the difference that is measured between both."
        )
    if abs(shift_m) > _MOST_GEOID_M or heights.off_m > ABOVE_M:
        off_m = abs(shift_m) if abs(shift_m) > _MOST_GEOID_M else heights.off_m
        raise RasterFormatError(
            f"{name} does not lie on the surface model: half of it is {off_m:.1f} m or more above or below.",
            where=name,
            advice="Export mesh and surface model (DSM) of one project, in one reference system and vertical datum.",
        )
    kept, left = _near(replace(mesh, xyz_m=_raised(way.xyz_m, shift_m)), dsm)
    if left:
        notes.append(f"{left:,} triangles of {name} farther than {_MARGIN_M:g} m beside the model are left out.")
    return PlacedMesh(kept, shift_m, (*mesh.notes, *notes))


def _ways(dsm: Dsm, mesh: Mesh, name: str) -> list[_Way]:
    """All that the file may mean by its numbers."""
    far_m = np.linalg.norm(mesh.xyz_m, axis=1)
    if ((far_m > _EARTH_M[0]) & (far_m < _EARTH_M[1])).all():
        places = geodetic_from_ecef(mesh.xyz_m)
        return [_Way(np.column_stack([dsm.xy_from_lat_lon(places[:, :2]), places[:, 2]]), is_ellipsoid=True)]
    turned = (mesh.xyz_m - mesh.center_m) @ Z_UP_FROM_Y_UP + mesh.center_m
    note = f"{name} is z up, which glTF does not allow: it was drawn so, for it fits the surface model so."
    local = [(mesh.xyz_m, None), (turned, note)]
    ways = [_Way(xyz_m, note=said) for xyz_m, said in local]
    if mesh.offset is not None:
        offset_m, crs = offset_of(mesh.offset, name)
        ways = [_Way(_brought(xyz_m + offset_m, crs, dsm.crs), note=said) for xyz_m, said in local] + ways
    return ways


def offset_of(text: str, name: str) -> tuple[F64, CRS | None]:
    """(3,) east, north, height of a mesh's zero, and the system that they are in where it is told.

    OpenDroneMap's coords.txt (its first line names a zone of UTM, the second one east and north), or Pix4D's three
    numbers. Raises RasterFormatError.
    """
    lines = text.strip().splitlines()
    zone = _UTM.match(lines[0].strip()) if lines else None
    words = (lines[1] if zone and len(lines) > 1 else lines[0] if lines else "").replace(",", " ").split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) not in ((2,) if zone else (2, 3)) or not all(map(math.isfinite, numbers)):
        raise RasterFormatError(
            "The file with the mesh's offset has no two or three numbers.", where=name, advice="Export it again."
        )
    if zone is None:
        return np.array([*numbers, 0.0][:3]), None
    if not 1 <= int(zone[1]) <= 60:
        raise RasterFormatError(f"There is no zone {zone[1]} of UTM.", where=name, advice="Export it again.")
    crs = CRS.from_epsg((32600 if zone[2] == "N" else 32700) + int(zone[1]))
    return np.array([*numbers, 0.0]), crs


def _brought(xyz_m: F64, source: CRS | None, target: CRS) -> F64:
    if source is None:
        return xyz_m
    way = Transformer.from_crs(source, target, always_xy=True)
    return np.column_stack([*way.transform(xyz_m[:, 0], xyz_m[:, 1]), xyz_m[:, 2]])


def _raised(xyz_m: F64, by_m: float) -> F64:
    return xyz_m + np.array([0.0, 0.0, by_m])


def _tops(xyz_m: F64, dsm: Dsm) -> F64:
    """(N, 3) the highest vertex of each square, in its place."""
    edge_m = max(_CELL_M, dsm.resolution_m)
    finite = xyz_m[np.isfinite(xyz_m).all(axis=1)]
    if not len(finite):
        return finite
    cells = np.floor(finite[:, :2] / edge_m)
    order = np.lexsort((-finite[:, 2], cells[:, 1], cells[:, 0]))
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = (cells[order][1:] != cells[order][:-1]).any(axis=1)
    return finite[order[begins]]


def _share_over(dsm: Dsm, tops_m: F64) -> float:
    return float(np.isfinite(dsm.elevation_at(tops_m[:, :2])).mean()) if len(tops_m) else 0.0


def _heights(dsm: Dsm, way: _Way) -> Compared:
    found = compared(_tops(way.xyz_m, dsm), max(_CELL_M, dsm.resolution_m), dsm)
    assert found is not None  # a share of it lies over known cells
    return found


def _elsewhere(name: str, mesh: Mesh, dsm: Dsm, share: float) -> RasterFormatError:
    where = f"{share:.0%} of it lies over the surface model that is open"
    if mesh.offset is None and float(np.abs(mesh.xyz_m).max()) < _EARTH_M[0]:
        what = f"Nothing tells where {name} lies: its zero is its own project's ({where})."
        return RasterFormatError(what, where=name, advice=_to_put_beside(name, dsm))
    advice = "Open the surface model (DSM) of the same area first."
    return RasterFormatError(f"{name} lies elsewhere ({where}).", where=name, advice=advice)


def _to_put_beside(name: str, dsm: Dsm) -> str:
    """Word for word, so that it can be written by hand: the zone of UTM is the surface model's."""
    west_m, south_m, east_m, north_m = dsm.bounds_m
    middle = np.array([[(west_m + east_m) / 2, (south_m + north_m) / 2]])
    lat_deg, lon_deg = dsm.lat_lon_from_xy(middle)[0].tolist()
    zone = f"{int((lon_deg + 180) // 6) % 60 + 1}{'N' if lat_deg >= 0 else 'S'}"
    stem = PurePosixPath(name).stem
    return (
        f"Put it into one ZIP with a text file coords.txt of two lines: 'WGS84 UTM {zone}', then east and north of the "
        "mesh's zero in metres, such as '500000 4170000' (OpenDroneMap writes it into odm_georeferencing); or with "
        f"{stem}_offset.xyz, one line of east, north and height in the surface model's reference system (Pix4D writes "
        "it). Or export 3D Tiles: tileset.json with all tiles in one ZIP."
    )


def _near(mesh: Mesh, dsm: Dsm) -> tuple[Mesh, int]:
    """Without triangles far off, which would be drawn nowhere near, and how many they were."""
    west, south, east, north = dsm.bounds_m
    least, most = np.array([west, south]) - _MARGIN_M, np.array([east, north]) + _MARGIN_M
    is_near: Bools = np.all((mesh.xyz_m[:, :2] >= least) & (mesh.xyz_m[:, :2] <= most), axis=1)
    if is_near.all():
        return mesh, 0
    xyz_m = np.where(np.isfinite(mesh.xyz_m), mesh.xyz_m, 0.0)
    faces, parts, vertex, face = [], [], 0, 0
    for part in mesh.parts:
        inside = mesh.faces[face : face + part.faces]
        kept = inside[is_near[vertex : vertex + part.vertices][inside].all(axis=1)]
        faces.append(kept)
        parts.append(MeshPart(part.vertices, len(kept), part.picture))
        vertex, face = vertex + part.vertices, face + part.faces
    left = len(mesh.faces) - sum(map(len, faces))
    middle = np.array([(west + east) / 2, (south + north) / 2])
    xyz_m[:, :2] = np.where(is_near[:, None], xyz_m[:, :2], middle)
    return replace(mesh, xyz_m=xyz_m, faces=np.concatenate(faces), parts=tuple(parts)), left
