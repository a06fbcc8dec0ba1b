"""The check before the start: on what was READ BACK from the vehicle, and where the vehicle really stands."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from planning.basics.plan_model import Firmware, Home, Mission, VehicleProfile
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.certificate.clearance import certify
from planning.certificate.home_ground import HomeGround
from planning.certificate.home_stand import ground_at
from planning.errors import MissionError
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, within_both
from planning.flight_time.predict import predict_duration
from planning.flight_time.return_speeds import ReturnSpeeds
from planning.formats.commands import has_position
from planning.missions.flown import AMSL_FRAMES, flown_line
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from planning.terrain.vertical_datum import is_amsl
from telemetry.flight.fence_heights import heights_aboard
from telemetry.flight.fence_radius import circle_aboard
from telemetry.flight.preflight import checks
from telemetry.flight.preflight.checks import Row
from telemetry.flight.preflight.fence_check import fence_row, flown_within
from telemetry.flight.preflight.parameters import return_as_flown, return_speeds
from telemetry.mavlink.items import mission_from_onboard
from telemetry.topics.onboard_lists import OnboardMission, PlacesOnboard
from telemetry.topics.vehicle import VehicleState

ANTENNA_M = 0.5
"""The antenna sits at most so high above the ground that the vehicle stands on."""
GEOIDS_M = 0.5
"""By how much the receiver's geoid (EGM96) and the model's levelling network differ, at most, where both are good."""
SIGMAS = 3.0
"""Receivers claim one sigma."""
LARGEST_SHIFT_M = 0.3
"""Heights are re-referenced when the ground at the actual home differs from the planned by more."""


def own_ground(state: VehicleState, vertical_datum: str | None) -> tuple[float, float] | None:
    """(lowest, highest) ground under the vehicle in the model's datum; None without RTK, accuracy or common datum.

    The surface model around the vehicle says between which heights it stands; a receiver with fixed RTK corrections
    says it to centimetres, if its datum is the model's. What it tells is the antenna's height, in a geoid that need
    not be the model's, so the account is an interval, too. It counts only where it is narrower than the model's and
    both can be true.
    """
    if state.gnss_fix != "rtk_fixed" or state.vertical_accuracy_m is None or vertical_datum is None:
        return None
    error_m = SIGMAS * state.vertical_accuracy_m
    if is_amsl(vertical_datum):
        alt_m, error_m = state.gnss_alt_amsl_m, error_m + GEOIDS_M
    elif "ellipsoid" in vertical_datum.lower():
        alt_m = state.gnss_alt_ellipsoid_m
    else:
        return None
    return None if alt_m is None else (alt_m - ANTENNA_M - error_m, alt_m + error_m)


def narrowed(own_m: tuple[float, float] | None, around: HomeGround) -> tuple[float, float] | None:
    """What both accounts allow; None where they contradict each other or the vehicle's adds nothing."""
    if own_m is None or not math.isfinite(around.low_dsm_m):
        return None
    low_m, high_m = max(own_m[0], around.low_dsm_m), min(own_m[1], around.high_dsm_m)
    is_narrower = high_m - low_m < around.high_dsm_m - around.low_dsm_m
    return (low_m, high_m) if low_m <= high_m and is_narrower else None


@dataclass(frozen=True, slots=True)
class Preflight:
    """What the check found."""

    rows: tuple[Row, ...]
    home_shift_m: float | None
    """Surface model at the vehicle's home minus at the planned home."""
    needs_rereference: bool
    """Heights must be moved by ``home_shift_m``, certified and uploaded again; then the check is made anew."""
    certificate: Certificate | None
    """Of the mission that was read back, from the actual home; None without a surface model."""
    mission: Mission | None
    """What was read back, with the actual home on the surface model."""
    clearance: ClearanceParams | None = None
    """What the certificate demanded: with the vehicle's own return height."""

    @property
    def min_distance_m(self) -> float | None:
        return None if self.certificate is None else self.certificate.min_distance_m

    def ok(self, accepted: Collection[str] = ()) -> bool:
        """Whether the flight may start once the rows named by these codes are accepted."""
        return not self.in_the_way(accepted)

    def in_the_way(self, accepted: Collection[str] = ()) -> tuple[Row, ...]:
        """The rows because of which it may not."""
        return tuple(
            row for row in self.rows if not (row.state == "good" or (row.state == "accept" and row.code in accepted))
        )


