"""``hedgehop terrain dilate``: a surface model dilated by the ball (R, H), as a file; it may be larger than memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from planning.errors import ParameterError
from planning.safe_surface.element import ball_reach
from planning.safe_surface.surface import check_ball, dilate_part
from planning.safe_surface.window import Box
from planning.terrain.dsm import SurfaceModel
from planning.terrain.grid_file import GridPlace
from server.cli.shared import options as o
from server.cli.shared.by_blocks import Block, BlockOrder, write_by_blocks
from server.cli.shared.command import Without, command
from server.cli.shared.output import answer, end_progress, harmless, progress
from server.work.clocks import StepTimer

MOST_REACH_PX = 1000
"""Around each block so many cells are read at most."""
_STEP = "Dilating"


@dataclass(frozen=True, slots=True)
class Dilation:
    """Of each block (Melita 2020, eq. 2)."""

    radius_m: float
    height_m: float

    def block_of(self, model: SurfaceModel, box: Box) -> Block:
        values = dilate_part(model, box, radius_m=self.radius_m, height_m=self.height_m)
        return Block(values, known := int(np.isfinite(values).sum()), (known,))


@command
def dilate(
    dsm: o.DsmFile,
    *,
    out: Annotated[Path, Option(metavar="FILE", help="The dilated surface: .tif, a new file.")],
    radius_m: Annotated[float, Option(help="Radius R of the dilating ball.")] = o.SurfaceOptions().radius_m,
    height_m: Annotated[float, Option(help="Height H of the dilating ball.")] = o.SurfaceOptions().height_m,
    cluster: o.Cluster = None,
    as_json: o.AsJson = False,
    how: Annotated[o.ModelOptions, Without("catalogue", "max_hole_m2", "remove_spikes")],
) -> None:
    """Write a surface model dilated by the ball (R, H): what `plan` smooths and flies on, exact and before smoothing.

    The model may be larger than memory: it is read and written in blocks. Cells with nothing known within R stay
    unknown, holes are not filled.
    """
    order = BlockOrder(dsm, how, out, cluster)
    order.check()
    timer = StepTimer(progress)
    opened = order.open(timer)
    model = opened.model
    check_ball(model, radius_m, height_m)
    _check_reach(model, radius_m)
    place = GridPlace(model.transform, model.crs, model.vertical_datum, (model.height_px, model.width_px))
    (known,) = write_by_blocks(order, opened, place, Dilation(radius_m, height_m), lambda share: timer(_STEP, share))
    end_progress()
    rows, columns = place.shape
    summary = {
        "cells": rows * columns,
        "known": known,
        "resolution_m": model.resolution_m,
        "radius_m": radius_m,
        "height_m": height_m,
        "seconds": round(timer.seconds()["total"], 3),
    }
    line = (
        f"{harmless(out.name)}: {columns:,} x {rows:,} cells of {model.resolution_m:.2f} m, dilated by R "
        f"{radius_m:g} m, H {height_m:g} m; {known:,} of them known"
    )
    answer(summary, [line], as_json=as_json)


def _check_reach(model: SurfaceModel, radius_m: float) -> None:
    reach = ball_reach(radius_m / model.resolution_m)
    if reach > MOST_REACH_PX:
        raise ParameterError(
            f"The dilation radius of {radius_m:g} m is {reach:,} cells of this model; at most {MOST_REACH_PX:,} are "
            "looked at around each.",
            where="--radius-m",
            advice="Choose a smaller radius or a coarser model.",
        )
