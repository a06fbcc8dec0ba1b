"""The single rows of the check before the start, in the words that the pilot reads."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from planning.basics.plan_model import Home, Mission, VehicleProfile
from planning.certificate.certificate_model import Certificate, ClearanceParams, HomeStand
from planning.formats.commands import has_position
from planning.margins.words import rounded_down, rounded_up
from planning.missions.flown import AMSL_FRAMES
from planning.terrain.vertical_datum import is_amsl
from telemetry.flight.preflight.parameters import ReturnSettings
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.vehicle import GnssFix, VehicleState

Code = Literal["mission", "clearance", "home", "gnss", "rtl_height", "battery", "ready", "avoidance", "fence"]
State = Literal["good", "accept", "bad", "unknown"]

AWAY_M = 3.0
"""A vehicle this far from the planned home is said to stand elsewhere."""
LARGEST_AMSL_OFFSET_M = 0.3
WORTH_A_WORD_M = 0.05
STEEP_ENOUGH = "Set RTL_CONE_SLOPE to 3 (PX4: RTL_CONE_ANG to 45, RTL_MIN_DIST to 10)."
_BELOW_CEILING = "Its ceiling keeps it so low (FENCE_ALT_MAX less FENCE_MARGIN): raise that, or plan lower."
RETURN_REASONS = ("return_height", "return_near_home", "return_unknown")
TYPICAL_ACCURACY_M: dict[GnssFix, float] = {"3d": 2.5, "dgps": 1.0, "rtk_float": 0.5, "rtk_fixed": 0.1}
"""Of receivers that do not say how accurate they are."""
HEIGHT_OVER_PLACE = 1.5
"""Error of a receiver's height over that of its place, where it tells only the latter: satellites stand above only."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the check. accept: may be flown once the pilot accepts it; bad and unknown: not at all."""

    code: Code
    state: State
    text: str
    mend: str = ""


def mission_row(onboard: OnboardMission | None) -> Row:
    if onboard is None:
        return Row("mission", "unknown", "What is on board has not been read back.", "Upload the plan.")
    if not onboard.items:
        return Row("mission", "bad", "There is no mission on board.", "Upload the plan.")
    return Row("mission", "good", f"{len(onboard.items)} items on board, read back.")


def clearance_row(certificate: Certificate | None, problem: str, *, has_surface: bool) -> Row:
    """Without the ways home, which ``return_row`` judges."""
    if not has_surface:
        return Row("clearance", "accept", "Without a surface model the clearance cannot be proved.")
    if certificate is None:
        text = problem or "The mission on board is not known: its clearance cannot be proved."
        return Row("clearance", "bad" if problem else "unknown", text, "Upload the plan again.")
    reasons = [reason for reason in certificate.reasons if reason.code not in RETURN_REASONS]
    if reasons:
        more = f" (and {len(reasons) - 1} more)" if len(reasons) > 1 else ""
        return Row("clearance", "bad", reasons[0].text + more, reasons[0].mend)
    text = (
        f"At least {rounded_down(certificate.min_distance_m)} m from the surface model,"
        f" required {rounded_up(certificate.required_clearance_m)} m."
    )
    return Row("clearance", "good", text)


def home_row(
    away_m: float,
    shift_m: float | None,
    *,
    needs: bool,
    rereferenced_m: float | None,
    stand: HomeStand | None = None,
) -> Row:
    where = f"The vehicle stands {away_m:.1f} m from the plan's home" if away_m > AWAY_M else "The vehicle is at home"
    if shift_m is None:
        return Row("home", "unknown", f"{where}; the ground at the planned home is not known.", "Plan again from here.")
    direction = "higher" if shift_m > 0 else "lower"
    if needs:
        text = f"{where}, where the surface is {abs(shift_m):.2f} m {direction}: every height would be off by that."
        return Row("home", "bad", text, "Upload again: heights are then counted from where the vehicle stands.")
    if rereferenced_m is not None:
        moved = "down" if rereferenced_m > 0 else "up"
        text = f"{where}; heights were moved {moved} by {abs(rereferenced_m):.2f} m to suit its ground."
        return Row("home", "good", text + _lower_end(stand))
    text = f"{where}; its ground is {abs(shift_m):.2f} m {direction} than planned."
    return Row("home", "good", text + _lower_end(stand))


def _lower_end(stand: HomeStand | None) -> str:
    """How low the vehicle may really stand: the clearance is judged from there."""
    if stand is None or not stand.drop_m >= WORTH_A_WORD_M:
        return ""
    by_whom = "by its own RTK height" if stand.told_by == "vehicle" else f"by the model within {stand.reach_m:.2f} m"
    return f" It may stand {rounded_up(stand.drop_m)} m lower than that {by_whom}; the clearance is judged from there."


def amsl_row(mission: Mission | None, state: VehicleState, home: Home) -> Row | None:
    """For items above mean sea level the vehicle's own idea of its altitude must be the model's; None: it is."""
    if mission is None or not any(i.frame in AMSL_FRAMES and has_position(i) for i in mission.items):
        return None
    alt_m = state.home_alt_amsl_m if state.armed or state.alt_amsl_m is None else state.alt_amsl_m
    mend = "Plan with heights relative to home."
    if alt_m is None or not is_amsl(home.vertical_datum):
        return Row(
            "home", "unknown", "The mission's heights are above sea level, and the vehicle's is not known.", mend
        )
    offset_m = alt_m - home.alt_dsm_m
    if abs(offset_m) <= LARGEST_AMSL_OFFSET_M:
        return None
    text = (
        f"The mission's heights are above sea level, and the vehicle takes itself to be {abs(offset_m):.2f} m"
        f" {'higher' if offset_m > 0 else 'lower'} than the surface model says."
    )
    return Row("home", "bad", text, mend)