def check(
    onboard: OnboardMission | None,
    state: VehicleState,
    parameters: Mapping[str, float | None],
    *,
    dsm: Dsm | None,
    profile: VehicleProfile,
    clearance: ClearanceParams,
    planned_home: Home | None,
    firmware: Firmware = "ardupilot",
    rereferenced_m: float | None = None,
    fence: Fence = NO_FENCE,
    rally: tuple[RallyPoint, ...] = (),
    aboard: PlacesOnboard | None = None,
) -> Preflight:
    """Judge a start. Pure; takes up to seconds on a large model: not for the event loop.

    ``clearance`` is what the plan demands; the return height in it gives way to the vehicle's own. Without a
    surface model the rows that need one can be accepted at most. ``rereferenced_m``: heights were moved by so much.
    ``fence`` and ``rally`` are the plan's: what is on board is held against them too. ``aboard``: what the vehicle
    itself holds of them; None: it was not asked.
    """
    settings = return_as_flown(parameters, firmware)
    home = actual_home(state, dsm)
    shift_m = _shift(home, planned_home, dsm)
    mission = _mission(onboard, firmware, home, dsm)
    planned = (fence, rally)
    row = (
        None
        if aboard is None
        else fence_row(planned, aboard, parameters, firmware, untaken_kinds=state.fence_kinds_untaken)
    )
    within = planned if aboard is None or (row is not None and row.state == "bad") else flown_within(planned, aboard)
    kept_to = within_both(within[0], heights_aboard(parameters, firmware))
    around = circle_aboard(parameters, firmware, None if home is None else (home.lat_deg, home.lon_deg))
    kept_to = within_both(kept_to, around)
    mission = None if mission is None else replace(mission, fence=kept_to, rally=within[1])
    surface = fill_holes(dsm)[0] if dsm is not None else None
    height_m = clearance.rtl_height_m if settings.height_m is None else settings.height_m
    demanded = replace(clearance, rtl_height_m=height_m, set_down_m=0.0)
    demanded = replace(demanded, home_known_dsm_m=_own_ground(home, state, dsm, demanded))
    certificate, problem = _certificate(mission, dsm, surface, demanded)
    needs = _needs_rereference(shift_m, mission)
    rows = (
        checks.mission_row(onboard),
        checks.clearance_row(certificate, problem, has_surface=dsm is not None),
        _home_row(home, planned_home, state, dsm, shift_m, mission, needs, rereferenced_m, certificate),
        checks.gnss_row(state, profile),
        checks.return_row(certificate, settings, clearance),
        checks.battery_row(
            state, profile, _predicted_s(mission, profile, surface, return_speeds(parameters, firmware))
        ),
        checks.ready_row(state),
        *([] if row is None else [row]),
    )
    return Preflight(rows, shift_m, needs, certificate, mission if surface is not None else None, demanded)


def actual_home(state: VehicleState, dsm: Dsm | None) -> Home | None:
    """Where home will be: the place of a disarmed vehicle, for it moves its home there when it arms.

    Its height is the surface model's, NaN without one or off it; None when the vehicle has no position.
    """
    places = [(state.home_lat_deg, state.home_lon_deg), (state.lat_deg, state.lon_deg)]
    for lat_deg, lon_deg in places if state.armed else reversed(places):
        if lat_deg is not None and lon_deg is not None:
            alt_m = math.nan
            if dsm is not None:
                alt_m = float(dsm.elevation_at(dsm.xy_from_lat_lon(np.array([[lat_deg, lon_deg]])))[0])
            return Home(lat_deg, lon_deg, alt_m, dsm.vertical_datum if dsm is not None else None)
    return None


