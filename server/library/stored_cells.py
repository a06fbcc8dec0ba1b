"""The source cells of a surface model on disk: ``cells.npy`` and, where the lattice is bent, ``bend.npy``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from planning.terrain.cells.cells import Cells, Layout
from planning.terrain.cells.lattice import Lattice, straight
from server.library.stored_arrays import read_array, write_array

_HEIGHTS, _BEND = "cells.npy", "bend.npy"
Pair = tuple[float, float]


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
