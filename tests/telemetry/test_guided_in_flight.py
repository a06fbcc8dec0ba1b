"""Certified ways in the air: begun where they were certified, flown in order, held at their end, at other speeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError
from telemetry.flight.guided.beginning import why_not_from
from telemetry.flight.guided.feed import Feed
from telemetry.flight.guided.guided import THERE, GuidedScript
from telemetry.mavlink.actions import Action, Done, Send
from telemetry.mavlink.autopilot_orders import FORCE, Orders
from telemetry.mavlink.modes import mode_numbers
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.requests import FlyWay, Operator
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.guided_requests import request, target
from tests.telemetry.guided_vehicle import GUIDED, HOME, LOITER, PX4_HOLD, Craft
from tests.telemetry.lossy import VEHICLE, Faults, Run
from tests.telemetry.test_guided import Watching, handed_over

BRAKE = 17
WAY = (target(0, 0, 14.0), target(0, 12, 14.0), target(0, 12, 8.0))


def way(targets: tuple[GuidedTarget, ...] = WAY, end: Literal["land", "hold"] = "hold") -> FlyWay:
    return FlyWay(Operator("Ada", 1), targets, HOME[0], HOME[1], 10.0, 5.0, end=end)


def hovering(*, px4: bool = False, up_m: float = 10.0) -> Craft:
    craft = Craft(px4=px4, armed=True, at=[0.0, 0.0, up_m])
    craft.mode = PX4_HOLD if px4 else BRAKE
    return craft


def in_air(*, px4: bool = False, **more: Any) -> VehicleState:
    state = VehicleState(
        *(1, 1),
        autopilot="px4" if px4 else "ardupilot",
        mode="HOLD" if px4 else "BRAKE",
        armed=True,
        landed="in_air",
        lat_deg=HOME[0],
        lon_deg=HOME[1],
        alt_amsl_m=HOME[2] + 10.0,
        alt_rel_home_m=10.0,
        position_t_mono_s=0.0,
    )
    return replace(state, **more)


def fly(craft: Craft, asked: FlyWay, *, acts: Any = None, feed: Feed | None = None, **options: Any) -> Run:
    firmware = "px4" if craft.px4 else "ardupilot"
    machine = GuidedScript(asked, in_air(px4=craft.px4), firmware=firmware, target=VEHICLE, feed=feed)
    bound: dict[float, Callable[[float], list[Action]]] = {
        at_s: (lambda now_s, act=act: act(machine, now_s)) for at_s, act in (acts or {}).items()
    }
    return Run(Watching(machine, bound), craft, **options)


def flown(run: Run, seconds: float = 60.0) -> GuidedScript:
    """As far as it comes in this time; what has come to its end has to stay there."""
    script: GuidedScript = run.until_end(longest_s=seconds).machine.script  # type: ignore[attr-defined]
    return script


@pytest.mark.parametrize("px4", [False, True])
def test_a_way_is_flown_from_the_air_and_held_at_its_end(px4: bool) -> None:
    craft = hovering(px4=px4)
    script = flown(fly(craft, way()))
    assert script.phase == "paused"
    assert script.status().hint == THERE
    assert craft.armed
    assert craft.arms == 0
    assert craft.at == pytest.approx([12.0, 0.0, 8.0], abs=0.6)
    assert [north for _, north in handed_over(craft)] == [0.0, 12.0]


@pytest.mark.parametrize("px4", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_at_10_percent_loss_it_is_flown_in_order_and_held(px4: bool, seed: int) -> None:
    craft = hovering(px4=px4)
    script = flown(fly(craft, way(), faults=Faults(loss=0.1, reordering=0.05), seed=seed), 120.0)
    assert script.is_flown
    assert script.phase == "paused"
    assert craft.at == pytest.approx([12.0, 0.0, 8.0], abs=0.6)


def test_its_status_names_no_items_of_a_mission() -> None:
    script = flown(fly(hovering(), way()), 8.0)
    status = script.status()
    assert (status.target, status.targets) == (None, None)
    script.stop("Another command was given.")
    assert script.status().broke_off_at is None


def test_it_may_end_with_a_landing() -> None:
    craft = hovering()
    run = fly(craft, way(end="land")).until_end(longest_s=200)
    assert run.result.completed
    assert not craft.armed
    assert craft.at == pytest.approx([12.0, 0.0, 0.0], abs=0.6)


def test_what_is_flown_is_not_gone_on_with() -> None:
    script = flown(fly(hovering(), way()))
    assert script.resume(500.0) == []
    assert script.phase == "paused"


def test_a_pause_on_the_way_holds_and_goes_on() -> None:
    craft = hovering()
    heights: list[float] = []
    acts = {
        5.0: lambda script, now_s: script.pause(now_s),
        14.0: lambda script, now_s: (heights.append(craft.at[0]), script.resume(now_s))[1],
    }
    script = flown(fly(craft, way(), acts=acts))
    assert script.is_flown
    assert heights[0] < 11.0


def test_somebody_else_ends_it_by_another_mode() -> None:
    craft = hovering()
    run = fly(craft, way(), acts={5.0: lambda script, now_s: (setattr(craft, "mode", LOITER), [])[1]})
    script = flown(run)
    assert script.phase == "interrupted"
    assert "pilot took over" in script.status().hint


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({"armed": False}, "not in the air"),
        ({"landed": "on_ground"}, "not in the air"),
        ({"ground_speed_m_s": 2.0}, "moves at 2.0 m/s"),
        ({"climb_m_s": -1.5}, "moves at 1.5 m/s"),
        ({"lat_deg": HOME[0] + 2e-5}, "2.2 m from where"),
        ({"alt_rel_home_m": 8.0}, "2.0 m from where"),
        ({"lat_deg": None}, "not known to be where"),
        ({"position_t_mono_s": -2.5}, "not known to be where"),
        ({"position_t_mono_s": None}, "not known to be where"),
    ],
)
def test_it_does_not_begin_where_it_was_not_certified(state: dict[str, Any], words: str) -> None:
    refusal = why_not_from(way(), in_air(**state), 0.0)
    assert isinstance(refusal, NotAllowedError)
    assert words in str(refusal)
    assert refusal.advice
    assert why_not_from(way(), in_air(), 0.0) is None


def test_a_certified_take_off_does_not_begin_where_the_vehicle_was_carried_to() -> None:
    """Up there it would fly straight to over where it was judged, through whatever stands between."""
    up = replace(request((target(0, 0, 10.0),), end="hold"), begins_lat_deg=HOME[0], begins_lon_deg=HOME[1])
    stands = in_air(armed=False, landed="on_ground", alt_rel_home_m=0.4)
    assert why_not_from(up, stands, 0.0) is None
    for elsewhere in ({"lat_deg": HOME[0] + 2e-5}, {"lat_deg": None}, {"position_t_mono_s": -30.0}):
        refusal = why_not_from(up, replace(stands, **elsewhere), 0.0)
        assert isinstance(refusal, NotAllowedError)
        assert "where the certified way begins" in str(refusal)
    assert why_not_from(request(), replace(stands, lat_deg=HOME[0] + 2e-5), 0.0) is None


def test_a_mode_that_is_refused_ends_it_with_the_reason_before_it_sets_out() -> None:
    class Refusing(Craft):
        def _obey(self, message: Any) -> int:
            return 4 if message.command == mavlink.MAV_CMD_DO_SET_MODE else super()._obey(message)

    craft = Refusing(armed=True, at=[0.0, 0.0, 10.0])
    craft.mode = BRAKE
    script = flown(fly(craft, way()), 10.0)
    assert script.phase == "interrupted"
    assert handed_over(craft) == []


@pytest.mark.parametrize("feed", [None, Feed()])
def test_another_speed_holds_for_the_rest_of_the_way(feed: Feed | None) -> None:
    far = (target(0, 60, 10.0, speed_m_s=4.0),)
    craft = hovering()
    script = flown(fly(craft, way(far), feed=feed, acts={6.0: lambda s, now_s: s.set_speed(1.0, now_s)}), 20.0)
    assert script.target.speed_m_s == 1.0
    speeds = [m.param2 for _, m in craft.log if getattr(m, "command", 0) == mavlink.MAV_CMD_DO_CHANGE_SPEED]
    assert speeds[0] == 4.0
    assert speeds[-1] == 1.0
    if feed is not None:
        places = [m for _, m in craft.log if m.get_type() == "SET_POSITION_TARGET_GLOBAL_INT"]
        assert max(m.vx for m in places[:60]) > 2.0
        assert places[-1].vx <= 1.01


def test_the_order_to_stop_the_motors_is_the_forced_disarming_of_both_autopilots() -> None:
    for autopilot in ("ardupilot", "px4"):
        message = Orders(VEHICLE, autopilot).stop_motors().message
        parsed = mavlink.MAVLink(None).parse_buffer(message.pack(mavlink.MAVLink(None)))
        assert parsed
        packed: Any = parsed[0]
        assert packed.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM
        assert (packed.param1, packed.param2) == (0.0, FORCE)


def test_the_modes_that_it_flies_in_are_known() -> None:
    assert mode_numbers("ardupilot", "GUIDED") is not None
    assert GUIDED == 4


def with_home(state: VehicleState, home_alt_amsl_m: float, **more: Any) -> VehicleState:
    return replace(
        state, home_lat_deg=HOME[0], home_lon_deg=HOME[1], home_alt_amsl_m=home_alt_amsl_m, mode="GUIDED", **more
    )


@pytest.mark.parametrize("told_first", ["home", "position"])
def test_a_home_that_moves_leaves_the_vehicle_at_its_height_whatever_is_told_first(told_first: str) -> None:
    script = GuidedScript(way(), in_air(), firmware="ardupilot", target=VEHICLE)
    script.start(0.0)
    before = with_home(in_air(), HOME[2])
    taken = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_DO_SET_MODE, 0)
    taken.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=1))
    script.on_message(taken, 0.1)
    script.on_state(before, 0.1)
    assert script.phase == "flying"
    up_m = 10.0 if told_first == "home" else 22.0
    sent = script.on_state(with_home(in_air(), HOME[2] - 12.0, alt_rel_home_m=up_m), 0.2)
    assert [action.message.coordinate_frame for action in sent if isinstance(action, Send)] == [5]
    assert [action.message.alt for action in sent if isinstance(action, Send)] == [pytest.approx(HOME[2] + 10.0)]
    assert (script.phase, script.is_over) == ("paused", False), "the order may be lost"
    assert script.resume(0.3) == []
    now = with_home(in_air(), HOME[2] - 12.0, alt_rel_home_m=22.0, position_t_mono_s=2.0, ground_speed_m_s=4.0)
    again = script.on_state(replace(now, lat_deg=HOME[0] + 1e-4), 2.0)
    assert [action.message.alt for action in again if isinstance(action, Send)] == [pytest.approx(HOME[2] + 10.0)]
    ended = script.on_state(replace(now, position_t_mono_s=4.0, ground_speed_m_s=0.1), 4.0)
    assert [type(action) for action in ended] == [Done]
    assert "certified for the home before" in script.hint
