"""Where and how a script or a certified way may begin, and where home may be set on the ground."""

from __future__ import annotations

import math

from mapping.geometry.frames import apart_m
from telemetry.errors import NotAllowedError
from telemetry.flight.guided.handover import away_m, is_fresh
from telemetry.flight.guided.orders import Place
from telemetry.flight.home_watch import ROSE_M, HomePlace, home_of, is_within, spare_up_m
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.requests import FlyWay, StartGuided, TakeUp
from telemetry.topics.vehicle import VehicleState

BEGINS_M, STANDS_M_S = 1.0, 1.0
"""From where a way begins, and how fast, the vehicle may be: well within the following error of its certificate."""
OFF_THE_GROUND_M = 0.5
HOME_BESIDE_M, HOME_UP_M = 3.0, 2.0
"""What a standing receiver and barometer wander, as between the check and the start."""
HOME_FAR_M, HOME_LEVEL_M = 6.0, 0.3
"""However inaccurate the receiver is; and by how much a standing vehicle's height above home may be none."""
WAY_AGAIN, PLAN_AGAIN = "Ask for the way again.", "Take the plan up again."
HOME_SHOWS_S = 4.0
"""A vehicle that takes its home when it arms tells it at once, and again every two seconds."""
CALM_S = 2.0
"""So long nothing must stand against it before what was paused may go on: gusts push a hovering vehicle about."""


def why_moves(state: VehicleState, *, again: str = WAY_AGAIN) -> NotAllowedError | None:
    """Why no way can begin now: the vehicle would be elsewhere before it is certified. ``again``: what to do then."""
    speed_m_s = math.hypot(state.ground_speed_m_s or 0.0, state.climb_m_s or 0.0)
    if speed_m_s <= STANDS_M_S:
        return None
    what = f"The vehicle moves at {speed_m_s:.1f} m/s: a way is certified from where it hovers."
    return NotAllowedError(what, advice=f"Hold. {again}")


def why_not_gone_on(begins: TakeUp, state: VehicleState, now_s: float) -> NotAllowedError | None:
    """``why_not_from`` of a plan that waits. It is shown all the while: without figures, and in the same words for
    what gusts change all the while."""
    if (refusal := why_not_from(begins, state, now_s)) is None:
        return None
    if not (state.armed and is_in_the_air(state)):
        return refusal
    if _why_other_home(begins, state) is not None:
        what = "Home lies elsewhere than the plan was certified for, or is not told."
        return NotAllowedError(what, advice=PLAN_AGAIN)
    what = "The vehicle moves, or is away from where the certified way begins."
    return NotAllowedError(what, advice=f"{PLAN_AGAIN} A gust passes by itself.")


class Steady:
    """A refusal that is shown: at once when it comes, and as it was for ``CALM_S`` at least."""

    def __init__(self) -> None:
        self._shown: NotAllowedError | None = None
        self._since_s = self._refused_s = -math.inf

    def shown(self, refusal: NotAllowedError | None, now_s: float) -> NotAllowedError | None:
        """``refusal``: of now."""
        if refusal is not None:
            self._refused_s = now_s
        is_due = now_s - (self._since_s if refusal is not None else self._refused_s) >= CALM_S
        if (self._shown is None and refusal is not None) or (is_due and str(refusal) != str(self._shown)):
            self._shown, self._since_s = refusal, now_s
        return self._shown


def why_not_from(request: StartGuided | FlyWay | TakeUp, state: VehicleState, now_s: float) -> NotAllowedError | None:
    """A mission's script begins on the ground; a certified way in the air, at rest, where it was certified."""
    again = PLAN_AGAIN if isinstance(request, TakeUp) else WAY_AGAIN
    if isinstance(request, StartGuided):
        return _why_not_up(request, state, now_s)
    if not (state.armed and is_in_the_air(state)):
        return NotAllowedError("The vehicle is not in the air.", advice="Take off first.")
    if (refusal := why_moves(state, again=again)) is not None:
        return refusal
    if (refusal := _why_other_home(request, state)) is not None:
        return refusal
    begins = Place(request.begins_lat_deg, request.begins_lon_deg, request.begins_alt_rel_home_m, math.nan)
    return _why_not_at(begins, state, now_s, again)


