"""The vehicle's own settings before a low flight: what each will do on the plan, worst first."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from planning.basics.plan_model import Firmware, Home, Mission, MissionItem
from telemetry.flight.low_flight.findings import ORDER, Finding
from telemetry.flight.low_flight.low_plan import LowPlan, low_plan
from telemetry.flight.low_flight.review import review_settings
from telemetry.flight.low_flight.table import ACTIONS
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS

PLAN = LowPlan(
    highest_m=40.0,
    lowest_m=2.0,
    farthest_m=300.0,
    speed_m_s=5.0,
    commands_speed=False,
    over_terrain=False,
    return_needed_m=18.84,
)
COPTER: dict[str, float | None] = {
    "RTL_ALT": 1900.0, "RTL_ALT_TYPE": 0.0, "RTL_ALT_FINAL": 0.0, "RTL_CONE_SLOPE": 3.0, "RTL_SPEED": 500.0,
    "WPNAV_SPEED": 500.0, "WPNAV_RADIUS": 200.0, "FS_GCS_ENABLE": 1.0, "FS_THR_ENABLE": 1.0, "FS_OPTIONS": 16.0,
    "BATT_MONITOR": 4.0, "BATT_LOW_VOLT": 10.5, "BATT_LOW_MAH": 0.0, "BATT_FS_LOW_ACT": 2.0, "BATT_FS_CRT_ACT": 1.0,
    "FS_EKF_ACTION": 1.0, "FS_EKF_THRESH": 0.8, "FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ACTION": 1.0,
    "FENCE_ALT_MAX": 100.0, "FENCE_RADIUS": 500.0, "OA_TYPE": 0.0, "TERRAIN_ENABLE": 1.0,
}  # fmt: skip
PX4: dict[str, float | None] = {
    "RTL_RETURN_ALT": 30.0, "RTL_CONE_ANG": 45.0, "RTL_MIN_DIST": 10.0, "RTL_TYPE": 0.0, "RTL_LAND_DELAY": 0.0,
    "NAV_DLL_ACT": 2.0, "NAV_RCL_ACT": 2.0, "COM_LOW_BAT_ACT": 3.0, "COM_POS_LOW_ACT": 3.0, "GF_ACTION": 2.0,
    "GF_MAX_VER_DIST": 0.0, "GF_MAX_HOR_DIST": 0.0, "MPC_XY_CRUISE": 5.0, "NAV_ACC_RAD": 2.0, "NAV_MC_ALT_RAD": 0.8,
}  # fmt: skip


def found(
    firmware: Firmware, plan: LowPlan | None = PLAN, changed: Mapping[str, float | None] = MappingProxyType({})
) -> dict[str, Finding]:
    findings = review_settings({**(PX4 if firmware == "px4" else COPTER), **changed}, firmware, plan)
    assert [ORDER[f.state] for f in findings] == sorted(ORDER[f.state] for f in findings), "worst first"
    worst: dict[str, Finding] = {}
    for finding in findings:
        worst.setdefault(finding.parameter, finding)
    return worst


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_vehicle_that_is_set_right_has_nothing_to_change(firmware: Firmware) -> None:
    own = PX4 if firmware == "px4" else COPTER
    findings = found(firmware, changed={name: float(np.float32(value)) for name, value in own.items() if value})
    assert {f.parameter for f in findings.values() if f.state == "bad"} == set()
    assert all(f.better is None for f in findings.values())
    assert findings["RTL_ALT" if firmware == "ardupilot" else "RTL_RETURN_ALT"].state == "good"


@pytest.mark.fact("A19")
@pytest.mark.parametrize(
    ("changed", "name", "state", "better", "words"),
    [
        ({"RTL_ALT": 1500.0}, "RTL_ALT", "bad", 1900.0, "15 m above home, or higher if it is higher already; the way"),
        ({"RTL_ALT": None, "RTL_ALT_M": 15.0}, "RTL_ALT_M", "bad", 19.0, "needs 18.84 m"),
        ({"RTL_ALT_TYPE": 1.0}, "RTL_ALT_TYPE", "bad", 0.0, "terrain data"),
        ({"RTL_CONE_SLOPE": 1.0}, "RTL_CONE_SLOPE", "bad", 3.0, "climbs less"),
        ({"RTL_ALT_FINAL": 300.0}, "RTL_ALT_FINAL", "look", 0.0, "hovers at 3 m"),
        ({"RTL_SPEED": 0.0, "WPNAV_SPEED": 1000.0}, "RTL_SPEED", "look", 500.0, "home at 10 m/s, the plan at 5 m/s"),
        ({"WPNAV_SPEED": 1000.0}, "WPNAV_SPEED", "bad", 500.0, "flown at 10 m/s, and was planned for 5"),
        ({"WPNAV_SPEED": None, "WP_SPD": 10.0}, "WP_SPD", "bad", 5.0, "flown at 10 m/s"),
        ({"WPNAV_RADIUS": 500.0}, "WPNAV_RADIUS", "bad", 200.0, "turn 5 m before"),
        ({"FS_GCS_ENABLE": 0.0}, "FS_GCS_ENABLE", "bad", 1.0, "the flight goes on without anybody"),
        ({"FS_GCS_ENABLE": 5.0}, "FS_GCS_ENABLE", "bad", 1.0, "lands where it is"),
        ({"FS_OPTIONS": 2.0}, "FS_GCS_ENABLE", "look", None, "in a mission it goes on (FS_OPTIONS, bit 1)"),
        ({"FS_GCS_ENABLE": 42.0}, "FS_GCS_ENABLE", "look", 1.0, "not known here"),
        ({"FS_THR_ENABLE": 3.0}, "FS_THR_ENABLE", "bad", 1.0, "lands where it is"),
        ({"BATT_FS_LOW_ACT": 0.0}, "BATT_FS_LOW_ACT", "bad", 2.0, "until it is empty"),
        ({"BATT_LOW_VOLT": 0.0}, "BATT_LOW_VOLT", "bad", None, "never acts"),
        ({"BATT_MONITOR": 0.0}, "BATT_MONITOR", "bad", None, "measures no battery"),
        ({"FS_EKF_ACTION": 0.0}, "FS_EKF_ACTION", "bad", 1.0, "wrong position"),
        ({"FS_EKF_THRESH": 0.0}, "FS_EKF_THRESH", "bad", 0.8, "never noticed"),
        ({"FENCE_ENABLE": 0.0}, "FENCE_ENABLE", "look", None, "No fence on board"),
        ({"FENCE_ALT_MAX": 30.0}, "FENCE_ALT_MAX", "bad", 45.0, "reach 40.0 m above home, the fence is at 30 m"),
        ({"RTL_ALT": 12_000.0}, "FENCE_ALT_MAX", "bad", 125.0, "reach 120.0 m"),
        ({"FENCE_RADIUS": 200.0}, "FENCE_RADIUS", "bad", 305.0, "leads 300 m from home"),
        ({"FENCE_TYPE": 15.0, "FENCE_ALT_MIN": 10.0}, "FENCE_ALT_MIN", "bad", -3.0, "floor is 10 m"),
        ({"OA_TYPE": 1.0}, "OA_TYPE", "look", 0.0, "off the certified line"),
        ({"FS_GCS_ENABLE": None}, "FS_GCS_ENABLE", "look", None, "does not tell it"),
        ({"RTL_ALT": None}, "RTL_ALT", "look", None, "how high it flies home is not known"),
    ],
)
def test_arducopter(changed: dict[str, float | None], name: str, state: str, better: float | None, words: str) -> None:
    finding = found("ardupilot", changed=changed)[name]
    assert (finding.state, finding.better) == (state, better), finding
    assert words in finding.text


@pytest.mark.parametrize(
    ("changed", "name", "state", "better", "words"),
    [
        ({"RTL_RETURN_ALT": 10.0}, "RTL_RETURN_ALT", "bad", 19.0, "needs 18.84 m"),
        ({"RTL_CONE_ANG": 65.0}, "RTL_CONE_ANG", "bad", 45.0, "climbs less"),
        ({"RTL_MIN_DIST": 50.0}, "RTL_MIN_DIST", "bad", 10.0, "climbs less"),
        ({"RTL_TYPE": 2.0}, "RTL_TYPE", "look", 0.0, "as low as the plan"),
        ({"RTL_LAND_DELAY": -1.0}, "RTL_LAND_DELAY", "look", 0.0, "does not land"),
        ({"NAV_DLL_ACT": 0.0}, "NAV_DLL_ACT", "bad", 2.0, "the flight goes on"),
        ({"COM_DLL_EXCEPT": 1.0}, "NAV_DLL_ACT", "look", None, "in a mission it goes on"),
        ({"NAV_RCL_ACT": 3.0}, "NAV_RCL_ACT", "bad", 2.0, "lands where it is"),
        ({"COM_LOW_BAT_ACT": 2.0}, "COM_LOW_BAT_ACT", "bad", 3.0, "lands where it is"),
        ({"GF_ACTION": 4.0}, "GF_ACTION", "bad", 2.0, "it falls"),
        ({"GF_MAX_VER_DIST": 20.0}, "GF_MAX_VER_DIST", "bad", 45.0, "reach 40.0 m"),
        ({"GF_MAX_HOR_DIST": 100.0}, "GF_MAX_HOR_DIST", "bad", 305.0, "reach 300.0 m"),
        ({"MPC_XY_CRUISE": 8.0}, "MPC_XY_CRUISE", "bad", 5.0, "flown at 8 m/s"),
        ({"NAV_ACC_RAD": 10.0}, "NAV_ACC_RAD", "bad", 2.0, "turn 10 m before"),
        ({"NAV_MC_ALT_RAD": 3.0}, "NAV_MC_ALT_RAD", "bad", 0.8, "3 m above or below"),
        ({"MPC_XY_CRUISE": None}, "MPC_XY_CRUISE", "look", None, "not known"),
    ],
)
def test_px4(changed: dict[str, float | None], name: str, state: str, better: float | None, words: str) -> None:
    finding = found("px4", changed=changed)[name]
    assert (finding.state, finding.better) == (state, better), finding
    assert words in finding.text


def test_every_value_of_the_table_leads_to_a_better_one_that_is_not_bad() -> None:
    for firmware, actions in ACTIONS.items():
        for action in actions:
            assert action.meanings[action.better][0] != "bad", (firmware, action.name)
            for value in action.meanings:
                finding = found(firmware, changed={action.name: float(value)})[action.name]
                assert finding.better in (None, action.better)


def test_heights_above_terrain_are_never_called_good() -> None:
    over_terrain = replace(PLAN, over_terrain=True, highest_m=None, lowest_m=None)
    assert found("ardupilot", over_terrain)["TERRAIN_ENABLE"].state == "bad"
    off = found("ardupilot", over_terrain, {"TERRAIN_ENABLE": 0.0})["TERRAIN_ENABLE"]
    assert (off.state, off.better) == ("bad", 1.0)
    assert found("ardupilot", over_terrain)["FENCE_ENABLE"].state == "look"
    assert found("px4", over_terrain)["(mission)"].state == "bad"


def test_what_a_return_needs_is_unknown_without_a_model_and_impossible_over_unknown_ground() -> None:
    def at(needed_m: float | None) -> Finding:
        return found("ardupilot", replace(PLAN, return_needed_m=needed_m))["RTL_ALT"]

    assert at(None).state == "look"
    assert "without its certificate over the surface model" in at(None).text
    assert at(math.inf).state == "bad"
    assert at(math.inf).better is None
    assert at(-math.inf).state == at(0.0).state == "good"
    assert found("ardupilot", None)["RTL_ALT"].state == "look"


def test_the_simulated_vehicles_defaults_are_not_right_for_a_low_flight() -> None:
    findings = review_settings({name: spec.default for name, spec in SPECS.items()}, "ardupilot", PLAN)
    bad = {f.parameter: f.better for f in findings if f.state == "bad"}
    assert bad["RTL_ALT"] == 1900.0
    assert bad["FS_GCS_ENABLE"] == 1.0
    assert bad["BATT_FS_LOW_ACT"] == 2.0
    assert bad["WPNAV_SPEED"] == 500.0


def item(
    command: int, alt_m: float, lat_deg: float = 0.0, *, frame: int = 3, params: tuple[float, ...] = ()
) -> MissionItem:
    four = (*params, *[0.0] * (4 - len(params)))
    return MissionItem(command, frame, (four[0], four[1], four[2], four[3]), lat_deg, 0.0, alt_m)


def test_what_of_a_plan_counts() -> None:
    home = Home(0.0, 0.0, 100.0)
    mission = Mission(home, (item(22, 5.0), item(16, 30.0, 0.001), item(16, 120.0, 0.002, frame=0), item(20, 0.0)))
    plan = low_plan(mission, speed_m_s=4.0, return_needed_m=12.0)
    assert (plan.highest_m, plan.lowest_m, plan.speed_m_s, plan.return_needed_m) == (30.0, 5.0, 4.0, 12.0)
    assert 222.0 < plan.farthest_m < 224.5
    assert not plan.commands_speed
    assert not plan.over_terrain
    commanded = replace(mission, items=(item(178, 0.0, params=(1.0, 7.0)), *mission.items))
    assert (low_plan(commanded, speed_m_s=4.0).speed_m_s, low_plan(commanded, speed_m_s=4.0).commands_speed) == (
        7.0,
        True,
    )
    terrain = low_plan(replace(mission, items=(item(16, 10.0, frame=10),)), speed_m_s=4.0)
    assert (terrain.over_terrain, terrain.highest_m) == (True, None)
    nowhere = low_plan(replace(mission, home=replace(home, alt_dsm_m=math.nan)), speed_m_s=4.0)
    assert nowhere.highest_m is None
