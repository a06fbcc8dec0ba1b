"""Whose autopilot the simulated vehicle has: its parameters, its airframe, and how its pilot is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, get_args

from telemetry.simulation.simulator.airframe.dynamics import Airframe
from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS, Parameters, Spec
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.autopilot.px4.px4_parameters import PX4_SPECS
from telemetry.simulation.simulator.neu_frame import NeuFrame

Make = Literal["ardupilot", "px4"]
MAKES: tuple[Make, ...] = get_args(Make)
PX4_AIRFRAME = Airframe(max_tilt_rad=0.7854, drag_per_s=1.0, drag_per_m=0.0)
"""That of PX4's own simulation: 1 kg, drag in proportion to airspeed."""


@dataclass(frozen=True, slots=True)
class Beginning:
    """What a pilot is made of besides its place and its parameters."""

    boot_s: float
    speedup: float
    seed: int
    receiver_is_coarse: bool
    """Its errors are metres: PX4 then moves home in flight."""


class MakePilot(Protocol):
    def __call__(self, frame: NeuFrame, parameters: Parameters, beginning: Beginning) -> Autopilot | Px4Pilot: ...


@dataclass(frozen=True, slots=True)
class Personality:
    make: Make
    specs: Mapping[str, Spec]
    capacity: str
    """The parameter that holds the battery's, in mAh."""
    system_id: str
    """The parameter that holds the vehicle's number on MAVLink."""
    airframe: Airframe
    pilot: MakePilot

    def parameters(self, **changed: float) -> Parameters:
        return Parameters(self.specs, **changed)


def _ardupilot(frame: NeuFrame, parameters: Parameters, beginning: Beginning) -> Autopilot:
    return Autopilot(frame, parameters, boot_s=beginning.boot_s, speedup=beginning.speedup)


def _px4(frame: NeuFrame, parameters: Parameters, beginning: Beginning) -> Px4Pilot:
    return Px4Pilot(
        frame,
        parameters,
        boot_s=beginning.boot_s,
        speedup=beginning.speedup,
        seed=beginning.seed,
        home_moves=beginning.receiver_is_coarse,
    )


PERSONALITIES: dict[Make, Personality] = {
    "ardupilot": Personality("ardupilot", SPECS, "BATT_CAPACITY", "MAV_SYSID", Airframe(), _ardupilot),
    "px4": Personality("px4", PX4_SPECS, "BAT1_CAPACITY", "MAV_SYS_ID", PX4_AIRFRAME, _px4),
}
