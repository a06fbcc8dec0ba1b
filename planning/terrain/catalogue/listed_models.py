"""Which surface models a catalogue lists: the rasters of a folder, or those that a STAC document names."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.catalogue.stac import Document, Told, file_below, path_below, read_document

MOST_MODELS = 64
MOST_DOCUMENTS = 1000
_RASTERS = (".tif", ".tiff")
_DOCUMENT = ".json"


@dataclass(frozen=True, slots=True)
class Listed:
    """A raster, and what is told of it beside."""

    path: Path
    told: Told
    within: str
    """Its path from the catalogue's folder on, that one's name included: folders may say what it is."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What is listed and not used."""

    name: str
    why: str


@dataclass(frozen=True, slots=True)
class Listing:
    models: tuple[Listed, ...]
    left_out: tuple[LeftOut, ...]


def listing_of(source: Path) -> Listing:
    """Of a folder, with the folders in it, or of a STAC document and all that it names below its own folder.

    RasterError where nothing can be listed at all; single documents and rasters that cannot be used are told.
    """
    if source.is_dir():
        return _in_folder(source)
    if not source.is_file() or source.suffix.lower() != _DOCUMENT:
        raise RasterFormatError(
            "This is no catalogue.", where=str(source), advice="Give a folder of GeoTIFFs, or a STAC document (.json)."
        )
    return _named_by(source)


def _in_folder(folder: Path) -> Listing:
    rasters: list[Path] = []
    documents: list[Path] = []
    for here, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        shown = [Path(here, name) for name in sorted(names) if not name.startswith(".")]
        rasters += [path for path in shown if path.suffix.lower() in _RASTERS]
        documents += [path for path in shown if path.suffix.lower() == _DOCUMENT]
        _check_count(len(rasters), MOST_MODELS, "surface models", folder)
        _check_count(len(documents), MOST_DOCUMENTS, "documents", folder)
    made = _Made(folder)
    for document in documents:
        found = made.read(document)
        if found is not None and found.is_item:
            made.add_item(document, found)
    for raster in rasters:
        made.add_plain(raster)
    return made.listing()


def _named_by(source: Path) -> Listing:
    made, waiting, seen = _Made(source.parent), [source], {source.resolve()}
    first, links = read_document(source), 0
    while waiting:
        document = waiting.pop()
        found = first if document is source else made.read(document)
        if found is None:
            continue
        if found.is_item:
            made.add_item(document, found)
        for href in found.named:
            links += 1
            _check_count(links, MOST_DOCUMENTS, "links", source)
            path = made.below(document, href)
            if path is not None and path.resolve() not in seen:
                seen.add(path.resolve())
                waiting.append(path)
        _check_count(len(seen), MOST_DOCUMENTS, "documents", source)
        _check_count(len(made.models), MOST_MODELS, "surface models", source)
    return made.listing()


class _Made:
    """A listing as it grows."""

    def __init__(self, root: Path) -> None:
        self.root, self.models = root, dict[Path, Listed]()
        self._left_out: list[LeftOut] = []
        self._doubtful: set[Path] = set()
        self._others: set[Path] = set()

    def read(self, document: Path) -> Document | None:
        """None for one that cannot be read, which is told."""
        try:
            file_below(self.root, document, document.name, document.name)
            return read_document(document)
        except RasterError as error:
            self._leave_out(document.name, error)
            return None

    def below(self, document: Path, href: str) -> Path | None:
        try:
            return path_below(self.root, document, href)
        except RasterError as error:
            self._leave_out(document.name, error)
            return None

    def add_item(self, document: Path, item: Document) -> None:
        one = len(item.rasters) == 1
        for href in item.others if one else (*item.others, *item.rasters):
            with suppress(RasterError):  # what is not read anyway may lie elsewhere
                self._others.add(path_below(self.root, document, href))
        if not one:
            many = f"{len(item.rasters)} GeoTIFFs, and none alone" if item.rasters else "no GeoTIFF"
            why = f"The item names {many} as its surface model. Name it as the asset “dsm”."
            self._left_out.append(LeftOut(document.name, why))
            return
        path = self.below(document, item.rasters[0])
        if path is None:
            return
        before = self.models.get(path)
        if before is not None and before.told != item.told:
            self._doubtful.add(path)
            return
        self.models[path] = self._listed(path, item.told)

    def add_plain(self, raster: Path) -> None:
        try:
            path = file_below(self.root, raster, raster.name, raster.name)
        except RasterError as error:
            self._leave_out(raster.name, error)
            return
        if path in self._others and path not in self.models:
            self._left_out.append(LeftOut(raster.name, "An item names it, and not as its one surface model."))
            return
        self.models.setdefault(path, self._listed(path, Told()))

    def listing(self) -> Listing:
        twice = "Two items tell different things of it. Keep the right one."
        in_doubt = self._doubtful | (self._others & self.models.keys())
        doubtful = [LeftOut(path.name, twice) for path in sorted(in_doubt)]
        kept = (listed for path, listed in sorted(self.models.items()) if path not in in_doubt)
        return Listing(tuple(kept), (*self._left_out, *doubtful))

    def _listed(self, path: Path, told: Told) -> Listed:
        root = self.root.resolve()
        return Listed(path, told, (Path(root.name) / path.relative_to(root)).as_posix())

    def _leave_out(self, name: str, error: RasterError) -> None:
        self._left_out.append(LeftOut(name, " ".join(part for part in (error.what, error.advice) if part)))


def _check_count(count: int, most: int, what: str, source: Path) -> None:
    if count > most:
        raise RasterTooLargeError(
            f"It has more than {most:,} {what}.",
            where=source.name,
            advice="Give a part of them; tiles of one survey are merged first: gdalbuildvrt, gdal_translate.",
        )
