"""``hedgehop radar tracks``: the ODA data set's radar.csv with its optitrack.csv, as tracks against truth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from typer import Argument, Option

from mapping.radar.chain import POSITION2GO_SETTINGS, RadarChain
from mapping.radar.detections import Detections
from mapping.radar.params import POSITION2GO
from server.cli.radar.process_command import RadarOptionsError
from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, end_progress, progress, say
from telemetry.sensors.adc.oda import open_oda
from telemetry.sensors.optitrack import read_optitrack
from telemetry.simulation.scenarios.arena.against_truth import Pole, TruthComparison, compared


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
    plots: Annotated[Path | None, Option(metavar="DIR", help="Draw both there (tracks.png).")] = None,
    as_json: o.AsJson = False,
) -> None:
    """Follow what a Position2Go's samples show and hold it against where the poles truly were."""
    places = np.array([_place(words) for words in pole])
    capture = read_optitrack(optitrack, forward=forward)
    found = compared(_frames(file), capture, places, offset_s=offset_s)
    end_progress()
    if plots is not None:
        from server.cli.plots.radar_tracks_plot import write_tracks

        say(f"Drawn: {write_tracks(plots, found, f'{file.name}, {found.frames} frames')}")
    poles = [_figures(pole) for pole in found.poles]
    counts = {"frames": found.frames, "left_out": found.left_out, "others": len(found.others)}
    answer({**counts, "poles": poles}, _lines(file, found, poles), as_json=as_json)


def _place(words: str) -> tuple[float, float]:
    """East and north."""
    try:
        x, z = (float(word) for word in words.split(","))
    except ValueError:
        what = f'"{words}" is no place.'
        raise RadarOptionsError(what, where="--pole", advice="Write x and z in metres, as 1.5,-3.") from None
    return x, -z


def _frames(file: Path) -> Iterator[tuple[float, Detections]]:
    chain = RadarChain(POSITION2GO, POSITION2GO_SETTINGS)
    for number, frame in enumerate(open_oda(file, POSITION2GO).frames()):
        progress(f"Frame {number}", None)
        yield frame.t_s, chain.process(frame.cube)


def _lines(file: Path, found: TruthComparison, poles: list[dict[str, Any]]) -> Iterator[str]:
    yield f"{file.name}: {found.frames:,} frames; {found.left_out:,} outside the capture's time"
    for number, one in enumerate(poles, start=1):
        words = f"  pole {number}: in view in {one['in_view']} frames, followed in {one['followed']}"
        if one["followed"]:
            words += f"; off by {one['range_rms_m']:.2f} m in range, {one['bearing_rms_deg']:.1f} deg in bearing (RMS)"
        yield words
    yield f"  where no pole is: {len(found.others)} times an object in a frame"


def _figures(pole: Pole) -> dict[str, Any]:
    def rms(errors: list[float]) -> float | None:
        return float(np.sqrt(np.mean(np.square(errors)))) if errors else None

    bearing_rad = rms(pole.bearing_error_rad)
    return {
        "x_m": pole.place_en_m[0],
        "z_m": -pole.place_en_m[1],
        "in_view": len(pole.in_view),
        "followed": len(pole.followed),
        "range_rms_m": rms(pole.range_error_m),
        "bearing_rms_deg": None if bearing_rad is None else float(np.degrees(bearing_rad)),
    }
