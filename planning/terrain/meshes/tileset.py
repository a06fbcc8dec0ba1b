"""3D Tiles: which tiles of a tree are shown, as fine as a number of triangles allows. OGC 3D Tiles 1.1, clause 7."""

from __future__ import annotations

import heapq
import itertools
import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from planning.errors import RasterFormatError, RasterTooLargeError
from planning.terrain.meshes.gltf import Gltf, broken, matrix_of_tile
from planning.terrain.meshes.package import Package

Json = dict[str, Any]
MOST_TILES, MOST_SHOWN = 20_000, 1_000
_DEEPEST = 60
_SMALLER = "Export the mesh with fewer faces, or with more levels of detail."


@dataclass(frozen=True, slots=True)
class Tile:
    matrix: F64
    """(4, 4) the tile's metres -> those of the whole tileset: Earth-centred ones, mostly"""
    error_m: float
    adds: bool
    """Its children are drawn beside it; else in its place."""
    names: tuple[str, ...]
    children: list[Tile] = field(default_factory=list)


class Tileset:
    """Raises RasterFormatError, RasterTooLargeError."""

    def __init__(self, package: Package) -> None:
        self._package, self._tiles = package, 0
        self._counts: dict[str, int] = {}
        self.root = self._document(package.entry, np.eye(4), adds=False, trail=())
        self.is_coarser = False
        """Whether finer tiles were left out."""

    def chosen(self, most: int) -> list[tuple[F64, str]]:
        """Matrix and file of each, of at most so many triangles: those with the largest error are refined first."""
        first = _with_content(self.root)
        total = sum(map(self._triangles, first))
        if not first:
            raise RasterFormatError("None of its tiles has a mesh.", advice="Export it again.")
        if total > most:
            what = f"Its coarsest tiles have {total:,} triangles; {most:,} are the most."
            raise RasterTooLargeError(what, advice=_SMALLER)
        order = itertools.count()
        heap = [(-tile.error_m, next(order), tile) for tile in first]
        heapq.heapify(heap)
        kept: list[Tile] = []
        while heap:
            _, _, tile = heapq.heappop(heap)
            finer = [found for child in tile.children for found in _with_content(child)]
            more = sum(map(self._triangles, finer)) - (0 if tile.adds else self._triangles(tile))
            fits = total + more <= most and len(kept) + len(heap) + len(finer) <= MOST_SHOWN
            self.is_coarser |= bool(finer) and not fits
            if tile.adds or not finer or not fits:
                kept.append(tile)
            if finer and fits:
                total += more
                for found in finer:
                    heapq.heappush(heap, (-found.error_m, next(order), found))
        return [(tile.matrix, name) for tile in kept for name in tile.names]

    def _triangles(self, tile: Tile) -> int:
        for name in tile.names:
            if name not in self._counts:
                self._counts[name] = Gltf(self._package, name).triangles
        return sum(self._counts[name] for name in tile.names)

    def _document(self, name: str, matrix: F64, *, adds: bool, trail: tuple[str, ...]) -> Tile:
        if name in trail:
            raise broken("its tilesets name each other in a circle")
        told = json.loads(self._package.read(name))
        if not isinstance(told, dict) or not isinstance(told.get("root"), dict):
            raise RasterFormatError("This tileset.json has no root tile.", advice="Export it as 3D Tiles again.")
        if str(told.get("asset", {}).get("gltfUpAxis", "Y")).upper() != "Y":
            raise RasterFormatError("Its meshes are not y up (gltfUpAxis).", advice="Export it as 3D Tiles 1.0 or 1.1.")
        for needed in told.get("extensionsRequired", []):
            if needed != "3DTILES_content_gltf":
                what = f"It needs the extension {str(needed)[:60]}, which is not read."
                raise RasterFormatError(what, advice="Export plain 3D Tiles with b3dm or glb tiles.")
        return self._tile(told["root"], matrix, name, adds=adds, trail=(*trail, name), depth=0)

    def _tile(self, told: Json, above: F64, base: str, *, adds: bool, trail: tuple[str, ...], depth: int) -> Tile:
        self._tiles += 1
        if self._tiles > MOST_TILES or depth > _DEEPEST or len(trail) > _DEEPEST:
            raise RasterTooLargeError(f"It has more than {MOST_TILES:,} tiles, or too deep ones.", advice=_SMALLER)
        if "implicitTiling" in told or "3DTILES_implicit_tiling" in told.get("extensions", {}):
            raise RasterFormatError(
                "Its tiles are told by a rule (implicit tiling), which is not read.",
                advice="Export it with explicit tiles.",
            )
        matrix = above @ matrix_of_tile(told["transform"]) if "transform" in told else above
        adds = str(told["refine"]).upper() == "ADD" if "refine" in told else adds
        error_m = float(told.get("geometricError", 0.0))
        parts = [told["content"]] if "content" in told else told.get("contents", [])
        names = [self._package.named(base, part.get("uri", part.get("url"))) for part in parts]
        tile = Tile(
            matrix, error_m if math.isfinite(error_m) else 0.0, adds,
            tuple(name for name in names if not name.lower().endswith(".json")),
        )  # fmt: skip
        for child in told.get("children", []):
            tile.children.append(self._tile(child, matrix, base, adds=adds, trail=trail, depth=depth + 1))
        for name in names:
            if name.lower().endswith(".json"):
                tile.children.append(self._document(name, matrix, adds=adds, trail=trail))
        return tile


def _with_content(tile: Tile) -> list[Tile]:
    """The first tiles from here down that have a mesh."""
    if tile.names:
        return [tile]
    return [found for child in tile.children for found in _with_content(child)]
