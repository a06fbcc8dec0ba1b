"""The flight's status: followed from the vehicle's state, with the place where it broke off."""

from dataclasses import replace

import pytest

from telemetry.mavlink.flight_keeper import FlightKeeper, item_of, sequence_of
from telemetry.topics.messages import FlightPhase, FlightStatus
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.vehicle import VehicleState


def item(command: int) -> Item:
    return Item(command, 3, (0.0, 0.0, 0.0, 0.0), -37.0, 175.0, 10.0)


ONBOARD = OnboardMission((item(22), item(16), item(16), item(16), item(20)), None, None, None, "digest")
WAYPOINTS = OnboardMission((item(16), item(16)), None, None, None, "digest")
ON_GROUND = VehicleState(1, 1, autopilot="ardupilot", mode="GUIDED", landed="on_ground", heartbeat_t_mono_s=1.0)
FLYING = replace(ON_GROUND, mode="AUTO", armed=True, landed="in_air")


def at(sequence: int, **changes: object) -> VehicleState:
    return replace(FLYING, mission_item=sequence, **changes)  # type: ignore[arg-type]


def follow(keeper: FlightKeeper, *states: VehicleState, onboard: OnboardMission | None = ONBOARD) -> list[str]:
    phases = []
    for state in states:
        keeper.on_state(state, onboard, joining=False)
        phases.append(keeper.status.phase)
    return phases


def started() -> FlightKeeper:
    keeper = FlightKeeper()
    keeper.begin(5, 1000.0)
    return keeper


LANDED = replace(ON_GROUND, mode="AUTO")


def test_a_whole_mission() -> None:
    keeper = started()
    states = (ON_GROUND, replace(ON_GROUND, armed=True), at(1), at(2), at(3), at(4), at(5), LANDED)
    phases = ["arming", "arming", "taking_off", "flying", "flying", "flying", "returning", "landed"]
    assert follow(keeper, *states) == phases
    assert (keeper.status.broke_off_at, keeper.status.targets, keeper.status.since_utc_s) == (None, 5, 1000.0)


def test_a_mission_without_a_way_home_is_over_at_its_last_waypoint() -> None:
    keeper = FlightKeeper()
    keeper.begin(2, 0.0)
    left_over = at(1, mission_reached=2)
    assert follow(keeper, left_over, at(2, mission_reached=1), onboard=WAYPOINTS) == ["flying", "flying"]
    assert follow(keeper, at(2, mission_reached=2), LANDED, onboard=WAYPOINTS) == ["returning", "landed"]


@pytest.mark.fact("A9")
@pytest.mark.parametrize(("autopilot", "mode"), [("ardupilot", "AUTO"), ("px4", "MISSION")])
def test_a_vehicle_that_forgets_its_mission_before_it_says_that_it_is_disarmed(autopilot: str, mode: str) -> None:
    keeper, last = started(), 5 if autopilot == "ardupilot" else 4
    home = at(last, autopilot=autopilot, mode=mode)
    down = replace(home, landed="on_ground", mission_item=0)
    assert follow(keeper, home, down, replace(down, armed=False)) == ["returning", "returning", "landed"]
    assert (keeper.status.target, keeper.status.broke_off_at) == (5, None)


def test_home_is_no_item_to_fly_to() -> None:
    keeper = started()
    assert follow(keeper, at(5), at(0), at(3)) == ["returning", "returning", "flying"]
    assert follow(keeper, at(0), replace(at(0), armed=False)) == ["flying", "interrupted"]
    assert keeper.status.broke_off_at == 3


def test_a_flight_that_returns_early_knows_where_it_broke_off() -> None:
    keeper = started()
    rtl = at(3, mode="RTL")
    assert follow(keeper, at(2), at(3), rtl) == ["flying", "flying", "returning"]
    assert keeper.status.broke_off_at == 3
    assert follow(keeper, replace(rtl, armed=False, landed="on_ground")) == ["interrupted"]
    assert keeper.status.broke_off_at == 3


def test_a_failsafe_that_is_resumed_has_not_broken_off() -> None:
    keeper = started()
    assert follow(keeper, at(3), at(3, mode="RTL"), at(3)) == ["flying", "returning", "flying"]
    assert keeper.status.broke_off_at is None


