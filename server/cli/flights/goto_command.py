"""``hedgehop goto``: one guided command, certified over the surface model from where the vehicle really is, then flown.

Ctrl+C on the way makes the vehicle hold; a second one leaves it to itself.
"""

from __future__ import annotations

import asyncio
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import typer
from pydantic import ValidationError
from typer import Argument, Option

from planning.errors import ParameterError
from planning.fence.fence_model import RallyPoint
from planning.formats.fence_items import fence_of, rally_of
from planning.guided.guided_model import GoTo, GuidedWay, Look, Orbit, Rally, TakeOff, ToHome, Wish
from planning.missions.vehicle_profile import load_profile, path_params
from planning.planner.request import PlanRequest, check_demands
from planning.terrain.dsm import Dsm
from server.cli.flights.goto_station import goto_by_station
from server.cli.flights.station_session import station_runs
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.output import answer, end_progress, progress, say, say_notes
from server.cli.shared.own_nodes import OPERATOR, Station, own_nodes
from server.cli.shared.terrain_given import OpenedModel, open_model
from server.schemas import WayBody
from server.work.clocks import StepTimer
from telemetry.errors import NotAllowedError, TelemetryError
from telemetry.flight.certified_way import Flown, judged_way, nearest_rally, part_for, way_json, way_request, way_words
from telemetry.flight.home_height import home_off_m
from telemetry.flight.home_watch import home_of
from telemetry.flight.preflight.parameters import NAMES
from telemetry.flight.preflight.prepare import connect
from telemetry.flight.watch import Watch, watching
from telemetry.mavlink.address import parse_addresses
from telemetry.mavlink.believing import is_in_the_air
from telemetry.mavlink.items import mission_items
from telemetry.topics.messages import FlightStatus
from telemetry.topics.requests import DownloadPlaces, Pause, ReadParameters
from telemetry.topics.vehicle import VehicleState

Action = Literal["take-off", "to", "height", "look", "orbit", "home", "rally"]
AT_PLACE = ("to", "look", "orbit")
POSITION_S, LOOK_S = 30.0, 1.0
STATION = "station"
NOT_SEEN = "no station runs: what sensors see does not count."
SEEN_THERE = f"a station runs here: what its sensors have seen does not count. As LINK, {STATION} asks it."
LEFT = "nobody watches the vehicle when this command ends: its own failsafes decide what it does without a link."


@dataclass(frozen=True, slots=True)
class GotoOptions:
    """How the way is flown."""

    PANEL: ClassVar = "Way"
    height_m: Annotated[float, Option(help="Above the surface at the place; for take-off and home above home.")] = 10.0
    radius_m: Annotated[float, Option(help="Of an orbit.")] = 20.0
    laps: Annotated[int, Option(help="Of an orbit.")] = 1
    counter_clockwise: Annotated[bool, Option("--counter-clockwise", help="As seen from above.")] = False
    speed_m_s: Annotated[float | None, Option(help="Over ground; default: the profile's mean speed.")] = None