def gnss_row(state: VehicleState, profile: VehicleProfile) -> Row:
    assumed_m = profile.position_error_m
    if state.gnss_t_mono_s is None:
        return Row("gnss", "unknown", "Nothing was heard of GNSS yet.", "Wait for a 3-D fix.")
    if state.gnss_fix not in TYPICAL_ACCURACY_M:
        words = {"none": "no receiver", "no_fix": "no fix", "2d": "a 2-D fix only"}[state.gnss_fix]
        return Row("gnss", "bad", f"GNSS has {words}.", "Wait for a 3-D fix.")
    if state.estimator_ok is False:
        return Row("gnss", "bad", "The autopilot's position estimate cannot be used yet.", "Wait.")
    fix = state.gnss_fix.replace("_", " ").upper()
    place_m, height_m, said = accuracy_m(state)
    text = (
        f"GNSS is accurate to {place_m:.2f} m in place and {height_m:.2f} m in height, {said} ({fix});"
        f" the plan assumes {assumed_m:.2f} m."
    )
    if max(place_m, height_m) > assumed_m:
        return Row("gnss", "accept", text, "Wait for a better fix, or accept that the vehicle may come nearer by that.")
    return Row("gnss", "good", text)


def accuracy_m(state: VehicleState) -> tuple[float, float, str]:
    """Of place and height, and who says so."""
    place_m, height_m = state.horizontal_accuracy_m, state.vertical_accuracy_m
    typical_m = TYPICAL_ACCURACY_M[state.gnss_fix]
    if place_m is None:
        return typical_m, typical_m if height_m is None else height_m, "typically"
    if height_m is None:
        return place_m, HEIGHT_OVER_PLACE * place_m, "as it says of its place"
    return place_m, height_m, "as it says"


def return_row(certificate: Certificate | None, settings: ReturnSettings, clearance: ClearanceParams) -> Row:
    """The vehicle's real return height against what the ways home need."""
    height_m = settings.height_m
    planned = f"the plan counts on {clearance.rtl_height_m:.0f} m"
    if certificate is None:
        known = "not known" if height_m is None else f"{height_m:.2f} m"
        return Row("rtl_height", "accept", f"The return height is {known}; whether that is enough is not known.")
    reason = next((r for r in certificate.reasons if r.code in RETURN_REASONS), None)
    needed_m = certificate.rtl_height_needed_m
    if reason is not None:
        enough = reason.code == "return_height" and math.isfinite(needed_m)
        mend = f"Set {settings.value_for(needed_m)} on the vehicle." if enough else reason.mend
        return Row("rtl_height", "bad", reason.text, _BELOW_CEILING if enough and settings.below_ceiling else mend)
    if height_m is None:
        text = f"The vehicle does not tell its return height ({settings.parameter}); {planned}."
        return Row("rtl_height", "accept", text, f"Make sure it is {rounded_up(needed_m)} m or more.")
    if not settings.steep_enough:
        text = "Close to home the vehicle climbs less on its return than the certificate takes for granted."
        return Row("rtl_height", "accept", text, STEEP_ENOUGH)
    need = (
        f"the ways home need {rounded_up(needed_m)} m" if needed_m > 0 else "from everywhere it is high enough itself"
    )
    lowered = f", below its ceiling and not at its {settings.parameter}" if settings.below_ceiling else ""
    return Row("rtl_height", "good", f"The vehicle returns at {height_m:.2f} m{lowered}; {need}.")


def battery_row(state: VehicleState, profile: VehicleProfile, predicted_s: float | None) -> Row:
    if state.battery_share is None:
        return Row("battery", "accept", "The vehicle does not tell how much battery is left.", "Look yourself.")
    left = f"The battery has {100 * state.battery_share:.0f} %"
    if predicted_s is None:
        return Row("battery", "accept", f"{left}; how much the flight needs is not known.", "Judge it yourself.")
    flight = predicted_s / profile.endurance_s
    needed = flight + profile.reserve_share
    text = f"{left}; the flight needs {100 * flight:.0f} % and leaves {100 * profile.reserve_share:.0f} % in reserve."
    if state.battery_share >= needed:
        return Row("battery", "good", text)
    return Row("battery", "bad" if state.battery_share < flight else "accept", text, "Change the battery.")


def ready_row(state: VehicleState) -> Row:
    if state.critical:
        return Row("ready", "bad", "A failsafe is active.", "Find out why before flying.")
    if state.armed and state.landed not in (None, "on_ground"):
        return Row("ready", "bad", "The vehicle is in the air.", "Land first.")
    if state.ready_to_arm is False:
        quoted = " ".join(f'"{words}"' for words in state.not_ready_words)
        text = "The vehicle's own checks have not passed."
        if not quoted:
            return Row("ready", "bad", text, "Read its messages.")
        return Row("ready", "bad", f"{text} It says: {quoted}.", "Mend that.")
    if state.ready_to_arm is None:
        return Row("ready", "good", "The vehicle does not say whether it is ready: arming will tell.")
    return Row("ready", "good", "The vehicle says that it is ready.")