@pytest.mark.fact("A22")
def test_leaving_the_mission_is_a_pause() -> None:
    keeper = started()
    assert follow(keeper, at(2), at(2, mode="BRAKE"), at(2)) == ["flying", "paused", "flying"]
    assert follow(keeper, at(2, mode="LAND"), LANDED) == ["returning", "interrupted"]


def test_disarming_in_the_middle_is_an_interruption() -> None:
    keeper = started()
    assert follow(keeper, at(2), LANDED) == ["flying", "interrupted"]
    assert keeper.status.broke_off_at == 2


def test_a_mission_that_the_remote_control_started_is_followed_too() -> None:
    keeper = FlightKeeper()
    assert follow(keeper, ON_GROUND, at(2)) == ["idle", "flying"]
    assert (keeper.status.way, keeper.status.target) == ("auto", 2)


@pytest.mark.parametrize(("reached", "ends"), [(4, None), (3, 4)])
def test_a_px4_that_reaches_the_end_and_turns_home_in_one_breath_has_flown_it(reached: int, ends: int | None) -> None:
    keeper, px4 = started(), replace(FLYING, autopilot="px4", mode="MISSION")
    home = replace(px4, mode="RTL", mission_item=reached, mission_reached=reached)
    on_ground = replace(LANDED, autopilot="px4")
    phases = follow(keeper, replace(px4, mission_item=3, mission_reached=2), home, on_ground)
    assert phases == ["flying", "returning", "interrupted" if ends else "landed"]
    assert keeper.status.broke_off_at == ends


def test_px4_counts_from_zero() -> None:
    state = replace(at(1), autopilot="px4", mode="MISSION")
    assert (item_of(state), sequence_of(2, "px4")) == (2, 1)
    assert (item_of(at(2)), sequence_of(2, "ardupilot")) == (2, 2)
    assert item_of(ON_GROUND) is None
    keeper = started()
    follow(keeper, state)
    assert keeper.status.target == 2


def test_a_start_that_was_refused_leaves_nothing_but_its_reason() -> None:
    keeper = started()
    keeper.cancel("No GPS.")
    assert keeper.status == FlightStatus(hint="No GPS.")
    assert follow(keeper, ON_GROUND) == ["idle"]


@pytest.mark.parametrize(("landed", "phase"), [("taking_off", "taking_off"), ("in_air", "flying")])
def test_on_the_way_to_where_it_goes_on(landed: str, phase: str) -> None:
    keeper = FlightKeeper()
    keeper.begin(5, 0.0, first=4)
    keeper.on_state(at(0, mode="GUIDED", landed=landed), ONBOARD, joining=True)
    assert (keeper.status.phase, keeper.status.target) == (phase, 4)


def test_a_script_that_was_broken_off_keeps_its_place_on_the_way_home() -> None:
    keeper = FlightKeeper()
    keeper.script(FlightStatus("guided", "interrupted", 7, 9, 0.0, broke_off_at=7), armed=True)
    rtl = at(0, mode="RTL")
    assert follow(keeper, rtl, replace(rtl, armed=False)) == ["returning", "interrupted"]
    assert keeper.status.broke_off_at == 7


def test_after_a_crash_of_the_node_a_mission_goes_on_and_a_script_does_not() -> None:
    keeper = FlightKeeper()
    keeper.take_up(FlightStatus("auto", "flying", 3, 5, 1000.0))
    assert follow(keeper, at(4)) == ["flying"]
    assert keeper.status.since_utc_s == 1000.0
    keeper = FlightKeeper()
    keeper.take_up(FlightStatus("guided", "flying", 3, 5, 1000.0))
    assert (keeper.status.phase, keeper.status.broke_off_at) == ("interrupted", 3)
    assert "return home" in keeper.status.hint
    keeper = FlightKeeper()
    keeper.take_up(FlightStatus("auto", "landed", 5, 5, 1000.0))
    assert keeper.status == FlightStatus()


@pytest.mark.parametrize(("phase", "hint"), [("flying", ""), ("paused", "Why it holds.")])
def test_what_it_did_until_it_returns_is_not_said_of_the_return(phase: FlightPhase, hint: str) -> None:
    keeper = FlightKeeper()
    keeper.script(FlightStatus("guided", phase, target=3, hint="Why it holds."), armed=True)
    keeper.on_state(VehicleState(1, 1, autopilot="ardupilot", mode="RTL", armed=True), ONBOARD, joining=False)
    assert (keeper.status.phase, keeper.status.hint) == ("returning", hint)
