"""A link that answers as a vehicle does, for the order of things in a flight from the command line."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from planning.basics.plan_model import VehicleProfile
from planning.certificate.certificate_model import ClearanceParams
from telemetry.flight.fly import FlyOptions, FlyResult, fly
from telemetry.flight.preflight.prepare import Prepared
from telemetry.topics.messages import Candidate, FlightStatus, LinkStatus, Topic
from telemetry.topics.onboard_lists import OnboardMission, UploadReport
from telemetry.topics.requests import Connect, Operator, ReadParameters, StartAuto, StartGuided, Upload
from telemetry.topics.vehicle import VehicleState
from tests.server.flight_logs import PLAIN, ROUTE, mission
from tests.telemetry.own_time import run
from tests.telemetry.small_bus import SmallBus
from tests.telemetry.test_preflight import state_at

ADDRESS = "tcp:127.0.0.1:5760"
OPTIONS = FlyOptions(
    address=ADDRESS,
    operator=Operator("test", 1),
    profile=VehicleProfile("quad", position_error_m=1.0, rtl_height_m=30.0),
    clearance=ClearanceParams(2.0, vehicle_radius_m=0.35, position_error_m=1.0, rtl_height_m=30.0),
    dsm=PLAIN,
    name="Orchard",
    connect_s=1.0,
    ready_s=1.0,
)
PLANNED = mission(ROUTE)
VEHICLE = Candidate("x", ADDRESS, "127.0.0.1:5760", 1, 1, "ardupilot", 2)


class Pilot:
    """Plays the link node: keeps what it is asked, answers as told, and flies as soon as it is started."""

    def __init__(self, bus: SmallBus, state: VehicleState | None = None) -> None:
        self.bus, self.state = bus, replace(state or state_at(), firmware_version="4.7.0")
        self.asked: list[Any] = []
        self.differences: tuple[str, ...] = ()
        self.refusals: list[Exception] = []
        self.end = FlightStatus(phase="landed", way="auto", targets=5)
        self.tells = True

    async def call(self, request: Any) -> Any:
        self.asked.append(request)
        if isinstance(request, Connect):
            self._tell()
        elif isinstance(request, Upload):
            onboard = OnboardMission(request.items, None, None, None, f"digest {len(self.asked)}")
            return UploadReport(not self.differences, onboard, (), self.differences, 0.1)
        elif isinstance(request, ReadParameters):
            return {"RTL_ALT": 3000.0}
        elif isinstance(request, StartAuto | StartGuided):
            if self.refusals:
                raise self.refusals.pop(0)
            self.bus.publish(Topic.FLIGHT, replace(self.end, since_utc_s=time.time()))
        return None

    def _tell(self) -> None:
        if self.tells:
            self.bus.publish(Topic.VEHICLE, self.state)
            self.bus.publish(Topic.LINK, LinkStatus(0.0, adopted=VEHICLE, state="live"))

    def of(self, kind: type) -> list[Any]:
        return [request for request in self.asked if isinstance(request, kind)]


class Heard:
    """Who is told; keeps it."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.prepared: Prepared | None = None
        self.states = 0
        self.refused = False

    def tell(self, text: str) -> None:
        self.lines.append(text)

    def on_start(self, prepared: Prepared) -> None:
        self.prepared = prepared

    def on_refused(self) -> None:
        self.refused = True

    def on_state(self, state: VehicleState, flight: FlightStatus) -> None:
        self.states += 1


def flown(pilot: Pilot, options: FlyOptions = OPTIONS, flight=PLANNED) -> tuple[FlyResult, Heard]:
    heard = Heard()
    return run(lambda: fly(pilot, pilot.bus, flight, options, heard)), heard
