"""What the vehicle's settings will do on a plan, worst first."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from planning.basics.plan_model import Firmware
from planning.certificate.returns import NEAR_M, SLOPE
from telemetry.flight.low_flight.findings import ORDER, Finding, VehicleSettings, unread
from telemetry.flight.low_flight.low_plan import LowPlan
from telemetry.flight.low_flight.table import (
    ACTIONS,
    CENTI,
    EKF_THRESHOLD,
    MAY_BE_MISSING,
    ROOM_M,
    WAYPOINT_HEIGHT_M,
    WAYPOINT_RADIUS_M,
    Action,
)
from telemetry.flight.preflight.parameters import NEAR_HALF_DEG, return_settings

MULTIROTORS = frozenset({2, 3, 13, 14, 15, 29, 35})
"""MAV_TYPE: quadrotor, coaxial, hexa-, octo-, tri-, dodeca- and decarotor."""
LESS_CLIMB = "Close to home the vehicle climbs less on its return than certificates take for granted."
Rule = Callable[[VehicleSettings, LowPlan | None], Iterator[Finding]]


def review_settings(
    values: Mapping[str, float | None], firmware: Firmware, plan: LowPlan | None = None
) -> tuple[Finding, ...]:
    """``values``: as read of the vehicle. Without a plan only what holds for every low flight is judged."""
    settings = VehicleSettings(values)
    found = [_action(settings, action) for action in ACTIONS[firmware]]
    found += [_return_height(settings, firmware, plan), *(f for rule in RULES[firmware] for f in rule(settings, plan))]
    return tuple(sorted((f for f in found if f is not None), key=lambda f: ORDER[f.state]))


def _action(settings: VehicleSettings, action: Action) -> Finding | None:
    held = settings.held(action.name)
    if held is None:
        return None if action.name in MAY_BE_MISSING else unread(action.name, "what happens then")
    meaning = action.meanings.get(int(held.value))
    if meaning is None:
        return held.finding("look", f"{held.value:g} is not known here. Read its help.", action.better)
    state, words = meaning
    text = f"{action.when} {words}."
    if action.goes_on is not None and held.value:
        mask, bit = action.goes_on
        if int(settings.number(mask, 0.0)) >> bit & 1:
            text = f"{action.when} {words}. But in a mission it goes on ({mask}, bit {bit})."
            state = "look" if state == "good" else state
    return held.finding(state, text, None if state == "good" or int(held.value) == action.better else action.better)


def _return_height(settings: VehicleSettings, firmware: Firmware, plan: LowPlan | None) -> Finding:
    own = return_settings(settings.values, firmware)
    if own.height_m is None:
        return unread(own.parameter, "how high it flies home")
    unit = CENTI if own.parameter == "RTL_ALT" else 1.0
    value, at = own.height_m / unit, f"It flies home {own.height_m:g} m above home, or higher if it is higher already"
    if plan is None:
        return Finding("look", own.parameter, f"{at}. Give a mission to know what it needs.", None, value)
    if plan.return_needed_m is None:
        text = f"{at}. What this plan needs is not known without its certificate over the surface model."
        return Finding("look", own.parameter, text, None, value)
    if plan.return_needed_m <= 0.0:
        text = f"{at}. From everywhere on this plan it is high enough itself."
        return Finding("good", own.parameter, text, None, value)
    if not math.isfinite(plan.return_needed_m):
        text = f"{at}. No height was found at which the way home is known to be clear: see the certificate."
        return Finding("bad", own.parameter, text, None, value)
    needed = f"the way home of this plan needs {math.ceil(100 * plan.return_needed_m) / 100:.2f} m"
    if own.height_m < plan.return_needed_m:
        better = math.ceil(plan.return_needed_m) / unit
        return Finding("bad", own.parameter, f"{at}; {needed}.", better, value)
    return Finding("good", own.parameter, f"{at}; {needed}.", None, value)


def _copter_return(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    cone = settings.held("RTL_CONE_SLOPE")
    if cone is not None and not return_settings(settings.values, "ardupilot").steep_enough:
        yield cone.finding("bad", LESS_CLIMB, SLOPE)
    final = settings.held("RTL_ALT_FINAL_M", ("RTL_ALT_FINAL", CENTI))
    if final is not None and final.value > 0:
        text = f"Back home the vehicle does not land: it hovers at {final.metres:g} m until the battery is low."
        yield final.finding("look", text, 0.0)
    speed = settings.held("RTL_SPEED_MS", ("RTL_SPEED", CENTI))
    cruise = settings.held("WP_SPD", ("WPNAV_SPEED", CENTI))
    if plan is not None and speed is not None and cruise is not None:
        flown = speed.metres or cruise.metres
        if flown > plan.speed_m_s + 0.05:
            text = f"It flies home at {flown:g} m/s, the plan at {plan.speed_m_s:g} m/s: it brakes later there."
            yield speed.finding("look", text, speed.own(plan.speed_m_s))


def _copter_speed(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    yield from _speed(settings, plan, "WP_SPD", ("WPNAV_SPEED", CENTI))
    yield from _radius(settings, WAYPOINT_RADIUS_M, "WP_RADIUS_M", ("WPNAV_RADIUS", CENTI))


def _px4_speed(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    yield from _speed(settings, plan, "MPC_XY_CRUISE")
    yield from _radius(settings, WAYPOINT_RADIUS_M, "NAV_ACC_RAD")
    height = settings.held("NAV_MC_ALT_RAD")
    if height is not None and height.value > WAYPOINT_HEIGHT_M:
        text = f"It counts a place as reached {height.value:g} m above or below it, and turns to the next."
        yield height.finding("bad", text, WAYPOINT_HEIGHT_M)


def _speed(settings: VehicleSettings, plan: LowPlan | None, *names: str | tuple[str, float]) -> Iterator[Finding]:
    held = settings.held(*names)
    if held is None:
        yield unread(str(names[0]), "how fast it flies to waypoints")
    elif plan is None:
        yield held.finding("look", f"It flies to waypoints at {held.metres:g} m/s, unless the mission says otherwise.")
    elif plan.commands_speed:
        yield held.finding("good", f"The plan itself commands at most {plan.speed_m_s:g} m/s.")
    elif held.metres > plan.speed_m_s + 0.05:
        text = (
            f"The plan commands no speed: it is flown at {held.metres:g} m/s, and was planned for {plan.speed_m_s:g}."
        )
        yield held.finding("bad", text, held.own(plan.speed_m_s))
    else:
        yield held.finding("good", f"It flies to waypoints at {held.metres:g} m/s, no faster than planned.")


def _radius(settings: VehicleSettings, largest_m: float, *names: str | tuple[str, float]) -> Iterator[Finding]:
    held = settings.held(*names)
    if held is None:
        yield unread(str(names[0]), "how far before a waypoint it turns")
    elif held.metres > largest_m:
        text = f"It may turn {held.metres:g} m before a waypoint. Certificates count on corners as measured with "
        yield held.finding("bad", f"{text}{largest_m:g} m.", held.own(largest_m))
    else:
        yield held.finding("good", f"It turns at most {held.metres:g} m before a waypoint.")


def _copter_terrain(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    if plan is None or not plan.over_terrain:
        return
    spacing_m = settings.number("TERRAIN_SPACING", 100.0)
    held = settings.held("TERRAIN_ENABLE")
    if held is not None and held.value == 0:
        yield held.finding("bad", "The plan has heights above terrain, and the vehicle uses no terrain data.", 1.0)
        return
    name = "TERRAIN_SPACING" if held is None else held.name
    text = f"Heights above terrain are flown by the vehicle's own data, a height every {spacing_m:g} m: no certificate."
    yield Finding("bad", name, f"{text} Plan above home or sea level instead.")


def _copter_battery(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    monitor = settings.held("BATT_MONITOR")
    if monitor is None or monitor.value == 0:
        yield Finding("bad", "BATT_MONITOR", "The vehicle measures no battery: it never knows that it is low.")
        return
    if settings.number("BATT_LOW_VOLT", 0.0) <= 0 and settings.number("BATT_LOW_MAH", 0.0) <= 0:
        yield Finding("bad", "BATT_LOW_VOLT", "Neither a voltage nor a charge is set as low: that failsafe never acts.")


def _copter_ekf(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    held = settings.held("FS_EKF_THRESH")
    if held is not None and (held.value <= 0 or held.value > EKF_THRESHOLD + 1e-6):
        text = "A wrong position is noticed late." if held.value > 0 else "A wrong position is never noticed."
        yield held.finding("bad" if held.value <= 0 else "look", text, EKF_THRESHOLD)


def _copter_fence(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    enabled = settings.held("FENCE_ENABLE")
    if enabled is None:
        return
    if enabled.value == 0:
        yield enabled.finding("look", "No fence on board: nothing stops the vehicle where this station cannot.")
        return
    kinds = int(settings.number("FENCE_TYPE", 7.0))
    action = int(settings.number("FENCE_ACTION", 1.0))
    does = "only says so" if action == 0 else "breaks the flight off there"
    if plan is None or plan.highest_m is None:
        yield enabled.finding(
            "look", f"A fence is on. At it the vehicle {does}. Whether the plan is inside is not known."
        )
        return
    yield from _fence_height(settings, plan, bool(kinds & 1), does)
    yield from _fence_floor(settings, plan, bool(kinds & 8), does)
    radius = settings.held("FENCE_RADIUS") if kinds & 2 else None
    if radius is not None and radius.value < plan.farthest_m:
        text = (
            f"The plan leads {plan.farthest_m:.0f} m from home, the fence is at {radius.value:g} m: the vehicle {does}."
        )
        yield radius.finding("bad", text, float(math.ceil(plan.farthest_m + ROOM_M)))


def _fence_height(settings: VehicleSettings, plan: LowPlan, is_on: bool, does: str) -> Iterator[Finding]:
    """The return counts, too: it is the highest part of a low flight."""
    top = settings.held("FENCE_ALT_MAX") if is_on else None
    back_m = return_settings(settings.values, "ardupilot").height_m
    assert plan.highest_m is not None
    highest_m = max(plan.highest_m, back_m or 0.0, plan.return_needed_m or 0.0)
    if top is not None and math.isfinite(highest_m) and top.value < highest_m:
        text = (
            f"Plan or return reach {highest_m:.1f} m above home, the fence is at {top.value:g} m: the vehicle {does}."
        )
        yield top.finding("bad", text, float(math.ceil(highest_m + ROOM_M)))


def _fence_floor(settings: VehicleSettings, plan: LowPlan, is_on: bool, does: str) -> Iterator[Finding]:
    floor = settings.held("FENCE_ALT_MIN") if is_on else None
    assert plan.lowest_m is not None
    if floor is not None and floor.value > plan.lowest_m:
        text = (
            f"The plan goes down to {plan.lowest_m:.1f} m from home's height, the fence's floor is {floor.value:g} m: "
        )
        yield floor.finding("bad", f"{text}the vehicle {does}.", float(math.floor(plan.lowest_m - ROOM_M)))


def _px4_return(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    if not return_settings(settings.values, "px4").steep_enough:
        for name, right in (("RTL_CONE_ANG", NEAR_HALF_DEG), ("RTL_MIN_DIST", NEAR_M)):
            held = settings.held(name)
            if held is not None and held.value > right:
                yield held.finding("bad", LESS_CLIMB, right)
    delay = settings.held("RTL_LAND_DELAY")
    if delay is not None and delay.value < 0:
        yield delay.finding("look", "Back home the vehicle does not land: it hovers until the battery is low.", 0.0)
    cruise = settings.held("MPC_XY_CRUISE")
    if plan is not None and plan.commands_speed and cruise is not None and cruise.value > plan.speed_m_s + 0.05:
        text = f"It flies home at {cruise.value:g} m/s; the plan is of {plan.speed_m_s:g} m/s."
        yield cruise.finding("look", text, plan.speed_m_s)


def _px4_fence(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    if plan is None or plan.highest_m is None:
        return
    back_m = return_settings(settings.values, "px4").height_m
    highest_m = max(plan.highest_m, back_m or 0.0, plan.return_needed_m or 0.0)
    for name, reached_m in (("GF_MAX_VER_DIST", highest_m), ("GF_MAX_HOR_DIST", plan.farthest_m)):
        held = settings.held(name)
        if held is not None and math.isfinite(reached_m) and 0 < held.value < reached_m:
            text = f"Plan or return reach {reached_m:.1f} m from home, the fence is at {held.value:g} m."
            yield held.finding("bad", text, float(math.ceil(reached_m + ROOM_M)))


def _px4_terrain(settings: VehicleSettings, plan: LowPlan | None) -> Iterator[Finding]:
    if plan is not None and plan.over_terrain:
        text = "The plan has heights above terrain: PX4 does not follow terrain in missions. Plan above home instead."
        yield Finding("bad", "(mission)", text)


RULES: dict[Firmware, tuple[Rule, ...]] = {
    "ardupilot": (
        _copter_return, _copter_terrain, _copter_fence, _copter_battery, _copter_ekf, _copter_speed,
    ),
    "px4": (_px4_return, _px4_terrain, _px4_fence, _px4_speed),
}  # fmt: skip
