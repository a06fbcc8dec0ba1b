"""What a flight of a scenario begins with: ground, mission and sensors, the vehicle and its plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from planning.basics.plan_model import Mission
from planning.formats.wpl import write_wpl
from planning.terrain.dsm import Dsm
from telemetry.simulation.scenarios.stage.course import Course
from telemetry.simulation.scenarios.stage.virtual_link import T0_UTC_S
from telemetry.simulation.simulator.airframe.gnss_script import GnssEvent
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.messages import PlanRecord, Published
from telemetry.topics.obstacles import PerceptionSettings, Sensor
from telemetry.topics.vehicle import RadarKind

Tell = Callable[[str, Published, float], None]
"""Topic, message, UTC: as on the bus."""

PERCEPTION_S, ORDER_S = 0.1, 0.2
"""From measuring a frame to what it shows, and from an order to the vehicle's obeying: 0.3 s together."""
BOOT_S = 3.0


@dataclass(frozen=True, slots=True)
class Setup:
    title: str
    world: World
    seed: int
    mission: Mission
    """What is flown: in AUTO, or as targets of the navigation script where there is a course."""
    ground: Dsm
    """What is known of the ground."""
    course: Course | None = None
    sensors: tuple[Sensor, ...] = ("radar", "vision")
    radar: RadarKind = "model"
    settings: PerceptionSettings = field(default_factory=PerceptionSettings)
    avoids: bool = False
    """Only in AUTO."""
    solid: bool = True
    """Whether the vehicle crashes into what stands there, or flies through it to look at the next."""
    dark: bool = False
    gnss_script: tuple[GnssEvent, ...] = ()
    climb_m_s: float | None = None
    most_m: float | None = None
    """Stop looking after so much way; None: until it has landed."""
    most_armed_s: float | None = None
    """Stop looking so long after it armed."""
    longest_s: float = 900.0
    battery_mah: float | None = None
    """None: what the simulated vehicle has."""


def vehicle_of(setup: Setup) -> SimulatedVehicle:
    parameters = Parameters()
    if setup.climb_m_s is not None:
        parameters.set("WPNAV_SPEED_UP", 100 * setup.climb_m_s)
    if setup.battery_mah is not None:
        parameters.set("BATT_CAPACITY", setup.battery_mah)
    return SimulatedVehicle(
        setup.world.frame,
        ground=setup.world.ground,
        obstacles=setup.world if setup.solid else None,
        seed=setup.seed,
        parameters=parameters,
        boot_s=BOOT_S,
        gnss_script=setup.gnss_script,
    )


def plan_record_of(setup: Setup) -> PlanRecord:
    home = setup.mission.home
    return PlanRecord(
        t_utc_s=T0_UTC_S,
        name=setup.title,
        mission_wpl=write_wpl(setup.mission),
        digest="",
        firmware=setup.mission.firmware,
        terrain_id="",
        terrain_name=setup.title,
        terrain_sha256=setup.ground.sha256,
        home_alt_dsm_m=home.alt_dsm_m,
        vertical_datum=home.vertical_datum,
        profile_toml="",
        certificate_json="",
    )
