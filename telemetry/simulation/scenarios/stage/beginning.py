"""The vehicle and the plan that a flight begins with."""

from __future__ import annotations

from planning.formats.wpl import write_wpl
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.simulation.scenarios.stage.virtual_link import T0_UTC_S
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle
from telemetry.topics.messages import PlanRecord

BOOT_S = 3.0


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
