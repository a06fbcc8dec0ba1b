"""Arrays as ``.npy`` files that can be memory-mapped: a model of 132 Mpx opens at once.

The source cells of a surface model are such files too: ``cells.npy`` and, where the lattice is bent, ``bend.npy``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from planning.terrain.cells.cells import Cells, Layout
from planning.terrain.cells.lattice import Lattice, straight
from server.errors import StorageError
from server.library.whole_files import write_durably

_CHUNK_BYTES = 16 * 1024**2
_HEIGHTS, _BEND = "cells.npy", "bend.npy"
Pair = tuple[float, float]


def write_array(path: Path, array: NDArray[Any]) -> None:
    """numpy's own writer hides why a write failed ("disk full"), so the bytes are written here."""
    contiguous = np.ascontiguousarray(array)

    def fill(file: BinaryIO) -> None:
        np.lib.format.write_array_header_2_0(file, np.lib.format.header_data_from_array_1_0(contiguous))
        data = contiguous.reshape(-1).view(np.uint8)
        for start in range(0, data.size, _CHUNK_BYTES):
            file.write(data[start : start + _CHUNK_BYTES].data)

    write_durably(path, fill)


def read_array(path: Path, *, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    """Memory-mapped and read-only; raises ``StorageError`` when it is not what the manifest says."""
    try:
        array = np.lib.format.open_memmap(path, mode="r")
    except Exception as error:  # a foreign header may make Python's own parser raise anything
        raise _damaged(path, str(error) or type(error).__name__) from error
    if array.shape != shape or array.dtype != dtype:
        raise _damaged(path, f"it holds {array.dtype} {array.shape}, not {np.dtype(dtype)} {shape}")
    return array


class CellsManifest(BaseModel):
    """Where the cells lie: ``planning.terrain.cells.cells.Layout``."""

    model_config = ConfigDict(frozen=True)

    shape: tuple[int, int]
    origin_xy_m: Pair
    turn: tuple[Pair, Pair]
    width_m: float
    height_m: float
    shear_m: float
    bend_shape: tuple[int, int, int]
    node_px: int
    first_row: int
    first_column: int


def write_cells(folder: Path, cells: Cells) -> CellsManifest:
    layout, lattice = cells.layout, cells.layout.lattice
    write_array(folder / _HEIGHTS, cells.elevation_m)
    if lattice.bend_m.size:
        write_array(folder / _BEND, lattice.bend_m)
    (a, b), (c, d) = layout.turn.tolist()
    nodes, columns, _ = lattice.bend_m.shape
    return CellsManifest(
        shape=layout.shape,
        origin_xy_m=layout.origin_xy_m,
        turn=((a, b), (c, d)),
        width_m=lattice.width_m,
        height_m=lattice.height_m,
        shear_m=lattice.shear_m,
        bend_shape=(nodes, columns, 2),
        node_px=lattice.node_px,
        first_row=lattice.first_row,
        first_column=lattice.first_column,
    )


def read_cells(folder: Path, manifest: CellsManifest) -> Cells:
    """The heights memory-mapped; raises ``StorageError`` when a file is damaged."""
    heights = read_array(folder / _HEIGHTS, shape=manifest.shape, dtype=np.float32)
    layout = Layout(_lattice(folder, manifest), manifest.origin_xy_m, np.array(manifest.turn), manifest.shape)
    return Cells(heights, layout)


def _lattice(folder: Path, manifest: CellsManifest) -> Lattice:
    lattice = straight(manifest.width_m, manifest.height_m, manifest.shear_m)
    if 0 in manifest.bend_shape:
        return lattice
    bend = read_array(folder / _BEND, shape=manifest.bend_shape, dtype=np.float64)
    return lattice._replace(
        bend_m=np.array(bend),
        node_px=manifest.node_px,
        first_row=manifest.first_row,
        first_column=manifest.first_column,
    )


def _damaged(path: Path, why: str) -> StorageError:
    return StorageError(f"The file is damaged: {why}.", where=str(path), advice="Delete the entry and add it again.")
