"""Which files a surface model is read from: itself, the tiles of a folder, or those that a virtual raster names.

Of a folder that is a mapping program's project it is the project's surface model alone.

Nothing is read because a file says so: what a virtual raster (VRT) names must lie in its folder or below. Where a
tile lies says the tile.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from planning.errors import RasterFormatError, RasterTooLargeError
from planning.terrain.projects import Project, check_surfaces, doubts_of_name, project_of, shortened
from planning.terrain.rasters.magic import is_virtual
from planning.terrain.rasters.mosaic import Claim
from planning.terrain.rasters.virtual import listed_by

MOST_TILES = 20_000
_ENDINGS = (".tif", ".tiff")
_CLOUDS = (".las", ".laz", ".ply", ".e57")


@dataclass(frozen=True, slots=True)
class Tiles:
    """The files of a mosaic."""

    paths: tuple[Path, ...]
    claims: tuple[Claim, ...] | None = None
    """What a virtual raster says of each; None: these are the files of a folder."""
    crs: str = ""
    """The reference system that a virtual raster says, as text; empty: none."""


def tiles_of(source: Path, *, virtual: bool) -> Tiles | None:
    """The tiles of a folder, and of a virtual raster where such are allowed; None for any other file.

    Raises RasterError for a folder without GeoTIFFs and for a virtual raster that is more than a list of tiles.
    """
    if source.is_dir():
        return Tiles(_in_folder(source))
    if not (virtual and is_virtual(source)):
        return None
    listed = listed_by(source)
    _check_count(len(listed.tiles), source)
    return Tiles(tuple(listed.tiles), tuple(listed.tiles.values()), listed.crs)


def _in_folder(folder: Path) -> tuple[Path, ...]:
    found: list[Path] = []
    beside: list[Path] = []
    for here, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += [Path(here, name) for name in names if _is_tile(name)]
        beside += [Path(here, name) for name in names if name.lower().endswith(_CLOUDS)]
        _check_count(max(len(found), len(beside)), folder)
    project = project_of((path.relative_to(folder).as_posix() for path in (*found, *beside)), where=str(folder))
    if project is not None:
        return (folder / _model_of(project, folder),)
    if not found:
        raise RasterFormatError(
            "There is no GeoTIFF (.tif, .tiff) in this folder.", where=str(folder), advice="Give the folder of tiles."
        )
    check_surfaces((path.relative_to(folder).as_posix() for path in found), where=str(folder))
    return tuple(sorted(found))


def doubts_of_names(source: Path, *, virtual: bool) -> tuple[str, ...]:
    """What the names of a surface model's files leave in doubt, in plain words."""
    tiles = tiles_of(source, virtual=virtual)
    names = (source, *(tiles.paths if tiles is not None and len(tiles.paths) == 1 else ()))
    return tuple(dict.fromkeys(note for name in names for note in doubts_of_name(name.name)))


def _model_of(project: Project, folder: Path) -> str:
    if project.model is None:
        what = f"This {project.program} project has no surface model."
        advice = f"Make one of its point cloud first: hedgehop cloud {shortened(project.cloud or '')} --out dsm.tif"
        raise RasterFormatError(what, where=str(folder), advice=advice)
    return project.model


def _is_tile(name: str) -> bool:
    return name.lower().endswith(_ENDINGS) and not name.startswith(".")


def _check_count(count: int, source: Path) -> None:
    if count > MOST_TILES:
        raise RasterTooLargeError(
            f"It has more than {MOST_TILES:,} tiles.", where=source.name, advice="Merge some, or give a part of them."
        )
