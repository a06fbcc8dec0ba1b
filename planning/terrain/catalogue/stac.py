"""What a STAC document on disk says: which rasters, of when, with which errors, and which documents it names.

Plain JSON is read, no library of STAC. Read by pystac 1.15 a `gsd` of "abc" or NaN and an id that is a number pass, a
link that is a number ends in a TypeError, and `eo:gsd` of before 1.0 stays what it was without one of its two dozen
distributions: all that is here would be looked at again. Before 1.0 fields had other names, so such documents are
refused. What a document names counts only as a path below the catalogue's folder; who reads it is asked elsewhere
(``listed_models``).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal
from urllib.parse import unquote

import msgspec

from planning.errors import RasterError, RasterFormatError
from planning.terrain.projects import SURFACE, is_terrain

MOST_BYTES = 4 * 2**20
MOST_RMS_M = 20.0
"""Vertical; a larger error is no surface model to fly on."""
MOST_HORIZONTAL_M = 100.0
MOST_GSD_M = 100.0
_ROLES_LEFT_OUT = {"thumbnail", "overview", "visual", "metadata"}
_SURFACE_KEYS = ({"dsm"}, {"surface", "elevation", "data"})
"""Of assets: the first, and where none is called so the others."""
_SURFACE = re.compile(f"surface|{SURFACE.pattern}")
_ENDINGS = (".tif", ".tiff")
MOST_ASSETS = 100
MOST_DATUM = 100


class _Properties(msgspec.Struct):
    title: str | None = None
    datetime: str | None = None
    start_datetime: str | None = None
    gsd: float | None = None
    vertical_rms_m: float | None = msgspec.field(name="hedgehop:vertical_rms_m", default=None)
    horizontal_rms_m: float | None = msgspec.field(name="hedgehop:horizontal_rms_m", default=None)
    vertical_datum: str | None = msgspec.field(name="hedgehop:vertical_datum", default=None)


class _Asset(msgspec.Struct):
    href: str
    title: str | None = None
    roles: list[str] | None = None


class _Link(msgspec.Struct):
    rel: str
    href: str


class _Document(msgspec.Struct):
    stac_version: str
    id: str
    type: Literal["Feature", "Catalog", "Collection"] | None = None
    """Catalogues of before 1.0 have none."""
    properties: _Properties | None = None
    assets: dict[str, _Asset] | None = None
    links: list[_Link] | None = None


@dataclass(frozen=True, slots=True)
class Told:
    """What is told of a surface model beside its file; None: nothing."""

    name: str = ""
    taken_utc: datetime | None = None
    gsd_m: float | None = None
    """On the ground, where the raster's cells are finer than what was measured."""
    vertical_rms_m: float | None = None
    horizontal_rms_m: float | None = None
    vertical_datum: str | None = None


@dataclass(frozen=True, slots=True)
class Document:
    """A STAC item, or a catalogue or collection that names some."""

    told: Told
    rasters: tuple[str, ...]
    """Of an item: what its assets name, as it is written there; each may be the surface model."""
    others: tuple[str, ...]
    """Rasters that an item names as something else."""
    named: tuple[str, ...]
    """Items and catalogues that it names, as they are written there."""
    is_item: bool


def read_document(path: Path) -> Document:
    """RasterError for a file that is no STAC document, is too long, or tells what cannot be."""
    where = path.name
    try:
        if path.stat().st_size > MOST_BYTES:
            raise RasterError(f"It is longer than {MOST_BYTES // 2**20} MiB.", where=where, advice="Split it.")
        found = msgspec.json.decode(path.read_bytes(), type=_Document)
    except OSError as error:
        raise RasterError(f"It cannot be read: {error.strerror}.", where=where) from error
    except (msgspec.MsgspecError, RecursionError, UnicodeError) as error:
        raise RasterFormatError(
            f"It is no STAC document ({error}).", where=where, advice="Write it again, or leave it out."
        ) from error
    if not found.stac_version.startswith("1."):
        raise RasterFormatError(
            f"It is STAC {_short(found.stac_version)}, which names what it tells in another way.",
            where=where,
            advice="Write it as STAC 1.0 or 1.1.",
        )
    if found.type is None:
        raise RasterFormatError(
            "It is no STAC document (it has no type).", where=where, advice="Write it again, or leave it out."
        )
    if len(found.assets or {}) > MOST_ASSETS:
        raise RasterError(f"It has more than {MOST_ASSETS} assets.", where=where, advice="Split it.")
    is_item = found.type == "Feature"
    named = [link.href for link in found.links or () if link.rel in ("item", "child") and not is_item]
    title = (found.properties and found.properties.title) or ""
    rasters, others = _rasters(found.assets or {}, title) if is_item else ((), ())
    return Document(_told(found, where), rasters, others, tuple(named), is_item)


