"""Who flies the vehicle in a scenario: the navigation script, or the mission on board."""

from __future__ import annotations

from typing import Literal, Protocol

from telemetry.errors import TelemetryError
from telemetry.flight.guided.guided import GuidedScript
from telemetry.mavlink.actions import Action, Done, Failed, Message
from telemetry.mavlink.upload import MissionUpload
from telemetry.simulation.scenarios.stage.virtual_link import VEHICLE, Wire
from telemetry.topics.messages import FlightStatus
from telemetry.topics.onboard_lists import Item, OnboardMission, UploadReport
from telemetry.topics.requests import StartGuided
from telemetry.topics.vehicle import VehicleState


class ScenarioPilot(Protocol):
    """Begins on the ground with a vehicle that is ready, and is over when it has landed."""

    @property
    def is_over(self) -> bool: ...

    @property
    def status(self) -> FlightStatus: ...

    def on_message(self, message: Message) -> None: ...
    def on_slice(self, state: VehicleState, *, is_new: bool) -> None: ...


class ScriptPilot:
    """Hands over targets one at a time, as the console does in GUIDED (Melita 2020)."""

    def __init__(self, wire: Wire, request: StartGuided) -> None:
        assert wire.state is not None
        self._wire = wire
        self._script = GuidedScript(request, wire.state, firmware="ardupilot", target=VEHICLE)
        self._do(self._script.start(wire.now_s))

    @property
    def is_over(self) -> bool:
        return self._script.is_over

    @property
    def status(self) -> FlightStatus:
        return self._script.status()

    def on_message(self, message: Message) -> None:
        self._do(self._script.on_message(message, self._wire.now_s))

    def on_slice(self, state: VehicleState, *, is_new: bool) -> None:
        if is_new:
            self._do(self._script.on_state(state, self._wire.now_s))
        self._do(self._script.on_tick(self._wire.now_s))

    def _do(self, actions: list[Action]) -> None:
        _raise_failures(self._wire.perform(actions))


class MissionPilot:
    """Uploads a mission, reads it back, arms and starts it in AUTO; the rest is the vehicle's business."""

    def __init__(self, wire: Wire, items: tuple[Item, ...]) -> None:
        self._wire = wire
        self.onboard: OnboardMission | None = None
        self._phase: Literal["uploading", "starting", "flying", "over"] = "uploading"
        frame = wire.vehicle.frame
        home = (frame.lat_deg, frame.lon_deg, frame.alt_amsl_m)
        self._upload = MissionUpload(items, home, firmware="ardupilot", target=VEHICLE, now_s=wire.now_s)
        self._do(self._upload.start(wire.now_s))

    @property
    def is_over(self) -> bool:
        return self._phase == "over"

    @property
    def status(self) -> FlightStatus:
        return FlightStatus(way="auto", phase="flying") if self._phase == "flying" else FlightStatus()

    def on_message(self, message: Message) -> None:
        if self._phase == "uploading":
            self._do(self._upload.on_message(message, self._wire.now_s))

    def on_slice(self, state: VehicleState, *, is_new: bool) -> None:
        autopilot = self._wire.vehicle.autopilot
        if self._phase == "uploading":
            self._do(self._upload.on_tick(self._wire.now_s))
        elif self._phase == "starting":
            autopilot.set_mode("GUIDED")
            if autopilot.arm() == "accepted" and autopilot.start_mission() == "accepted":
                self._phase = "flying"
        elif not autopilot.armed:
            self._phase = "over"

    def _do(self, actions: list[Action]) -> None:
        for end in _raise_failures(self._wire.perform(actions)):
            report = end.result
            if isinstance(report, UploadReport):
                self.onboard, self._phase = report.onboard, "starting"


def _raise_failures(actions: list[Action]) -> list[Done]:
    for action in actions:
        if isinstance(action, Failed):
            raise TelemetryError(f"The simulated flight could not be begun: {action.error.what}")
    return [action for action in actions if isinstance(action, Done)]
