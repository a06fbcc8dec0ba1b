"""``hedgehop radar tracks``: the ODA data set's radar.csv with its optitrack.csv, as tracks against truth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from typer import Argument, Option

from server.cli.radar.process_command import RadarOptionsError
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, end_progress, progress, say
from server.studies.oda_tracks import TracksWanted, tracks_against_truth
from telemetry.simulation.scenarios.arena.against_truth import Pole, TruthComparison, rms
from telemetry.simulation.scenarios.arena.truth_figures import truth_part
from telemetry.simulation.scenarios.stage.result import FlightResult, figure_json

DRAWN = "tracks.png"


@command
def tracks(
    file: Annotated[Path, Argument(metavar="RADAR", help="The data set's radar.csv.")],
    optitrack: Annotated[Path, Argument(metavar="OPTITRACK", help="The optitrack.csv beside it.")],
    pole: Annotated[
        list[str], Option(metavar="X,Z", help="Where a pole stood, in the capture's metres. May be repeated.")
    ],
    offset_s: Annotated[float, Option(help="The radar's first frame was so long after the capture's first row.")] = 0.0,
    forward: Annotated[
        Literal["x", "z", "-x", "-z"], Option(help="Which of the captured body's axes is its nose.")
    ] = "x",
    plots: Annotated[Path | None, Option(metavar="DIR", help="Draw ways and errors there (tracks.png).")] = None,
    as_json: o.AsJson = False,
) -> None:
    """Follow what a Position2Go's samples show and hold it against where the poles truly were."""
    wanted = TracksWanted(tuple(_place(words) for words in pole), offset_s, forward)
    found = tracks_against_truth(file, optitrack, wanted, progress)
    end_progress()
    part = truth_part(found, f"{file.name}, {found.frames} frames")
    if plots is not None:
        # Loaded only now: drawing is rarely asked for.
        from server.cli.plots.chart_plots import write_figure

        say(f"Drawn: {write_figure(plots / DRAWN, part.charts, part.title)}")
    counts = {"frames": found.frames, "left_out": found.left_out, "others": len(found.others)}
    poles = [_summary(pole) for pole in found.poles]
    figures = [figure_json(figure) for figure in part.figures]
    answer({**counts, "poles": poles, "figures": figures}, _lines(file, found, part), as_json=as_json)


def _place(words: str) -> tuple[float, float]:
    """x and z."""
    try:
        x, z = (float(word) for word in words.split(","))
        if not (math.isfinite(x) and math.isfinite(z)):
            raise ValueError
    except ValueError:
        what = f'"{words}" is no place.'
        raise RadarOptionsError(what, where="--pole", advice="Write x and z in metres, as 1.5,-3.") from None
    return x, z


def _lines(file: Path, found: TruthComparison, part: FlightResult) -> Iterator[str]:
    yield f"{file.name}: {found.frames:,} frames; {found.left_out:,} outside the capture's time"
    for figure in part.figures:
        yield f"  {figure.line()}"
    for note in part.notes:
        yield f"  {note}"


def _summary(pole: Pole) -> dict[str, Any]:
    has_errors = bool(pole.errors)
    return {
        "x_m": pole.place_en_m[0],
        "z_m": -pole.place_en_m[1],
        "in_view": len(pole.in_view),
        "followed": len(pole.followed),
        "range_rms_m": rms([error.range_m for error in pole.errors]) if has_errors else None,
        "bearing_rms_deg": math.degrees(rms([error.bearing_rad for error in pole.errors])) if has_errors else None,
    }