def path_below(root: Path, document: Path, href: str) -> Path:
    """The file that a document names. RasterError for what is no file of the catalogue's folder ``root``."""
    name = unquote(href)
    if "://" in href or "\0" in name or href.lower().startswith(("/vsi", "file:")):
        raise RasterError(
            f"{_short(href)} is no file of the catalogue's folder: nothing is read because a document says so.",
            where=document.name,
            advice="Put it into the folder, and name it from there.",
        )
    return file_below(root, document.parent / name, document.name, _short(href))


def file_below(root: Path, file: Path, where: str, name: str) -> Path:
    """The file itself, links followed. RasterError for one that lies outside of ``root``, or is none."""
    try:
        path = file.resolve()
        inside = path.is_relative_to(root.resolve()) and path.is_file()
    except (OSError, RuntimeError, ValueError):
        path, inside = file, False
    if not inside:
        raise RasterError(
            f"{name} is no file in the catalogue's folder.",
            where=where,
            advice="Put it there, or correct the name.",
        )
    return path


def _rasters(assets: dict[str, _Asset], title: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The one that says by its key that it is the surface model, else all that may be; and all other rasters."""
    rasters = {key: asset for key, asset in assets.items() if asset.href.lower().endswith(_ENDINGS)}
    may_be = [key for key, asset in rasters.items() if not _is_another(key, asset, title)]
    said = [[key for key in may_be if key.lower() in keys] for keys in _SURFACE_KEYS]
    chosen = next((keys for keys in said if len(keys) == 1), may_be)
    others = (asset.href for key, asset in rasters.items() if key not in chosen)
    return tuple(rasters[key].href for key in chosen), tuple(others)


def _is_another(key: str, asset: _Asset, title: str) -> bool:
    """Whether an asset is no surface model by its words: a picture, or terrain without trees and buildings.

    Its item's title counts where its own words do not say that it is one.
    """
    own = (key, asset.title or "")
    if _ROLES_LEFT_OUT & set(asset.roles or ()) or any(_says_terrain(text) for text in own):
        return True
    return _says_terrain(title) and not any(_SURFACE.search(text.lower()) for text in own)


def _says_terrain(text: str) -> bool:
    return is_terrain(text) or ("terrain" in text.lower() and not _SURFACE.search(text.lower()))


def _told(found: _Document, where: str) -> Told:
    said = found.properties or _Properties()
    return Told(
        name=_short("".join(letter for letter in found.id if letter.isprintable())),
        taken_utc=_time(said.datetime or said.start_datetime, where),
        gsd_m=_positive(said.gsd, "gsd", MOST_GSD_M, where),
        vertical_rms_m=_positive(said.vertical_rms_m, "hedgehop:vertical_rms_m", MOST_RMS_M, where),
        horizontal_rms_m=_positive(said.horizontal_rms_m, "hedgehop:horizontal_rms_m", MOST_HORIZONTAL_M, where),
        vertical_datum=_datum(said.vertical_datum, where),
    )


def _time(text: str | None, where: str) -> datetime | None:
    """Without a zone it is taken as UTC."""
    if text is None:
        return None
    try:
        time = datetime.fromisoformat(text)
        return (time if time.tzinfo else time.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise RasterFormatError(
            f"Its date {_short(text)!r} is none.", where=where, advice="Write it as 2026-05-01T10:00:00Z."
        ) from error


def _datum(text: str | None, where: str) -> str | None:
    if not text or not text.strip():
        return None
    if len(text) > MOST_DATUM or not text.isprintable():
        raise RasterFormatError(
            f"Its hedgehop:vertical_datum {_short(text)!r} is none.", where=where, advice='Name one: "EGM2008 height".'
        )
    return text.strip()


def _positive(value: float | None, name: str, most: float, where: str) -> float | None:
    if value is None or (math.isfinite(value) and 0.0 < value <= most):
        return value
    raise RasterFormatError(
        f"Its {name} is {value:g}.", where=where, advice=f"Give metres above 0 and at most {most:g}."
    )


def _short(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:80]}..."