@command
def goto(
    link: Annotated[
        str,
        Argument(
            metavar="LINK|station",
            help="Connection to the vehicle: udpin:0.0.0.0:14550, tcp:10.0.0.7:5760; several with commas. station: the"
            " ground station that runs on this computer holds it, and judges by what its sensors have seen.",
        ),
    ],
    action: Annotated[
        Action,
        Argument(
            metavar="take-off|to|height|look|orbit|home|rally",
            help="What is wanted; home and rally end with a landing.",
        ),
    ],
    place: Annotated[str | None, Argument(metavar="LAT,LON", help="For to, look and orbit.")] = None,
    *,
    dsm: Annotated[
        Path | None, Option(metavar="FILE", help="Surface model that is flown over: GeoTIFF or ESRI ASCII grid.")
    ] = None,
    vehicle: o.StationVehicle = None,
    check: Annotated[bool, Option("--check", help="Judge the way and say it; do not fly it.")] = False,
    accept_return: Annotated[
        bool, Option("--accept-return", help="Fly although the vehicle's own return from the way would not be clear.")
    ] = False,
    home_on_ground: Annotated[
        bool, Option("--home-on-ground", help="Home lies on the model's ground: nobody has moved it in this flight.")
    ] = False,
    data_dir: o.Keys = None,
    as_json: o.AsJson = False,
    wanted: GotoOptions,
    given: Annotated[o.PlannedVehicle, Without("max_items")],
    demands: Annotated[o.PlannedClearance, Without("flown_as")],
    how: Annotated[o.ModelOptions, Without("max_hole_m2", "remove_spikes")],
) -> None:
    """Certify one way over the surface model from where the vehicle is, and fly it in GUIDED.

    It is raised as far as it must be, or refused with where and by how much. Over a LINK of its own it knows neither
    what sensors see nor whether home was moved since the take-off: a receiver with fixed RTK tells, else
    --home-on-ground says so. The station knows both; model and vehicle are then those of its open plan.
    """
    where = _place(action, place)
    if link.strip().lower() == STATION:
        _refuse_own(dsm, given, demands, how, home_on_ground=home_on_ground)
        body = _body(action, where, wanted)
        raise typer.Exit(
            goto_by_station(data_dir, vehicle, body, may_fly=not check, accepts=accept_return, as_json=as_json)
        )
    parse_addresses(link)
    if vehicle is not None:
        raise ParameterError(
            "A link leads to one vehicle.", where="--vehicle", advice=f"Leave it out, or name {STATION}."
        )
    if dsm is None:
        raise ParameterError(
            "A surface model is needed.", where="--dsm", advice=f"Name its file, or {STATION} as LINK."
        )
    say_notes(SEEN_THERE if station_runs(data_dir) else NOT_SEEN)
    wish = _wish(action, where, wanted)
    profile = replace(load_profile(given.profile), **o.of_vehicle(given, demands))
    request = PlanRequest(
        pois=(),
        profile=profile,
        path=path_params(profile),
        required_clearance_m=demands.required_clearance_m,
        max_height_above_ground_m=demands.max_height_above_ground_m,
        way="guided",
    )
    check_demands(request)
    model = open_model(dsm, StepTimer(progress), how)
    speed_m_s = profile.mean_speed_m_s if wanted.speed_m_s is None else wanted.speed_m_s
    flier = _Flier(link, wish, request, model, speed_m_s, data_dir, may_fly=not check, accepts=accept_return)
    flier.home_on_ground = home_on_ground
    way, flight = asyncio.run(flier.run())
    flown = flight is not None and flight.phase in ("paused", "landed") and not flier.was_held
    text = way_words(way) if flight is None else (flight.hint or way_words(way))
    lines = [("CERTIFIED: " if way.problem is None else "NOT CERTIFIED: ") + way_words(way)]
    lines += [f"  - {reason.text}" for reason in way.certificate.reasons]
    answer({"action": action, "flown": flown, "text": text, **way_json(way)}, lines, as_json=as_json)
    raise typer.Exit(DONE if flown or (check and way.problem is None) else FAILED)


def _refuse_own(
    dsm: Path | None,
    given: o.PlannedVehicle,
    demands: o.PlannedClearance,
    how: o.ModelOptions,
    *,
    home_on_ground: bool,
) -> None:
    """Of options that the station answers itself. Raises ParameterError."""
    named = [
        name
        for name, is_given in (
            ("--dsm", dsm is not None),
            ("--home-on-ground", home_on_ground),
            ("those of the vehicle", given != o.PlannedVehicle()),
            ("those of clearance", demands != o.PlannedClearance()),
            ("those of the surface model", how != o.ModelOptions()),
        )
        if is_given
    ]
    if named:
        what = f"The station judges by its open plan: {', '.join(named)} would not count."
        raise ParameterError(what, where=STATION, advice="Leave them out, or change the plan in the console.")


