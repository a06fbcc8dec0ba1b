"""Which files of a mapping program's project are its surface model, its orthophoto and its point cloud: by their names.

Nothing is opened. A folder of tiles is no project: its files are all surface models. What is a terrain model (DTM) by
its name is none: trees and buildings are missing in it. The console tells dropped folders by the same names
(``web/src/store/project_names.json``).
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
PROGRAMS = (("OpenDroneMap", _ODM, 1), ("Pix4D", _PIX4D, 2), ("Metashape", _METASHAPE, 2))
"""With how many kinds of files there must be: OpenDroneMap's folders are no chance."""
SURFACE = re.compile(r"(^|[^a-z])(dsm|dom)([^a-z]|$)")
TERRAIN = re.compile(r"(^|[^a-z])(dtm|dgm|bare[_ -]?earth)([^a-z]|$)")
GROUND = re.compile(r"(^|[^a-z])(ground)[.]tiff?$")
"""As ``hedgehop cloud`` calls the model of the ground."""
_ELEVATION = re.compile(r"(^|[^a-z])(dem)[.]tiff?$")
TILES = "tiles"
"""Pix4D's folder of parts of what lies beside it in one piece."""
_LONGEST_SAID = 120


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


def is_terrain(name: str) -> bool:
    """Whether a raster is a terrain model by its name, or by the nearest of its folders that says which it is."""
    path = PurePosixPath(name.lower())
    if GROUND.search(path.name):
        return True
    for part in reversed(path.parts):
        if SURFACE.search(part):
            return False
        if TERRAIN.search(part):
            return True
    return False


def doubts_of_name(name: str) -> tuple[str, ...]:
    """What is to be said of a surface model that is called so."""
    last = PurePosixPath(name).name
    if is_terrain(name):
        return (
            f"{last} is a terrain model (DTM) by its name: trees and buildings are missing in it, and a plan would fly "
            "into them. Use the surface model (DSM).",
        )
    if _ELEVATION.search(last.lower()):
        return (f"{last}: make sure that it was built of all points (DSM), not of the ground alone.",)
    return ()


def check_surfaces(rasters: Iterable[str], *, where: str) -> None:
    """Of what is no project. Raises RasterFormatError where any is a terrain model by its name."""
    named = list(rasters)
    terrain = [name for name in named if is_terrain(name)]
    if not terrain:
        return
    only = "only a terrain model" if len(terrain) == len(named) else "a terrain model among its rasters"
    raise RasterFormatError(
        f"It has {only} (DTM), {shortened(terrain[0])}: trees and buildings are missing in it.",
        where=where,
        advice="Export the surface model (DSM), and give that alone.",
    )


def shortened(name: str) -> str:
    """A name from an archive for a message: its end, and nothing that does not print."""
    plain = "".join(letter if letter.isprintable() else "?" for letter in name[-_LONGEST_SAID:])
    return plain if len(name) <= _LONGEST_SAID else f"...{plain}"


def project_of(names: Iterable[str], *, where: str) -> Project | None:
    """Of the paths in an archive or a folder, with "/" between; None where they are no project.

    Raises RasterFormatError where it cannot be told which surface model is meant.
    """
    found = [name for name in names if not _is_hidden(PurePosixPath(name))]
    for program, patterns, least in PROGRAMS:
        kinds = {kind: _matching(found, pattern) for kind, pattern in patterns.items()}
        kinds["model"] = [name for name in kinds["model"] if not is_terrain(name)]
        if sum(bool(there) for there in kinds.values()) < least or not (kinds["model"] or kinds["cloud"]):
            continue
        if program == "Metashape" and _unexplained(found, kinds):
            continue
        return _project(program, kinds, where)
    return None


def _project(program: str, kinds: dict[str, list[str]], where: str) -> Project:
    models = kinds["model"]
    if len(models) > 1:
        rest = " ..." if len(models) > 2 else ""
        raise RasterFormatError(
            f"It holds {len(models)} surface models: {shortened(models[0])}, {shortened(models[1])}{rest}.",
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
    return any(name not in known and not is_terrain(name) for name in rasters)


def _is_hidden(path: PurePosixPath) -> bool:
    return any(part.startswith(".") or part in ("__MACOSX", TILES) for part in path.parts)
