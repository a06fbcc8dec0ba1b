"""Which files of a mapping program's project are its surface model, its orthophoto and its point cloud: by their names.

Nothing is opened. A folder of tiles is no project: its files are all surface models.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath

from planning.errors import RasterFormatError

_ODM = {
    "model": re.compile(r"odm_dem/dsm\.tif$"),
    "orthophoto": re.compile(r"odm_orthophoto/odm_orthophoto\.tif$"),
    "cloud": re.compile(r"odm_georeferencing/odm_georeferenced_model\.la[sz]$"),
}
_PIX4D = {
    "model": re.compile(r"_dsm\.tiff?$"),
    "orthophoto": re.compile(r"_mosaic[^/]*\.tiff?$"),
    "cloud": re.compile(r"_densified_point_cloud[^/]*\.la[sz]$"),
    "offset": re.compile(r"_offset\.xyz$"),
}
_METASHAPE = {
    "model": re.compile(r"(^|[/_. -])(dem|dsm)\.tiff?$"),
    "orthophoto": re.compile(r"(^|[/_. -])(ortho|orthomosaic|orthophoto)\.tiff?$"),
    "cloud": re.compile(r"(^|[/_. -])((dense|point)[_ -]?)?cloud\.(la[sz]|ply|e57)$"),
}
_PROGRAMS = (("OpenDroneMap", _ODM, 1), ("Pix4D", _PIX4D, 2), ("Metashape", _METASHAPE, 2))
"""With how many kinds of files there must be: OpenDroneMap's folders are no chance."""
_TERRAIN = re.compile(r"(^|[/_. -])dtm\.tiff?$")
_TILES = "tiles"
"""Pix4D's folder of parts of what lies beside it in one piece."""


@dataclass(frozen=True, slots=True)
class Project:
    """Names as they were given; each None where there is none."""

    program: str
    model: str | None
    orthophoto: str | None
    cloud: str | None
    offset: str | None
    """Pix4D's: what is to be added to coordinates that it keeps near zero."""
    more: tuple[str, ...] = ()
    """Further clouds and orthophotos, which are left out."""


def project_of(names: Iterable[str], *, where: str) -> Project | None:
    """Of the paths in an archive or a folder, with "/" between; None where they are no project.

    Raises RasterFormatError where it cannot be told which surface model is meant.
    """
    found = [name for name in names if not _is_hidden(PurePosixPath(name))]
    for program, patterns, least in _PROGRAMS:
        kinds = {kind: _matching(found, pattern) for kind, pattern in patterns.items()}
        if sum(bool(there) for there in kinds.values()) < least or not (kinds["model"] or kinds["cloud"]):
            continue
        if program == "Metashape" and _unexplained(found, kinds):
            continue
        return _project(program, kinds, where)
    return None


def _project(program: str, kinds: dict[str, list[str]], where: str) -> Project:
    models = kinds["model"]
    if len(models) > 1:
        raise RasterFormatError(
            f"It holds {len(models)} surface models: {models[0]}, {models[1]}{' ...' if len(models) > 2 else ''}.",
            where=where,
            advice="Give one project at a time, or the surface model alone.",
        )
    model, photo, cloud, offset = (
        next(iter(kinds.get(kind, [])), None) for kind in ("model", "orthophoto", "cloud", "offset")
    )
    more = [*kinds["orthophoto"][1:], *kinds["cloud"][1:]]
    return Project(program, model, photo, cloud, offset, tuple(more))


def _matching(names: list[str], pattern: re.Pattern[str]) -> list[str]:
    """In order; of Pix4D's mosaics the one that says where it has no picture comes first."""
    matching = [name for name in names if pattern.search(name.lower())]
    return sorted(matching, key=lambda name: ("transparent" not in name.lower(), name))


def _unexplained(names: list[str], kinds: dict[str, list[str]]) -> bool:
    """Whether there are rasters beside these: common words alone make no project of a folder of tiles."""
    known = {name for there in kinds.values() for name in there}
    rasters = [name for name in names if name.lower().endswith((".tif", ".tiff"))]
    return any(name not in known and not _TERRAIN.search(name.lower()) for name in rasters)


def _is_hidden(path: PurePosixPath) -> bool:
    return any(part.startswith(".") or part in ("__MACOSX", _TILES) for part in path.parts)
