"""The check before the start, and moved heights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.basics.plan_model import Home, Mission, MissionItem, VehicleProfile
from planning.certificate.certificate_model import ClearanceParams
from planning.certificate.clearance import certify
from planning.fence.fence_model import Fence, RallyPoint, circle
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm
from telemetry.flight.preflight.checks import Row
from telemetry.flight.preflight.parameters import return_settings
from telemetry.flight.preflight.preflight import Preflight, actual_home, check
from telemetry.flight.preflight.rereference import rereference
from telemetry.mavlink.items import items_from_mission
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.vehicle import VehicleState
from tests.server.flight_logs import PLAIN, ROUTE, degrees, mission

PROFILE = VehicleProfile("quad", position_error_m=1.0, rtl_height_m=30.0)
CLEARANCE = ClearanceParams(2.0, vehicle_radius_m=0.35, position_error_m=1.0, rtl_height_m=30.0)
PLANNED = mission(ROUTE)
HOME = (50.0, 150.0)
PARAMETERS = {"RTL_ALT": 3000.0, "RTL_CONE_SLOPE": 3.0}


def state_at(place: tuple[float, float] = HOME, **changes) -> VehicleState:
    lat, lon = (float(v) for v in degrees([place])[0])
    ready = VehicleState(
        1, 1, autopilot="ardupilot", mode="GUIDED", landed="on_ground", ready_to_arm=True,
        lat_deg=lat, lon_deg=lon, alt_rel_home_m=0.0, home_lat_deg=lat, home_lon_deg=lon, home_alt_amsl_m=80.0,
        gnss_t_mono_s=1.0, gnss_fix="rtk_fixed", horizontal_accuracy_m=0.02, estimator_ok=True, battery_share=0.95,
    )  # fmt: skip
    return replace(ready, **changes)


def onboard(flown: Mission = PLANNED) -> OnboardMission:
    return OnboardMission(items_from_mission(flown), None, None, None, "digest")


def checked(state: VehicleState | None = None, flown: Mission = PLANNED, **changes) -> Preflight:
    given_ = {"dsm": PLAIN, "profile": PROFILE, "clearance": CLEARANCE, "planned_home": PLANNED.home}
    parameters = changes.pop("parameters", PARAMETERS)
    read_back = changes.pop("onboard", onboard(flown))
    return check(read_back, state or state_at(), parameters, **(given_ | changes))


def row(found: Preflight, code: str) -> Row:
    return next(r for r in found.rows if r.code == code)


def hill(height_m: float = 3.0) -> Dsm:
    """A flat mound of 20 m around 30 m east of the planned home."""
    cells = np.array(PLAIN.elevation_m)
    cells[140:160, 70:90] += height_m
    return PLAIN.with_elevation(cells)


def test_what_is_on_board_is_held_against_the_plans_fence() -> None:
    place = (PLANNED.home.lat_deg, PLANNED.home.lon_deg)
    wide = Fence(circles=(circle(*place, 900.0, inclusion=True, where="test"),))
    assert checked(fence=wide).ok()
    found = checked(fence=Fence(circles=(circle(*place, 5.0, inclusion=True, where="test"),)))
    assert row(found, "clearance").state == "bad"
    assert "leaves inclusion circle 1" in row(found, "clearance").text
    far = checked(rally=(RallyPoint(0.0, 0.0, 20.0),))
    assert "Rally point 1" in row(far, "clearance").text


def test_all_is_well() -> None:
    found = checked()
    assert [r.code for r in found.rows] == ["mission", "clearance", "home", "gnss", "rtl_height", "battery", "ready"]
    assert {r.state for r in found.rows} == {"good"}
    assert found.ok()
    assert found.home_shift_m == pytest.approx(0.0)
    assert found.min_distance_m == pytest.approx(12.0, abs=0.01)
    assert found.in_the_way() == ()


def test_what_was_read_back_is_judged() -> None:
    low = replace(PLANNED, items=tuple(replace(i, alt_m=9.0) if i.command == 16 else i for i in PLANNED.items))
    found = checked(flown=low)
    assert row(found, "clearance").state == "bad"
    assert "1.00 m" in row(found, "clearance").text
    assert not found.ok(("clearance",))


@pytest.mark.parametrize(("read_back", "state"), [(None, "unknown"), (OnboardMission((), None, None, None, ""), "bad")])
def test_no_mission(read_back, state) -> None:
    found = checked(onboard=read_back)
    assert row(found, "mission").state == state
    assert not found.ok(("mission", "clearance", "rtl_height"))


def test_higher_ground_at_home_needs_other_heights() -> None:
    found = checked(state_at((80.0, 150.0)), dsm=hill())
    assert found.needs_rereference
    assert found.home_shift_m == pytest.approx(3.0)
    home = row(found, "home")
    assert home.state == "bad"
    assert "30.0 m from the plan's home, where the surface is 3.00 m higher" in home.text
    assert not found.ok(("home",))


def test_other_heights_keep_the_line_where_it_is() -> None:
    dsm, state = hill(), state_at((80.0, 150.0))
    home = actual_home(state, dsm)
    assert home is not None
    moved = rereference(PLANNED, 3.0, home=home)
    again = checked(state, moved, dsm=dsm, planned_home=home, rereferenced_m=3.0)
    assert again.ok()
    assert not again.needs_rereference
    assert "moved down by 3.00 m" in row(again, "home").text
    before, after = flown_line(PLANNED, dsm), flown_line(moved, dsm)
    assert after.points_m[-1, 2] == pytest.approx(before.points_m[-1, 2], abs=0.011)
    assert after.points_m[-1, 2] >= before.points_m[-1, 2] - 1e-9
    assert after.takeoff_alt_dsm_m == pytest.approx(before.takeoff_alt_dsm_m, abs=0.011)


def test_the_way_from_another_place_is_judged_too() -> None:
    """Between where the vehicle stands and the first waypoint there is the tower, higher than the take-off."""
    low_first = mission([(150.0, 150.0, 6.0), (50.0, 150.0, 20.0)], home=(150.0, 150.0))
    assert checked(state_at((150.0, 150.0)), low_first, planned_home=low_first.home).ok()
    found = checked(state_at((250.0, 150.0)), low_first, planned_home=low_first.home)
    assert row(found, "clearance").state == "bad"
    assert "100.0 m from the plan's home" in row(found, "home").text


@given(shift_m=st.floats(-30, 30), alts=st.lists(st.floats(-20, 60), min_size=1, max_size=5))
def test_moved_heights_are_never_lower_and_hardly_higher(shift_m, alts) -> None:
    items = tuple(MissionItem(16, 3, lat_deg=1.0, lon_deg=2.0, alt_m=round(a, 2) + 0.002) for a in alts)
    before = Mission(Home(1.0, 2.0, 0.0), items)
    for old, new in zip(before.items, rereference(before, shift_m).items, strict=True):
        kept_m = math.trunc(float(np.float32(new.alt_m) * np.float32(100))) / 100  # as vehicles store it
        assert kept_m + shift_m >= old.alt_m - 0.002 - 1e-4
        assert kept_m + shift_m <= old.alt_m + 0.022
        assert kept_m != 0.0


def test_heights_above_sea_level_are_not_moved_but_compared() -> None:
    amsl = replace(PLANNED, items=tuple(replace(i, frame=0, alt_m=i.alt_m + 100.0) for i in PLANNED.items[:-1]))
    assert rereference(amsl, 3.0).items == amsl.items
    above_sea = replace(PLAIN, vertical_datum="EGM2008 height")
    close = checked(state_at(alt_amsl_m=100.1), amsl, dsm=above_sea)
    assert row(close, "home").state == "good"
    off = checked(state_at(alt_amsl_m=101.5), amsl, dsm=above_sea)
    assert row(off, "home").state == "bad"
    assert "1.50 m higher" in row(off, "home").text
    assert row(checked(state_at(alt_amsl_m=100.1), amsl), "home").state == "unknown"


def test_home_is_where_a_disarmed_vehicle_stands() -> None:
    lat, lon = (float(v) for v in degrees([(80.0, 150.0)])[0])
    moved = state_at(lat_deg=lat, lon_deg=lon)
    standing, flying = actual_home(moved, PLAIN), actual_home(replace(moved, armed=True), PLAIN)
    assert standing is not None
    assert flying is not None
    assert standing.lon_deg == pytest.approx(lon)
    assert flying.lon_deg == pytest.approx(moved.home_lon_deg)
    nowhere = replace(moved, lat_deg=None, lon_deg=None, home_lat_deg=None, home_lon_deg=None)
    assert actual_home(nowhere, PLAIN) is None
    assert row(checked(nowhere), "home").state == "unknown"


def test_home_off_the_model() -> None:
    assert row(checked(state_at((-50.0, 150.0))), "home").state == "bad"


@pytest.mark.fact("P3")
@pytest.mark.parametrize(
    ("changes", "state"),
    [
        ({"horizontal_accuracy_m": 0.9, "vertical_accuracy_m": 0.9}, "good"),
        ({"horizontal_accuracy_m": 2.5, "gnss_fix": "3d"}, "accept"),
        ({"horizontal_accuracy_m": None, "gnss_fix": "3d"}, "accept"),
        ({"vertical_accuracy_m": 1.78}, "accept"),
        ({"horizontal_accuracy_m": 0.8}, "accept"),
        ({"horizontal_accuracy_m": None}, "good"),
        ({"gnss_fix": "2d"}, "bad"),
        ({"gnss_fix": "no_fix"}, "bad"),
        ({"gnss_fix": "none", "gnss_t_mono_s": None}, "unknown"),
        ({"estimator_ok": False}, "bad"),
    ],
)
def test_gnss(changes, state) -> None:
    found = checked(state_at(**changes))
    assert row(found, "gnss").state == state
    assert found.ok(("gnss",)) is (state in ("good", "accept"))
    assert found.ok() is (state == "good")


@pytest.mark.parametrize(
    ("parameters", "state", "words"),
    [
        ({"RTL_ALT": 3000.0}, "good", "returns at 30.00 m"),
        ({"RTL_ALT_M": 30.0, "RTL_ALT": None}, "good", "returns at 30.00 m"),
        ({"RTL_ALT": 900.0}, "good", "returns at 9.00 m"),  # it keeps its own 20 m, which is more
        ({}, "accept", "does not tell its return height"),
        ({"RTL_ALT": 3000.0, "RTL_CONE_SLOPE": 1.0}, "accept", "climbs less"),
        ({"RTL_ALT": 3000.0, "RTL_CONE_SLOPE": 0.0}, "good", "returns at"),
    ],
)
def test_return_height(parameters, state, words) -> None:
    found = row(checked(parameters=parameters), "rtl_height")
    assert found.state == state
    assert words in found.text


@pytest.mark.fact("A20")
def test_a_return_height_that_is_not_enough() -> None:
    below = mission([(50.0, 150.0, 6.0), (50.0, 200.0, 6.0), (250.0, 200.0, 6.0), (250.0, 150.0, 6.0)])
    found = checked(flown=below, parameters={"RTL_ALT": 500.0})
    assert row(found, "rtl_height").state == "bad"
    assert row(found, "rtl_height").mend == "Set RTL_ALT 1000 cm on the vehicle."
    assert row(found, "clearance").state == "good"
    assert checked(flown=below).ok()


@pytest.mark.parametrize(
    ("acts", "firmware", "name"),
    [
        ({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0}, "ardupilot", "FENCE_RADIUS"),
        ({"GF_ACTION": 2.0, "GF_MAX_VER_DIST": 0.0}, "px4", "GF_MAX_HOR_DIST"),
    ],
)
def test_a_circle_around_home_on_board_that_the_flight_would_leave_is_found(acts, firmware, name) -> None:
    wide = checked(parameters=PARAMETERS | acts | {name: 900.0}, firmware=firmware)
    assert row(wide, "clearance").state == "good"
    near = checked(parameters=PARAMETERS | acts | {name: 5.0}, firmware=firmware)
    assert row(near, "clearance").state == "bad"
    assert "leaves inclusion circle 1" in row(near, "clearance").text
    off = {"FENCE_ENABLE": 0.0, "GF_ACTION": 0.0}
    assert (
        row(checked(parameters=PARAMETERS | acts | {name: 5.0} | off, firmware=firmware), "clearance").state == "good"
    )


def test_a_ceiling_on_board_that_the_flight_or_its_return_would_not_keep_is_found() -> None:
    acts = PARAMETERS | {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 1.0, "FENCE_ALT_MAX": 12.0, "FENCE_MARGIN": 2.0}
    low = checked(parameters=acts)
    assert row(low, "clearance").state == "bad"
    assert "the fence's ceiling is at 12 m" in row(low, "clearance").text
    wide = checked(parameters=acts | {"FENCE_ALT_MAX": 31.0})  # its return is cut to 29 m
    assert wide.ok()
    assert "returns at 29.00 m, below its ceiling and not at its RTL_ALT" in row(wide, "rtl_height").text
    below = mission([(50.0, 150.0, 6.0), (50.0, 200.0, 6.0), (250.0, 200.0, 6.0), (250.0, 150.0, 6.0)])
    cut = checked(flown=below, parameters=acts | {"FENCE_ALT_MAX": 10.5})
    assert row(cut, "rtl_height").state == "bad"
    assert "Its ceiling keeps it so low" in row(cut, "rtl_height").mend


def test_return_settings_of_each_firmware() -> None:
    assert return_settings({"RTL_RETURN_ALT": 45.0}, "px4").height_m == 45.0
    for half_deg, within_m, steep_enough in (
        (45.0, 10.0, True), (30.0, 10.0, True), (0.0, 50.0, True), (65.0, 10.0, False), (45.0, 20.0, False),
    ):  # fmt: skip
        px4 = {"RTL_RETURN_ALT": 45.0, "RTL_CONE_ANG": half_deg, "RTL_MIN_DIST": within_m}
        assert return_settings(px4, "px4").steep_enough is steep_enough
    assert return_settings({"RTL_ALT": math.nan}, "ardupilot").height_m is None
    assert return_settings({"RTL_ALT_M": 12.0}, "ardupilot").value_for(12.3) == "RTL_ALT_M 13 m"


@pytest.mark.parametrize(("share", "state"), [(0.9, "good"), (0.30, "accept"), (0.05, "bad"), (None, "accept")])
def test_battery(share, state) -> None:
    assert row(checked(state_at(battery_share=share)), "battery").state == state


@pytest.mark.parametrize(
    ("changes", "state"),
    [
        ({"ready_to_arm": False}, "bad"),
        ({"ready_to_arm": None}, "good"),
        ({"critical": True}, "bad"),
        ({"armed": True, "landed": "in_air"}, "bad"),
    ],
)
def test_ready(changes, state) -> None:
    assert row(checked(state_at(**changes)), "ready").state == state


@pytest.mark.fact("A33")
def test_a_vehicle_that_is_not_ready_is_quoted() -> None:
    words = ("PreArm: Compass not healthy", "PreArm: Battery 1 low voltage failsafe")
    found = row(checked(state_at(ready_to_arm=False, not_ready_words=words)), "ready")
    assert f'It says: "{words[0]}" "{words[1]}".' in found.text


def test_without_a_surface_model_all_that_needs_one_can_only_be_accepted() -> None:
    found = checked(dsm=None)
    assert {r.code for r in found.in_the_way()} == {"clearance", "home", "rtl_height", "battery"}
    assert {r.state for r in found.in_the_way()} == {"accept"}
    assert found.certificate is None


def test_an_item_that_cannot_be_judged() -> None:
    jump = replace(PLANNED, items=(*PLANNED.items[:-1], MissionItem(177, 2), PLANNED.items[-1]))
    found = checked(flown=jump)
    assert row(found, "clearance").state == "bad"
    assert "jumps to another item" in row(found, "clearance").text
    nowhere = replace(PLANNED, items=(MissionItem(16, 3, lat_deg=120.0, lon_deg=1.0, alt_m=3.0),))
    assert row(checked(flown=nowhere), "clearance").state == "bad"


def dented(by_m: float, *, datum: str | None = None) -> Dsm:
    """The plain with one cell beside the vehicle lower, or the vehicle's own cell higher."""
    cells = np.array(PLAIN.elevation_m)
    row, col = (int(v[0]) for v in PLAIN.fractional_cell(PLAIN.xy_from_lat_lon(degrees([HOME]))))
    cells[row, col if by_m > 0 else col + 1] += by_m
    return replace(PLAIN.with_elevation(cells), vertical_datum=datum)


