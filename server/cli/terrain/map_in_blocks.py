"""``hedgehop traversability --cluster``: the map of a model that no process holds as a whole, worked out in blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from planning.errors import ParameterError
from planning.ground.traversable import MapCells, map_cells, traversable_part
from planning.safe_surface.window import Box
from planning.terrain.dsm import SurfaceModel
from planning.terrain.grid_file import GridPlace
from server.cli.shared.by_blocks import Block, BlockOrder, write_by_blocks
from server.cli.shared.output import end_progress
from server.work.clocks import StepTimer

MOST_TOGETHER = 2000
"""Cells of the model on each side that become one of the map."""


@dataclass(frozen=True, slots=True)
class MapWork:
    """Of each block: the share of the index at which a vehicle stops, 0 to 1."""

    cells: MapCells

    def block_of(self, model: SurfaceModel, box: Box) -> Block:
        """Counted are the map's cells that are known, and those that cannot be driven on."""
        part = traversable_part(model, self.cells, box)
        counts = int(part.known.sum()), int(part.untraversable.sum())
        return Block(part.value, int(np.isfinite(part.elevation_m).sum()), counts)


def map_by_blocks(order: BlockOrder, resolution_m: float | None, step: str, timer: StepTimer) -> dict[str, Any]:
    """Writes ``order.out`` and returns what is told of it; the file is that of the command on one process."""
    opened = order.open(timer)
    cells = map_cells(opened.model, resolution_m)
    if cells.together > MOST_TOGETHER:
        raise ParameterError(
            f"In cells of {cells.resolution_m:g} m {cells.together:,} x {cells.together:,} of the model's become one; "
            f"with --cluster at most {MOST_TOGETHER:,} x {MOST_TOGETHER:,} do.",
            where="--resolution-m",
            advice="Choose finer cells.",
        )
    place = GridPlace(cells.transform, opened.model.crs, None, cells.shape)
    known, untraversable = write_by_blocks(
        order, opened, place, MapWork(cells), lambda share: timer(step, share), together=cells.together
    )
    end_progress()
    return {"resolution_m": cells.resolution_m, "cells": known, "untraversable": untraversable}


def file_in(order: BlockOrder, name: str) -> BlockOrder:
    """Where ``out`` is a directory: that file in it."""
    return order if order.out.suffix else replace(order, out=order.out / name)


def refuse_beside_cluster(uwb: Path | None, near: str | None) -> None:
    """Raises ParameterError for what needs the whole map."""
    for option, given in (("--uwb", uwb), ("--near", near)):
        if given is not None:
            raise ParameterError(
                f"{option} needs the whole map in memory, which --cluster does not make.",
                where=option,
                advice="Leave --cluster away, or cut the place out of the model before.",
            )