def _own_ground(
    home: Home | None, state: VehicleState, dsm: Dsm | None, demanded: ClearanceParams
) -> tuple[float, float] | None:
    """(lowest, highest) that the ground under the vehicle may be by its own account; None: the model tells more."""
    if home is None or dsm is None or state.armed or not math.isfinite(home.alt_dsm_m):
        return None
    x_m, y_m = dsm.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]]))[0]
    around = ground_at(dsm, (float(x_m), float(y_m)), demanded)
    return narrowed(own_ground(state, dsm.vertical_datum), around)


def _shift(home: Home | None, planned: Home | None, dsm: Dsm | None) -> float | None:
    if home is None or planned is None or dsm is None:
        return None
    planned_m = dsm.elevation_at(dsm.xy_from_lat_lon(np.array([[planned.lat_deg, planned.lon_deg]])))[0]
    shift_m = home.alt_dsm_m - float(planned_m)
    return shift_m if math.isfinite(shift_m) else None


def _needs_rereference(shift_m: float | None, mission: Mission | None) -> bool:
    return shift_m is not None and abs(shift_m) > LARGEST_SHIFT_M and mission is not None and not _all_amsl(mission)


def _all_amsl(mission: Mission) -> bool:
    return all(item.frame in AMSL_FRAMES for item in mission.items if has_position(item))


def _mission(onboard: OnboardMission | None, firmware: Firmware, home: Home | None, dsm: Dsm | None) -> Mission | None:
    if onboard is None or not onboard.items:
        return None
    return mission_from_onboard(onboard, firmware, home=home if dsm is not None else None)


def _certificate(
    mission: Mission | None, dsm: Dsm | None, surface: Dsm | None, demanded: ClearanceParams
) -> tuple[Certificate | None, str]:
    if mission is None or dsm is None or surface is None:
        return None, ""
    try:
        return certify(surface, flown_line(mission, surface), demanded, ground=dsm), ""
    except MissionError as error:
        return None, f"{error.what} {error.advice}".strip()


def _predicted_s(
    mission: Mission | None, profile: VehicleProfile, surface: Dsm | None, returns: ReturnSpeeds
) -> float | None:
    if mission is None or surface is None:
        return None
    try:
        return predict_duration(mission, profile, surface, returns=returns).total_s
    except MissionError:
        return None


def _home_row(
    home: Home | None,
    planned: Home | None,
    state: VehicleState,
    dsm: Dsm | None,
    shift_m: float | None,
    mission: Mission | None,
    needs: bool,
    rereferenced_m: float | None,
    certificate: Certificate | None,
) -> Row:
    if dsm is None:
        return Row("home", "accept", "Without a surface model the ground at the vehicle's home cannot be checked.")
    if home is None:
        return Row("home", "unknown", "The vehicle has no position yet.", "Wait for GNSS.")
    if not math.isfinite(home.alt_dsm_m):
        return Row(
            "home",
            "bad",
            f"The vehicle stands at {home.lat_deg:.7f}, {home.lon_deg:.7f}, where the surface model knows no height.",
            "Start from a place on the surface model.",
        )
    offset = checks.amsl_row(mission, state, home)
    if offset is not None:
        return offset
    away_m = 0.0
    if planned is not None:
        places = np.array([[home.lat_deg, home.lon_deg], [planned.lat_deg, planned.lon_deg]])
        away_m = float(np.linalg.norm(np.diff(dsm.xy_from_lat_lon(places), axis=0)))
    stand = None if certificate is None else certificate.home
    return checks.home_row(away_m, shift_m, needs=needs, rereferenced_m=rereferenced_m, stand=stand)