def test_a_vehicle_on_a_spike_of_the_model_may_not_start_and_hears_where_it_may() -> None:
    found = checked(dsm=dented(5.0), planned_home=None)
    clearance = row(found, "clearance")
    assert clearance.state == "bad"
    assert "Home lies on top of something: the surface falls 5.0 m" in clearance.text
    assert "The nearest home that would do is" in clearance.mend
    assert found.certificate is not None
    assert found.certificate.home is not None
    assert found.certificate.home.better is not None
    there = found.certificate.home.better
    moved = checked(state_at(lat_deg=there.lat_deg, lon_deg=there.lon_deg), dsm=dented(5.0))
    assert row(moved, "clearance").state == "good"


def test_the_clearance_is_judged_from_where_the_vehicle_may_really_stand() -> None:
    found = checked(dsm=dented(-0.875), clearance=replace(CLEARANCE, required_clearance_m=11.5))
    assert found.min_distance_m == pytest.approx(12.0, abs=0.01)
    assert row(found, "clearance").state == "bad"
    assert "0.88 m lower" in row(found, "clearance").text
    assert "It may stand 0.88 m lower than that by the model within 1.35 m" in row(found, "home").text
    assert row(checked(dsm=dented(-0.875)), "clearance").state == "good"


@pytest.mark.parametrize(
    ("changes", "drop_m", "told_by"),
    [
        ({}, 0.26, "vehicle"),
        ({"gnss_fix": "3d"}, 0.875, "model"),
        ({"vertical_accuracy_m": None}, 0.875, "model"),
        ({"vertical_accuracy_m": 1.5}, 0.875, "model"),
        ({"gnss_alt_ellipsoid_m": None}, 0.875, "model"),
        ({"gnss_alt_ellipsoid_m": 104.0}, 0.875, "model"),
    ],
)
def test_the_vehicles_own_height_counts_where_it_is_better(changes, drop_m, told_by) -> None:
    surveyed = {"vertical_accuracy_m": 0.02, "gnss_alt_ellipsoid_m": 100.3, "gnss_alt_amsl_m": 53.0}
    found = checked(state_at(**(surveyed | changes)), dsm=dented(-0.875, datum="WGS 84 ellipsoid"))
    assert found.certificate is not None
    assert found.certificate.home is not None
    assert found.certificate.home.told_by == told_by
    assert found.certificate.home.drop_m == pytest.approx(drop_m, abs=1e-4)


