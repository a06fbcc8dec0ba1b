"""Seeded missions flown by the simulated vehicle over real terrain: flown without contact, and how close to the plan.

RTK, 3 m/s of wind, WPNAV_RADIUS 0.5 m as in the recorded flights of the real autopilot (it cuts corners by less than
that), many times as fast as in reality. What is judged is where the vehicle truly was.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from planning.basics.plan_model import Poi, VehicleProfile
from planning.errors import PlanningError
from planning.following.figures import TrackFigures, judge
from planning.following.reference import reference_line
from planning.following.surface_distance import SurfaceDistance
from planning.following.track import Track
from planning.missions.vehicle_profile import load_profile, path_params
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm
from telemetry.errors import TelemetryError
from telemetry.flight.fly import FlyOptions, FlyResult, fly
from telemetry.flight.preflight.prepare import Prepared
from telemetry.link.answering import Answering, OperatorRight
from telemetry.link.link import Link, open_link
from telemetry.simulation.simulator.airframe.gnss import RECEIVERS
from telemetry.simulation.simulator.run import SimOptions, Simulator, flying
from telemetry.topics.messages import FlightStatus, Topic, VehicleText
from telemetry.topics.requests import Operator
from telemetry.topics.vehicle import VehicleState
from tests.conftest import ROOT
from tests.telemetry.own_time import run
from tests.telemetry.small_bus import SmallBus

TERRAINS = ("coromandel/coromandel_dsm_050.tif", "campus/dsm.tif")
MISSIONS, POINTS, MARGIN_M = 20, 4, 30.0
SPEEDUP, WIND_M_S, RETURN_MARGIN_M = 12.0, 3.0, 5.0
ALLOWED_P95_M = 0.3
P95_PER_SIGMA = 2.448
"""95 % of horizontal errors of one sigma per axis are within it."""


@dataclass(frozen=True, slots=True)
class Flown:
    """One mission: planned, flown, judged by the truth."""

    terrain: str
    seed: int
    certified_m: float
    position_error_m: float
    completed: bool
    contact: bool
    figures: TrackFigures | None
    text: str

    @property
    def good(self) -> bool:
        near = self.figures.nearest if self.figures else None
        return (
            self.completed
            and not self.contact
            and self.figures is not None
            and self.figures.cross_track.p95_m <= allowed_p95_m()
            and near is not None
            and near.distance_m >= self.certified_m - self.position_error_m
        )


def allowed_p95_m() -> float:
    return ALLOWED_P95_M + P95_PER_SIGMA * RECEIVERS["rtk"].horizontal_m


def main() -> None:
    folder = ROOT.parent / "shared" / "data" / "dsm"
    if not folder.is_dir():
        print("no recorded terrain: nothing was flown")
        return
    flown = [fly_seed(folder / TERRAINS[seed % len(TERRAINS)], seed) for seed in range(MISSIONS)]
    for one in flown:
        print(_line(one))
    print(
        f"{sum(f.completed for f in flown)} of {len(flown)} completed, {sum(f.contact for f in flown)} contacts,"
        f" {sum(f.good for f in flown)} within all limits"
    )


def _line(flown: Flown) -> str:
    figures = flown.figures
    if figures is None or figures.nearest is None:
        return f"{flown.terrain} {flown.seed}: {flown.text}"
    return (
        f"{flown.terrain} {flown.seed}: {'good' if flown.good else 'NOT GOOD'}, cross-track p95"
        f" {figures.cross_track.p95_m:.2f} m (allowed {allowed_p95_m():.2f}), distance"
        f" {figures.nearest.distance_m:.2f} m (certified {flown.certified_m:.2f} - {flown.position_error_m:.2f}),"
        f" {figures.flight_s:.0f} s flown, {figures.predicted_s or math.nan:.0f} s predicted"
    )


def fly_seed(model: Path, seed: int) -> Flown:
    """Plan a certified mission from this seed and fly it."""
    dsm = read_dsm(model)
    plan = certified_plan(dsm, seed)
    return run(lambda: _flown(model, dsm, plan, seed))


def certified_plan(dsm: Dsm, seed: int) -> Plan:
    """Random points on known terrain until a plan over them is certified, with the return height that it needs."""
    rng = np.random.default_rng(seed)
    profile = load_profile("mapper-rtk")
    while True:
        pois = _points(dsm, rng)
        try:
            plan = _plan(dsm, pois, profile)
            needed_m = plan.certificate.rtl_height_needed_m
            if not plan.certificate.certified and math.isfinite(needed_m):
                plan = _plan(dsm, pois, replace(profile, rtl_height_m=math.ceil(needed_m) + RETURN_MARGIN_M))
        except PlanningError:
            continue
        if plan.certificate.certified:
            return plan


def _plan(dsm: Dsm, pois: tuple[Poi, ...], profile: VehicleProfile) -> Plan:
    return plan_mission(dsm, PlanRequest(pois=pois, profile=profile, path=path_params(profile)))


def _points(dsm: Dsm, rng: np.random.Generator) -> tuple[Poi, ...]:
    (west, south, east, north), res_m = dsm.bounds_m, dsm.resolution_m
    low, high = (west + MARGIN_M, south + MARGIN_M), (east - MARGIN_M, north - MARGIN_M)
    # In the middle of cells: the model's ground is a staircase, and who starts on the edge of a step stumbles over it.
    corner = np.array([west, north])
    xy_m = corner + (np.floor((rng.uniform(low, high, (POINTS, 2)) - corner) / res_m) + 0.5) * res_m
    places = dsm.lat_lon_from_xy(xy_m)
    return tuple(Poi(float(lat), float(lon), f"P{k}") for k, (lat, lon) in enumerate(places, start=1))


async def _flown(model: Path, dsm: Dsm, plan: Plan, seed: int) -> Flown:
    home, profile = plan.mission.home, plan.request.profile
    options = SimOptions(
        home.lat_deg,
        home.lon_deg,
        home.alt_dsm_m,
        link="tcpin:127.0.0.1:0",
        speedup=SPEEDUP,
        seed=seed,
        gnss="rtk",
        wind_m_s=WIND_M_S,
        dsm=model,
        boot_s=1.0,
        parameters=(("RTL_ALT", 100 * profile.rtl_height_m), ("WPNAV_RADIUS", 50.0)),
    )
    bus = SmallBus()
    result, text = None, ""
    async with flying(options) as simulator, open_link(bus.publish) as link:
        truth = _Truth(simulator)
        try:
            result = await _fly(link, bus, simulator, plan, dsm)
            text = result.text
        except TelemetryError as error:
            text = str(error)
    contact = any(isinstance(m, VehicleText) and "Crash" in m.text for t, m in bus.published if t == Topic.TEXT)
    figures = _judged(result, truth, dsm, profile) if result else None
    return Flown(
        terrain=model.parent.name,
        seed=seed,
        certified_m=plan.certificate.min_distance_m,
        position_error_m=profile.position_error_m,
        completed=result is not None and result.completed,
        contact=contact,
        figures=figures,
        text=text,
    )


class _Truth:
    """Where the vehicle truly is, every 20 ms of simulated time."""

    def __init__(self, simulator: Simulator) -> None:
        self.rows: list[tuple[float, float, float, float]] = []
        vehicle, advance = simulator.vehicle, simulator.vehicle.advance

        def advance_and_note(seconds: float) -> None:
            advance(seconds)
            self.rows.append((vehicle.now_s, *vehicle.frame.geodetic_from_neu(vehicle.truth.p_neu)))

        vehicle.advance = advance_and_note  # type: ignore[method-assign]


class _Client:
    """The link without a bus in between."""

    def __init__(self, link: Link) -> None:
        self._answering = Answering(link, OperatorRight())

    async def call(self, request: Any) -> Any:
        return await self._answering.answer(request)


class _Quiet:
    def tell(self, text: str) -> None:
        if "-v" in sys.argv:
            print(f"  {text}")

    def on_start(self, prepared: Prepared) -> None: ...

    def on_refused(self) -> None:
        pass

    def on_state(self, state: VehicleState, flight: FlightStatus) -> None: ...


async def _fly(link: Link, bus: SmallBus, simulator: Simulator, plan: Plan, dsm: Dsm) -> FlyResult:
    request = plan.request
    options = FlyOptions(
        address=simulator.address.replace("tcpin", "tcp"),
        operator=Operator("bench", 1),
        profile=request.profile,
        clearance=request.clearance(),
        dsm=dsm,
    )
    return await fly(_Client(link), bus, plan.mission, options, _Quiet())


def _judged(result: FlyResult, truth: _Truth, dsm: Dsm, profile: VehicleProfile) -> TrackFigures | None:
    """Against the mission as flown. The simulated vehicle's heights are the surface model's."""
    surface = SurfaceDistance(dsm)
    rows = np.array(truth.rows)
    xyz_m = np.column_stack([dsm.xy_from_lat_lon(rows[:, 1:3]), rows[:, 3]])
    reference = reference_line(result.mission, surface.dsm, profile)
    return judge(reference, Track(rows[:, 0], xyz_m), surface).figures


if __name__ == "__main__":
    main()