def _body(action: Action, place: tuple[float, float] | None, wanted: GotoOptions) -> WayBody:
    """Raises ParameterError."""
    asked: dict[str, Any] = {
        "action": "take_off" if action == "take-off" else action,
        "place": None if place is None else {"lat_deg": place[0], "lon_deg": place[1]},
        "height_m": wanted.height_m,
        "radius_m": wanted.radius_m,
        "laps": wanted.laps,
        "clockwise": not wanted.counter_clockwise,
        "speed_m_s": wanted.speed_m_s,
    }
    try:
        return WayBody.model_validate(asked)
    except ValidationError as error:
        first = error.errors()[0]
        where = "--" + str(first["loc"][0]).replace("_", "-")
        raise ParameterError(f"{first['msg']}.", where=where, advice="Give another value.") from None


def _place(action: Action, text: str | None) -> tuple[float, float] | None:
    if (text is not None) != (action in AT_PLACE):
        what = f"{action} needs a place." if text is None else f"{action} takes no place."
        raise ParameterError(what, where="LAT,LON", advice="Give one for to, look and orbit only.")
    return o.parse_place(text, "LAT,LON")


def _wish(action: Action, place: tuple[float, float] | None, wanted: GotoOptions) -> Wish:
    """The rally point of ``rally`` is not known yet: any stands for it."""
    if action == "take-off":
        return TakeOff(wanted.height_m)
    if action == "home":
        return ToHome(wanted.height_m)
    if action == "rally":
        return Rally(RallyPoint(0.0, 0.0, 0.0), wanted.height_m)
    if place is None:
        return GoTo(wanted.height_m)
    if action == "look":
        return Look(place)
    if action == "to":
        return GoTo(wanted.height_m, place)
    return Orbit(place, wanted.radius_m, wanted.height_m, wanted.laps, clockwise=not wanted.counter_clockwise)


