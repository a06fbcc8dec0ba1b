"""``hedgehop risk``: how likely a flight of a mission is to touch the surface model, by many flights with errors."""

from __future__ import annotations

import math
import pickle
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

from planning.basics import limits
from planning.basics.limits import LARGEST_SEED
from planning.basics.plan_model import Mission
from planning.certificate.certificate_model import Certificate
from planning.errors import MissionError, ParameterError
from planning.formats.detect import read_flight
from planning.margins.budget import ClearanceBudget
from planning.missions.flown import flown_line
from planning.planner.part import MARGIN_M, Grounds, certify_part, looked_over, mission_places
from planning.risk.flights import Closest, RiskGround, fly, risk_ground
from planning.risk.tally import Risk, risk_of, share_of
from planning.risk.uncertain import CORRELATION_M, ErrorCode, Uncertain, uncertain_of
from planning.terrain import BOUND_RMS
from planning.terrain.dsm import Dsm
from planning.terrain.rasters.http_ranges import is_address
from server.cli.judging.risk_words import STATEMENT, risk_lines
from server.cli.shared import options as o
from server.cli.shared.command import Without, command
from server.cli.shared.files_in_out import read_small
from server.cli.shared.mission_vehicle import judged_by
from server.cli.shared.output import answer, end_progress, progress
from server.cli.shared.terrain_given import open_model, same_model
from server.work.clocks import StepTimer
from server.work.cluster import check_where, spread

MOST_FLIGHTS = 10_000_000
_PER_PIECE = 100
_STEP = "Flying with errors"
_BEYOND = 4.0
"""Budgets of clearance by which flights are taken to be moved at most: ground is read that much farther around."""


@dataclass(frozen=True, slots=True)
class _Job:
    """What a worker is told once."""

    dsm: Path
    model: o.ModelOptions
    sha256: str
    mission: Mission
    required_clearance_m: float
    margin_m: float
    uncertain: Uncertain
    seed: int


@command
def risk(
    dsm: o.DsmFile,
    mission: Annotated[Path, Argument(metavar="MISSION", help="Mission: .waypoints, .plan, .kml, .kmz.")],
    *,
    flights: Annotated[int, Option(min=1, max=MOST_FLIGHTS, help="How often it is flown.")] = 10_000,
    seed: Annotated[int, Option(min=0, max=LARGEST_SEED, help="Of all errors.")] = 0,
    sigmas: Annotated[
        float, Option(help="Standard deviations at which each term of the clearance has its worse end.")
    ] = BOUND_RMS,
    correlation_m: Annotated[
        list[str] | None,
        Option(
            metavar="NAME=METRES",
            help=f"Distance along the line over which an error stays about the same: {', '.join(CORRELATION_M)}; inf: "
            "all along a flight. May be given several times.",
        ),
    ] = None,
    confidence: Annotated[float, Option(help="Of the interval that is told.")] = 0.95,
    cluster: o.Cluster = None,
    as_json: o.AsJson = False,
    model: o.ModelOptions,
    given: Annotated[o.VehicleOptions, Without("max_items")],
    demands: o.ClearanceOptions,
) -> None:
    """Estimate how likely a flight is to touch the surface model, by flying it many times with random errors.

    An estimate, never a proof: it changes nothing of what `hedgehop certify` says. Only the flown line is looked at,
    not take-off, landing and ways home; what the surface model does not hold is not in it.
    """
    if cluster is not None:
        check_where(cluster)
    share_of(0, flights, confidence)
    limits.SURFACE["fill_hole_area_m2"].check(model.max_hole_m2)
    lengths_m = _lengths(correlation_m or [])
    flight = read_flight(mission.name, read_small(mission))
    request = judged_by(flight, given, demands, demands.flown_as)
    opened = open_model(dsm, StepTimer(progress), model)
    progress("Proving the clearance", None)
    found, certificate = certify_part(
        opened.model, flight, request.clearance(), max_hole_m2=model.max_hole_m2, assumptions=opened.made
    )
    opened.say_part(found.dsm)
    _refuse_unjudged(flight, found.filled)
    budget = certificate.budget
    assert budget is not None
    uncertain = uncertain_of(budget, certificate.home, sigmas=sigmas, correlation_m=lengths_m)
    job = _Job(
        dsm if is_address(dsm) else dsm.absolute(), model, opened.model.sha256, flight,
        request.clearance().required_clearance_m, _margin_m(certificate, budget), uncertain, seed,
    )  # fmt: skip
    told = _estimated(job, flights, confidence, cluster)
    summary = _summary(told, job, certificate, lengths_m)
    answer(summary, risk_lines(told, uncertain, certificate), as_json=as_json)