def _why_other_home(request: FlyWay | TakeUp, state: VehicleState) -> NotAllowedError | None:
    """Looked at in the last place before the vehicle: who judged it may not have heard of that home yet."""
    if request.home is None:
        return None
    home = home_of(state)
    advice = f"{PLAN_AGAIN if isinstance(request, TakeUp) else WAY_AGAIN} It is certified anew for home as it is."
    if home is None:
        return NotAllowedError("The vehicle does not tell its home, for which this was certified.", advice=advice)
    up_m = min(ROSE_M, spare_up_m(request.spare_m if isinstance(request, FlyWay) else None))
    if is_within(home, request.home, up_m):
        return None
    away_m = apart_m((request.home.lat_deg, request.home.lon_deg), (home.lat_deg, home.lon_deg))
    far_m = math.hypot(away_m, home.alt_amsl_m - request.home.alt_amsl_m)
    return NotAllowedError(f"Home was moved by {far_m:.1f} m since this was certified.", advice=advice)


def _why_not_up(request: StartGuided, state: VehicleState, now_s: float) -> NotAllowedError | None:
    if state.armed and state.landed == "in_air":
        return NotAllowedError("The vehicle is already flying.", advice="Land it, then start again.")
    lat_deg, lon_deg = request.begins_lat_deg, request.begins_lon_deg
    if lat_deg is None or lon_deg is None:
        return None
    # It stands: its height is that of home, whatever it tells before it arms.
    up_m = math.nan if state.alt_rel_home_m is None else state.alt_rel_home_m
    return _why_not_at(Place(lat_deg, lon_deg, up_m, math.nan), state, now_s, WAY_AGAIN)


def _why_not_at(begins: Place, state: VehicleState, now_s: float, again: str) -> NotAllowedError | None:
    off_m = away_m(state, begins) if is_fresh(state, now_s) else math.inf
    if not off_m <= BEGINS_M:
        where = f"{off_m:.1f} m from" if math.isfinite(off_m) else "not known to be"
        what = f"The vehicle is {where} where the certified way begins."
        return NotAllowedError(what, advice=f"{again} It is certified anew from there.")
    return None


def home_elsewhere(state: VehicleState) -> NotAllowedError | None:
    """Home that was fixed by an order does not go with the vehicle when it arms: what was checked for where it stands
    would be flown at other heights, and return elsewhere. None: it is here, or not told."""
    if None in (state.home_lat_deg, state.home_lon_deg, state.lat_deg, state.lon_deg):
        return None
    home, at = (state.home_lat_deg or 0.0, state.home_lon_deg or 0.0), (state.lat_deg or 0.0, state.lon_deg or 0.0)
    away_m = apart_m(home, at)
    advice = "Set home here (Fly, Home), or restart the vehicle; then check again."
    if not away_m <= min(HOME_FAR_M, HOME_BESIDE_M + 2 * (state.horizontal_accuracy_m or 0.0)):
        what = f"Home lies {away_m:.0f} m from where the vehicle stands: an order has fixed it there."
        return NotAllowedError(what, advice=advice)
    up_m = state.alt_rel_home_m or 0.0
    # One that climbs already is above home because of that.
    if state.landed not in ("taking_off", "in_air") and not abs(up_m) <= HOME_LEVEL_M:
        side = "above" if up_m > 0 else "below"
        what = f"The vehicle stands {abs(up_m):.1f} m {side} home by its own word: every height would be off by that."
        return NotAllowedError(what, advice=advice)
    return None


def is_off_the_ground(state: VehicleState) -> bool:
    """By its own word, else by its height above home."""
    if state.landed is None:
        return (state.alt_rel_home_m or 0.0) > OFF_THE_GROUND_M
    return state.landed in ("taking_off", "in_air")


def check_stands_there(state: VehicleState, wanted: HomePlace, now_s: float) -> None:
    """A start is checked for home where the vehicle stands: elsewhere it is not set on the ground.

    Raises NotAllowedError.
    """
    if state.lat_deg is None or state.lon_deg is None or state.alt_amsl_m is None or not is_fresh(state, now_s):
        raise NotAllowedError("Where the vehicle stands is not known.", advice="Wait for its position.")
    away_m = apart_m((state.lat_deg, state.lon_deg), (wanted.lat_deg, wanted.lon_deg))
    up_m = wanted.alt_amsl_m - state.alt_amsl_m
    if not (away_m <= HOME_BESIDE_M and abs(up_m) <= HOME_UP_M):
        what = (
            f"That home is {away_m:.1f} m beside and {abs(up_m):.1f} m {'above' if up_m > 0 else 'below'} the vehicle."
        )
        raise NotAllowedError(what, advice="On the ground home is set where the vehicle stands; elsewhere in the air.")
