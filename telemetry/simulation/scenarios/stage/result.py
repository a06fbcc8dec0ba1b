"""What is wanted of a scenario, and what it came to: figures with the limits that they are held to, to be read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from telemetry.simulation.scenarios.stage.scenario_curves import Chart
from telemetry.topics.obstacles import AlertSource
from telemetry.topics.vehicle import RadarKind

Report = Callable[[str, float | None], None]


def _to_nobody(step: str, share: float | None) -> None:
    """Where nobody waits for it."""


@dataclass(frozen=True, slots=True)
class ScenarioRequest:
    """What is wanted of a scenario."""

    seed: int = 0
    """Of the scene, the sensors' noise and the wind."""
    world: Path | None = None
    """A file that takes the place of the scenario's own objects, and of its ground if it names one."""
    radar: RadarKind | None = None
    """Simulated by what it would report, or from its samples on; None: as the scenario has it."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Other perception settings than the scenario's, of those that it takes: "tracker" and "velocities"."""
    record: Path | None = None
    """Where the flight is kept; of several flights each beside it, under its own name."""
    charts: bool = False
    """Whether curves are wanted that cost extra time."""
    report: Report = field(default=_to_nobody, compare=False)
    """How far it is: what is being done, and what share of the whole, if that is known."""


WITHIN_M = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0)


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured number and what it must be."""

    words: str
    value: float
    """NaN where there was nothing to measure it on: no limit is reached by that."""
    least: float | None = None
    most: float | None = None
    unit: str = ""
    paper: str = ""
    """What the paper prints of it; empty: nothing that could stand beside it."""

    @property
    def verdict(self) -> Literal["reached", "NOT REACHED", "not measured"]:
        if math.isnan(self.value):
            return "not measured"
        return "reached" if self.reached else "NOT REACHED"

    @property
    def reached(self) -> bool:
        above = self.least is None or self.value >= self.least
        return above and (self.most is None or self.value <= self.most)

    def line(self) -> str:
        limit = f"at least {_short(self.least)}" if self.least is not None else ""
        limit = f"at most {_short(self.most)}" if self.most is not None else limit
        verdict = f"  ({limit}{self.unit}: {self.verdict})" if limit else ""
        printed = f"  (paper: {self.paper})" if self.paper else ""
        unit = "" if math.isnan(self.value) else self.unit
        return f"{self.words}: {_short(self.value)}{unit}{verdict}{printed}"


@dataclass(frozen=True, slots=True)
class MapFigures:
    """One sensor's map against the world as it truly is. None where it has no meaning."""

    voxels: int = 0
    within_m: dict[str, float] = field(default_factory=dict)
    """Share of the returns or voxels whose distance from the true place or surface is at most the key, metres."""
    vertical_spread_m: float | None = None
    precision: float | None = None
    recall: float | None = None


@dataclass(frozen=True, slots=True)
class AlertSeen:
    t_s: float
    """Since take-off was commanded."""
    sensor: AlertSource
    distance_m: float | None


@dataclass(frozen=True, slots=True)
class FlightResult:
    """One flight of a scenario."""

    title: str
    duration_s: float
    contact: bool
    """Where the vehicle flies on through what it meets, too."""
    min_true_distance_m: float
    """From the vehicle's centre to the nearest object; infinite in a world without any."""
    alerts: tuple[AlertSeen, ...]
    radar: MapFigures = field(default_factory=MapFigures)
    vision: MapFigures = field(default_factory=MapFigures)
    false_alarms_per_km: float | None = None
    missed: int | None = None
    """Unknown objects in the way that were alarmed too late or not at all."""
    figures: tuple[Figure, ...] = ()
    notes: tuple[str, ...] = ()
    charts: tuple[Chart, ...] = ()

    @property
    def first_alert_s(self) -> float | None:
        return min((alert.t_s for alert in self.alerts), default=None)


def measured(
    title: str, figures: tuple[Figure, ...], notes: Sequence[str] = (), charts: tuple[Chart, ...] = ()
) -> FlightResult:
    """Of a part in which nothing flies."""
    return FlightResult(title, 0.0, False, math.inf, (), figures=figures, notes=tuple(notes), charts=charts)


@dataclass(frozen=True, slots=True)
class ScenarioResult:
    name: str
    seed: int
    flights: tuple[FlightResult, ...]

    @property
    def figures(self) -> tuple[Figure, ...]:
        return tuple(figure for flight in self.flights for figure in flight.figures)

    @property
    def passed(self) -> bool:
        return all(figure.reached for figure in self.figures)

    def as_json(self) -> dict[str, Any]:
        flights = [_flight_json(flight) for flight in self.flights]
        head = {"name": self.name, "seed": self.seed}
        if len(flights) == 1:
            return head | flights[0] | {"passed": self.passed}
        return head | _together(flights) | {"passed": self.passed, "flights": flights}

    def lines(self) -> list[str]:
        out = [f"{self.name}, seed {self.seed}"]
        for flight in self.flights:
            out += [f"  {line}" for line in _flight_lines(flight)]
        return out


def _flight_json(flight: FlightResult) -> dict[str, Any]:
    return {
        "flight": flight.title,
        "duration_s": round(flight.duration_s, 2),
        "contact": flight.contact,
        "min_true_distance_m": _number(flight.min_true_distance_m),
        "alerts": [
            {"t_s": round(alert.t_s, 3), "sensor": alert.sensor, "distance_m": _number(alert.distance_m)}
            for alert in flight.alerts
        ],
        "first_alert_s": _number(flight.first_alert_s),
        "radar": _map_json(flight.radar),
        "vision": _map_json(flight.vision),
        "false_alarms_per_km": _number(flight.false_alarms_per_km),
        "missed": flight.missed,
        "figures": [figure_json(figure) for figure in flight.figures],
        "notes": list(flight.notes),
    }