def _estimated(job: _Job, flights: int, confidence: float, cluster: str | None) -> Risk:
    told = pickle.dumps(job)
    pieces = [(told, range(first, min(flights, first + _PER_PIECE))) for first in range(0, flights, _PER_PIECE)]
    answers = list(spread(_flown, pieces, cluster, lambda share: progress(_STEP, share)))
    end_progress()
    closest = Closest(
        np.concatenate([each.distance_m for each in answers]), np.concatenate([each.piece for each in answers])
    )
    ground, filled = _ready(told)
    return risk_of(closest, ground, filled, job.uncertain.radius_m, confidence)


def _flown(piece: tuple[bytes, range]) -> Closest:
    """On a worker, or here."""
    told, flights = piece
    job: _Job = pickle.loads(told)
    return fly(_ready(told)[0], job.uncertain, flights, job.seed)


@lru_cache(maxsize=1)
def _ready(told: bytes) -> tuple[RiskGround, Dsm]:
    """Read and laid out once by each worker: the ground, and its surface model with its small holes filled."""
    job: _Job = pickle.loads(told)
    source = same_model(job.dsm, job.model, job.sha256).model
    places_m = mission_places(source, job.mission)
    source = looked_over(source, places_m, job.required_clearance_m)
    filled = Grounds(source, job.model.max_hole_m2).around(places_m, job.margin_m).filled
    return risk_ground(filled, flown_line(job.mission, filled)), filled


def _margin_m(certificate: Certificate, budget: ClearanceBudget) -> float:
    """Around all places of the mission: no flight comes nearer to where the part is cut than to the ground itself."""
    farthest_m = float(
        np.max(certificate.trend_distance_m, initial=0.0, where=np.isfinite(certificate.trend_distance_m))
    )
    return farthest_m + _BEYOND * budget.total_m + MARGIN_M


def _refuse_unjudged(flight: Mission, filled: Dsm) -> None:
    unjudged = flown_line(flight, filled).unjudged
    if unjudged:
        raise MissionError(
            "Parts of this mission fly a line that nobody can tell from its items.",
            where=f"item {unjudged[0].item}",
            advice="hedgehop certify says which; plan them as plain waypoints.",
        )


def _lengths(given: list[str]) -> dict[ErrorCode, float]:
    lengths_m: dict[ErrorCode, float] = {}
    for text in given:
        name, _, value = text.partition("=")
        code: ErrorCode | None = next((each for each in CORRELATION_M if each == name), None)
        try:
            length_m = float(value)
        except ValueError:
            length_m = math.nan
        if code is None or math.isnan(length_m):
            raise ParameterError(
                f"{text!r} sets no length.",
                where="--correlation-m",
                advice=f"Write NAME=METRES, NAME one of {', '.join(CORRELATION_M)}.",
            )
        lengths_m[code] = length_m
    return lengths_m


def _summary(told: Risk, job: _Job, certificate: Certificate, lengths_m: dict[ErrorCode, float]) -> dict[str, Any]:
    uncertain = job.uncertain
    return {
        "is_proof": False,
        "statement": STATEMENT,
        "certified": certificate.certified,
        "contact": {**asdict(told.contact), "estimate": told.contact.estimate},
        "hull_m": {f"{percent:g}%": value_m for percent, value_m in told.hull_m.items()},
        "nearest_hull_m": told.nearest_hull_m,
        "worst": asdict(told.worst),
        "errors": [
            asdict(replace(error, correlation_m=0.0))
            | {
                "name": error.name,
                "correlation_m": error.correlation_m if math.isfinite(error.correlation_m) else None,
                "correlation_assumed": error.code not in lengths_m,
            }
            for error in uncertain.errors
        ],
        "home_m": uncertain.home_m,
        "vehicle_radius_m": uncertain.radius_m,
        "sigmas": uncertain.sigmas,
        "seed": job.seed,
        "surface_sha256": job.sha256,
    }
