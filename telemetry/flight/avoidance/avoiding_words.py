"""What avoidance says of itself: its state and one short line for the operator."""

from __future__ import annotations

from dataclasses import dataclass

from telemetry.flight.regions import FASTER_M_S
from telemetry.obstacles import AvoidanceStatus, Eye

if TYPE_CHECKING:
    from telemetry.flight.avoiding import Avoiding
    from telemetry.flight.regions import Sight

State = AvoidanceStatus.__annotations__["state"]
SENSOR_WORDS = {"radar": "radar", "vision": "vision", "ranges": "range sensors"}


def status_of(avoiding: Avoiding, now_s: float) -> AvoidanceStatus:
    largest_m_s = avoiding.largest_speed_m_s(now_s)
    return AvoidanceStatus(
        enabled=avoiding.enabled and not avoiding.released,
        state=_state(avoiding, now_s),
        text=avoiding.failed or _text(avoiding, now_s, largest_m_s),
        height_offset_m=round(avoiding.detour.offset_m, 2),
        largest_speed_m_s=None if largest_m_s is None else round(largest_m_s, 1),
        sensors=avoiding.regions.counted(now_s),
        eyes=_eyes(avoiding, now_s),
        by=avoiding.by,
    )


def _eyes(avoiding: Avoiding, now_s: float) -> tuple[Eye, ...]:
    regions = avoiding.regions
    return tuple(
        Eye(
            sight.sensor,
            round(sight.since_s, 1),
            sight.depth_m,
            round(regions.stopping(sight).largest_speed_m_s(sight.depth_m), 1),
        )
        for sight in regions.eyes(now_s)
    )


def _state(avoiding: Avoiding, now_s: float):
    detour = avoiding.detour
    if avoiding.released:
        return "released"
    if not detour.is_engaged:
        if not avoiding.enabled:
            return "off"
        return "watching" if avoiding.regions.eyes(now_s) else "blind"
    if detour.phase in ("holding", "ceiling"):
        return detour.phase
    if detour.is_manoeuvre or detour.phase == "aside":
        return "holding" if detour.aside.why and not detour.is_manoeuvre else "manoeuvre"
    return "offset" if detour.phase in ("going", "ending") else "climbing"


def _text(avoiding: Avoiding, now_s: float, largest_m_s: float | None) -> str:
    detour = avoiding.detour
    if avoiding.released:
        return f"{avoiding.released} Avoidance is off for this flight."
    if detour.is_engaged:
        return _engaged_text(avoiding, now_s)
    if not avoiding.enabled:
        return ""
    if avoiding.cannot:
        return "Something is in the way, but what is flown now is nothing that avoidance can go on with."
    if avoiding.by == "sidestep" and (why := avoiding.detour.aside.why_not(now_s)):
        return why
    slowest = avoiding.regions.slowest(now_s)
    if slowest is None:
        if avoiding.regions.eyes(now_s):
            return ""
        return "No sensor sees ahead: nothing brakes by itself."
    return _speed_words(avoiding, *slowest)


def _speed_words(avoiding: Avoiding, sight: Sight, largest_m_s: float) -> str:
    """Why it is, or was made, no faster than its sensors see."""
    speed_m_s = avoiding.state.ground_speed_m_s or 0.0 if avoiding.state else 0.0
    sees = f"the {SENSOR_WORDS[sight.sensor]} sees {sight.depth_m:g} m ahead"
    if speed_m_s > largest_m_s + FASTER_M_S:
        return f"Too fast to stop, {sees}: {speed_m_s:.1f} m/s, at most {largest_m_s:.1f} m/s."
    if avoiding.slowed_to_m_s is not None:
        return f"Slowed to {avoiding.slowed_to_m_s:.1f} m/s: {sees}."
    return ""


def _engaged_text(avoiding: Avoiding, now_s: float) -> str:
    detour = avoiding.detour
    if detour.phase == "holding":
        return detour.why
    if detour.phase == "aside":
        return detour.aside.why or "Steps aside past what is on its way, then goes on along the mission."
    if detour.phase == "ceiling":
        return "Still not clear at the highest allowed height: it holds. Return home or take over."
    if detour.phase in ("going", "ending"):
        if detour.is_manoeuvre:
            return "On the way past it."
        if detour.offset_m:
            return f"Goes on {detour.offset_m:.1f} m higher than planned."
        return (
            "Goes on at its proper height, certified past what was seen." if detour.came_down else "Goes on in GUIDED."
        )
    seen = avoiding.regions.occupied(now_s)
    what = f"{SENSOR_WORDS[seen[0].sensor]}, {seen[0].distance_m or 0.0:.0f} m ahead" if seen else ""
    if detour.phase in ("stopping", "taking"):
        return f"Braking: {what}." if what else "Braking."
    if detour.phase == "backing":
        return "Goes back: it is too near to see what is in the way."
    if what or detour.phase != "levelling":
        return f"Climbing: {what or 'until it has been seen to be clear'}."
    return "Climbing: clear, it levels off."