def figure_json(figure: Figure) -> dict[str, Any]:
    return {
        "words": figure.words,
        "value": _number(figure.value),
        "least": figure.least,
        "most": figure.most,
        "unit": figure.unit.strip(),
        "reached": figure.reached,
        "paper": figure.paper,
    }


def _together(flights: list[dict[str, Any]]) -> dict[str, Any]:
    """The keys of a single flight over several: sums of times and alerts, the worst of distances, the first map."""
    distances = [f["min_true_distance_m"] for f in flights if f["min_true_distance_m"] is not None]
    firsts = [f["first_alert_s"] for f in flights if f["first_alert_s"] is not None]
    missed = [f["missed"] for f in flights if f["missed"] is not None]
    false = [f["false_alarms_per_km"] for f in flights if f["false_alarms_per_km"] is not None]
    return {
        "duration_s": round(sum(f["duration_s"] for f in flights), 2),
        "contact": any(f["contact"] for f in flights),
        "min_true_distance_m": min(distances, default=None),
        "alerts": [alert | {"flight": f["flight"]} for f in flights for alert in f["alerts"]],
        "first_alert_s": min(firsts, default=None),
        "radar": next((f["radar"] for f in flights if f["radar"]["voxels"]), flights[0]["radar"]),
        "vision": next((f["vision"] for f in flights if f["vision"]["voxels"]), flights[0]["vision"]),
        "false_alarms_per_km": max(false, default=None),
        "missed": sum(missed) if missed else None,
    }


def _map_json(figures: MapFigures) -> dict[str, Any]:
    return {
        "voxels": figures.voxels,
        "within_m": {key: round(share, 4) for key, share in figures.within_m.items()},
        "vertical_spread_m": _number(figures.vertical_spread_m),
        "precision": _number(figures.precision),
        "recall": _number(figures.recall),
    }


def _flight_lines(flight: FlightResult) -> list[str]:
    nearest = "nothing near" if math.isinf(flight.min_true_distance_m) else f"{flight.min_true_distance_m:.2f} m"
    first = "no alert" if flight.first_alert_s is None else f"first alert after {flight.first_alert_s:.1f} s"
    head = f"{flight.title}: {flight.duration_s:.0f} s, {'CONTACT' if flight.contact else 'no contact'}, "
    out = [head + f"nearest {nearest}, {len(flight.alerts)} alerts, {first}" if flight.duration_s else flight.title]
    for name, figures in (("radar", flight.radar), ("vision", flight.vision)):
        if figures.voxels or figures.within_m:
            out.append(f"  {name}: {_map_words(figures)}")
    if flight.false_alarms_per_km is not None:
        out.append(f"  false alarms per km {_short(flight.false_alarms_per_km)}, missed {flight.missed}")
    out += [f"  {figure.line()}" for figure in flight.figures]
    return out + [f"  {note}" for note in flight.notes]


def _map_words(figures: MapFigures) -> str:
    parts = [f"{figures.voxels} voxels"]
    parts += [f"{100 * share:.1f} % within {key} m" for key, share in figures.within_m.items()]
    if figures.vertical_spread_m is not None:
        parts.append(f"vertical spread {figures.vertical_spread_m:.1f} m")
    if figures.precision is not None:
        parts.append(f"precision {figures.precision:.3f}")
    if figures.recall is not None:
        parts.append(f"recall {figures.recall:.3f}")
    return ", ".join(parts)


def tally(results: Sequence[ScenarioResult]) -> list[str]:
    """Over several seeds: how often each figure was reached, and its worst value."""
    out = [f"{results[0].name}: {sum(r.passed for r in results)} of {len(results)} seeds reached every figure"]
    for row in _tallied(results):
        out.append(
            f"  {row['words']}: reached {row['reached']} of {row['of']}, worst {_short(row['worst'])}{row['unit']}"
        )
    return out


def tally_json(results: Sequence[ScenarioResult]) -> dict[str, Any]:
    """``figures``: how often each was reached; ``runs``: every seed's own."""
    figures = [row | {"worst": _number(row["worst"]), "unit": row["unit"].strip()} for row in _tallied(results)]
    return {
        "name": results[0].name,
        "seeds": [result.seed for result in results],
        "passed": sum(result.passed for result in results),
        "figures": figures,
        "runs": [result.as_json() for result in results],
    }


def _tallied(results: Sequence[ScenarioResult]) -> list[dict[str, Any]]:
    out: list[dict[str, Any]] = []
    for words in dict.fromkeys(figure.words for result in results for figure in result.figures):
        found = [figure for result in results for figure in result.figures if figure.words == words]
        values = [figure.value for figure in found if not math.isnan(figure.value)] or [math.nan]
        out.append(
            {
                "words": words,
                "reached": sum(figure.reached for figure in found),
                "of": len(found),
                "worst": max(values) if found[0].most is not None else min(values),
                "unit": found[0].unit,
            }
        )
    return out


def _short(value: float | None) -> str:
    return "none" if value is None or math.isnan(value) else f"{value:.3g}"


def _number(value: float | None) -> float | None:
    """JSON knows neither infinity nor NaN."""
    return None if value is None or not math.isfinite(value) else round(value, 4)