def test_a_height_above_the_sea_knows_its_geoid_to_half_a_metre() -> None:
    surveyed = state_at(vertical_accuracy_m=0.02, gnss_alt_amsl_m=100.3, gnss_alt_ellipsoid_m=147.0)
    drops_m = []
    for datum in ("EGM2008 height", None):
        home = checked(surveyed, dsm=dented(-1.0, datum=datum)).certificate.home  # type: ignore[union-attr]
        assert home is not None
        drops_m.append(home.drop_m)
    assert drops_m == pytest.approx([0.76, 1.0], abs=1e-4)


@pytest.mark.fact("A12")
def test_a_plan_that_is_clear_is_clear_at_the_vehicle_beside_it() -> None:
    """Planned "clear", refused 0.03 m away: a wall just beyond the plan's reach was just within the check's."""
    cells = np.array(PLAIN.elevation_m)
    row_px, col_px = (int(v[0]) for v in PLAIN.fractional_cell(PLAIN.xy_from_lat_lon(degrees([HOME]))))
    for wall in range(1, 6):
        walled = cells.copy()
        walled[row_px - 3 : row_px + 4, col_px + wall] += 3.2
        dsm = PLAIN.with_elevation(walled)
        planned = certify(dsm, flown_line(PLANNED, dsm), CLEARANCE)
        if planned.home_column_clear:
            assert row(checked(state_at((HOME[0] + 0.03, HOME[1])), dsm=dsm), "clearance").state == "good"
