"""``hedgehop scenario``: the papers' field tests of obstacle detection, flown in simulation, and their figures."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from planning.basics.limits import LARGEST_SEED
from planning.errors import ParameterError
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.files_in_out import check_directory, check_new
from server.cli.shared.output import end_progress, print_json, progress, say
from server.work.cluster import spread
from telemetry.simulation.scenarios.catalogue import NAMES, run_scenario
from telemetry.simulation.scenarios.stage.result import ScenarioRequest, ScenarioResult, tally, tally_json
from telemetry.topics.vehicle import RadarKind


@command
def scenario(
    name: Annotated[str, Argument(metavar="NAME", help=f"One of {', '.join(NAMES)}.")],
    world: Annotated[
        Path | None, Option(metavar="FILE", help="Objects of your own (JSON) instead of the scenario's.")
    ] = None,
    seed: Annotated[int, Option(min=0, max=LARGEST_SEED, help="Of the scene, the sensors' noise and the wind.")] = 0,
    seeds: Annotated[int, Option(min=1, max=LARGEST_SEED, help="So many seeds, from --seed on.")] = 1,
    radar: Annotated[RadarKind | None, Option(help="arena: by what it would report, or from its samples on.")] = None,
    figures: Annotated[
        list[str] | None,
        Option(
            "--set",
            metavar="NAME=VALUE",
            help="arena: a figure of the tracker or of velocities, such as tracker.coordinates=polar or "
            "velocities.max_turn_deg=60. May be given several times.",
        ),
    ] = None,
    record: Annotated[
        Path | None,
        Option(
            metavar="FILE",
            help="Keep the flight (.mcap) with frames, maps and alerts here; of foliage the radar log (.npz).",
        ),
    ] = None,
    plots: Annotated[
        Path | None, Option(metavar="DIR", help="Draw what of it is a curve, such as the ROC of foliage.")
    ] = None,
    cluster: o.Cluster = None,
    as_json: o.AsJson = False,
) -> None:
    """Fly one of the papers' field tests in simulation and measure what the sensors' maps and alerts are worth.

    Virtual time: the same seed gives the same flight. The exit code is 1 when a figure is not reached.
    """
    _check(name, record, seed, seeds)
    if record is not None and cluster is not None:
        raise ParameterError(
            "A worker would keep the flight where it runs.",
            where="--record",
            advice="Leave --cluster away, or --record.",
        )
    own = _own(name, radar, figures or [])
    _check_plots(plots, seeds)
    world = o.existing(world)
    world = None if world is None else world.absolute()
    wanted = [
        (name, ScenarioRequest(number, world, radar, own, record, charts=plots is not None))
        for number in range(seed, seed + seeds)
    ]
    results: list[ScenarioResult] = []

    def flying(share: float) -> None:
        progress(f"Flying {name}", share if seeds > 1 else None)

    with closing(spread(_fly, wanted, cluster, flying)) as flown:
        for result in flown:
            results.append(result)
            end_progress()
            if not as_json:
                typer.echo("\n".join(results[-1].lines()))
    if plots is not None:
        _draw(plots, results[0])
    if as_json:
        print_json(results[0].as_json() if seeds == 1 else tally_json(results))
    elif seeds > 1:
        typer.echo("\n".join(tally(results)))
    raise typer.Exit(DONE if all(result.passed for result in results) else FAILED)


def _fly(wanted: tuple[str, ScenarioRequest]) -> ScenarioResult:
    return run_scenario(*wanted)


def _draw(plots: Path, result: ScenarioResult) -> None:
    """Loaded only now: drawing is rarely asked for."""
    from server.cli.plots.chart_plots import write_charts

    for path in write_charts(plots, result):
        say(f"Drawn: {path}")


def _check_plots(plots: Path | None, seeds: int) -> None:
    if plots is None:
        return
    if seeds > 1:
        raise ParameterError(
            f"Figures show one seed, not {seeds}.", where="--plots", advice="Leave --seeds away, or --plots."
        )
    check_directory(plots)


def _check(name: str, record: Path | None, seed: int, seeds: int) -> None:
    if name not in NAMES:
        raise ParameterError(
            f'There is no scenario "{name}".', where="NAME", advice=f"Choose one of {', '.join(NAMES)}."
        )
    if (last := seed + seeds - 1) > LARGEST_SEED:
        raise ParameterError(
            f"The last seed would be {last:,}.", where="--seeds", advice=f"It may be {LARGEST_SEED:,} at most."
        )
    if record is None:
        return
    if seeds > 1:
        raise ParameterError(
            f"A recording holds one seed, not {seeds}.", where="--record", advice="Leave --seeds away, or --record."
        )
    check_new(record)
    record.parent.mkdir(parents=True, exist_ok=True)


def _own(name: str, radar: RadarKind | None, figures: list[str]) -> dict[str, dict[str, str]]:
    """``part.name=value`` each, by part."""
    if name != "arena" and (radar is not None or figures):
        raise ParameterError(
            "Radar and figures can be chosen of the arena only.", where=name, advice="Leave out --radar and --set."
        )
    out: dict[str, dict[str, str]] = {"tracker": {}, "velocities": {}}
    for figure in figures:
        place, equals, value = figure.partition("=")
        part, dot, what = place.partition(".")
        if not (equals and dot and part in out):
            raise ParameterError(
                f'"{figure}" sets nothing.', where="--set", advice="Write tracker.NAME=VALUE or velocities.NAME=VALUE."
            )
        out[part][what] = value
    return {part: values for part, values in out.items() if values}
