"""The ROC of clearing foliage: how much of it is cleared against what of the obstacles goes with it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from telemetry.scenarios.foliage_roc import Roc

NAME = "roc.png"
_COLOURS = ("#1f6f8b", "#e4572e")


def write_roc(folder: Path, found: Sequence[Roc], seed: int) -> Path:
    """One figure, a field for each trial. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    figure = Figure(figsize=(4.6 * len(found), 4.8), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, roc in zip(figure.subplots(1, len(found), squeeze=False)[0], found, strict=True):
        for curve, colour in zip(roc.curves, _COLOURS, strict=False):
            axes.plot(100 * curve.fnr, 100 * curve.tnr, color=colour, linewidth=1.4, label=curve.rule)
            axes.plot(100 * curve.usual[1], 100 * curve.usual[0], "o", color=colour, label="at the limit in use, 0.5")
        axes.axhline(100 * roc.paper[0], color="#777777", linestyle=":", label=f"the paper's TNR, {roc.paper[0]:.0%}")
        axes.set(title=roc.trial, xlim=(-2, 102), ylim=(-2, 102))
        axes.set(xlabel="FNR of the things on the lawn [%]", ylabel="TNR of the foliage [%]")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="lower right")
    figure.suptitle(f"Clearing foliage, seed {seed}: all limits of probability", fontsize=10, color="#555555")
    path = folder / NAME
    figure.savefig(path, metadata={"Software": None})
    return path