class _Flier:
    """One way, with a link node of its own."""

    def __init__(
        self,
        link: str,
        wish: Wish,
        request: PlanRequest,
        model: OpenedModel,
        speed_m_s: float,
        data_dir: Path | None,
        *,
        may_fly: bool,
        accepts: bool,
    ) -> None:
        self._link, self._wish, self._request, self._model = link, wish, request, model
        self._speed_m_s, self._data_dir, self._may_fly, self._accepts = speed_m_s, data_dir, may_fly, accepts
        self._pressed = asyncio.Event()
        self.was_held = self.home_on_ground = False
        self._sets_out = False

    async def run(self) -> tuple[GuidedWay, FlightStatus | None]:
        """The way, and how it was flown; None: it was not."""
        loop, task = asyncio.get_running_loop(), asyncio.current_task()
        assert task is not None
        loop.add_signal_handler(signal.SIGINT, lambda: self._on_interrupt(task))
        try:
            async with own_nodes(recorder=False, data_dir=self._data_dir) as station, watching(station.bus) as watch:
                return await self._fly(station, watch)
        except asyncio.CancelledError:
            raise typer.Abort from None
        finally:
            loop.remove_signal_handler(signal.SIGINT)

    def _on_interrupt(self, task: asyncio.Task[Any]) -> None:
        if not self._sets_out or self._pressed.is_set():
            task.cancel()
        else:
            end_progress()
            say("The vehicle is told to hold. Ctrl+C again leaves it to itself.")
            self._pressed.set()

    async def _fly(self, station: Station, watch: Watch) -> tuple[GuidedWay, FlightStatus | None]:
        state = await connect(station.link, watch, self._link, OPERATOR, say)
        state = await watch.until(lambda seen: _placed(seen.vehicle), timeout_s=POSITION_S) or state
        flown = await self._flown(station, state)
        state = watch.vehicle or state
        way = await asyncio.to_thread(self._judged, state, flown)
        end_progress()
        if not self._may_fly or way.problem == "way" or (way.problem == "return" and not self._accepts):
            if way.problem == "return":
                say_notes("The way itself is clear. --accept-return flies it all the same.")
            return way, None
        say(way_words(way))
        say_notes(LEFT)
        asked_utc_s = time.time()
        most_m_s = self._request.profile.max_speed_m_s
        self._sets_out = True
        request = way_request(OPERATOR, way, self._wish, home_of(state), speed_m_s=self._speed_m_s, most_m_s=most_m_s)
        await station.link.call(request)
        return way, await self._followed(station, watch, asked_utc_s)

    async def _flown(self, station: Station, state: VehicleState) -> Flown:
        """The vehicle's own settings, and its fence and rally points, which the way is held against."""
        firmware = "px4" if state.autopilot == "px4" else "ardupilot"
        parameters = await station.link.call(ReadParameters(NAMES[firmware]))
        fence_items = mission_items(await station.link.call(DownloadPlaces(OPERATOR, "fence")))
        points = rally_of(mission_items(await station.link.call(DownloadPlaces(OPERATOR, "rally"))), "rally points")
        warnings: list[str] = []
        fence = fence_of(fence_items, "the fence on board", warnings)
        say_notes(*warnings)
        if isinstance(self._wish, Rally):
            self._wish = replace(self._wish, point=nearest_rally(points, state))
        return Flown(self._request.profile, self._request.clearance(), parameters, fence, points)

    def _judged(self, state: VehicleState, flown: Flown) -> GuidedWay:
        if is_in_the_air(state) and not self.home_on_ground:
            try:
                home_off_m(self._model.model, None, state)
            except NotAllowedError as error:
                advice = f"{error.advice} Or say that it has not been moved: --home-on-ground."
                raise NotAllowedError(error.what, where=error.where, advice=advice) from None
        part = self._part(state, flown)
        return judged_way(part, None, state, self._wish, flown, speed_m_s=self._speed_m_s, now_s=time.monotonic())

    def _part(self, state: VehicleState, flown: Flown) -> Dsm:
        part = part_for(self._model.model, state, self._wish, flown.rally, flown.clearance.required_clearance_m)
        end_progress()
        self._model.say_part(part)
        return part

    async def _followed(self, station: Station, watch: Watch, asked_utc_s: float) -> FlightStatus:
        """To its end. A lost link is waited out: the vehicle holds by itself meanwhile."""
        is_return = isinstance(self._wish, ToHome | Rally)
        while True:
            ended = await watch.until(
                lambda seen: _ended(seen.flight, asked_utc_s, lands=is_return or None), timeout_s=LOOK_S
            )
            if ended is not None:
                return ended
            _tell(watch)
            if self._pressed.is_set() and not self.was_held:
                try:
                    await station.link.call(Pause(OPERATOR))
                    self.was_held = True
                except TelemetryError as error:
                    say(f"It was not obeyed and is commanded again: {error}")


def _ended(flight: FlightStatus, since_utc_s: float, *, lands: bool | None) -> FlightStatus | None:
    if flight.since_utc_s is None or flight.since_utc_s < since_utc_s:
        return None  # of what was flown before
    return flight if flight.phase in ("landed", "interrupted") or (flight.phase == "paused" and not lands) else None


def _placed(state: VehicleState | None) -> VehicleState | None:
    """Once it tells where it is and, in flight, where its home is and how high."""
    if state is None or None in (state.lat_deg, state.lon_deg, state.alt_rel_home_m):
        return None
    return state if not state.armed or home_of(state) is not None else None


def _tell(watch: Watch) -> None:
    state, flight = watch.vehicle, watch.flight
    if state is None:
        return
    parts = [flight.phase.replace("_", " "), f"{state.alt_rel_home_m or 0.0:.1f} m above home"]
    parts += [f"{state.ground_speed_m_s:.1f} m/s"] if state.ground_speed_m_s is not None else []
    progress(", ".join(parts), None)
