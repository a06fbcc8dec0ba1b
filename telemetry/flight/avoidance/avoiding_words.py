"""What avoidance says of itself: its state and one short line for the operator."""

from __future__ import annotations

from dataclasses import dataclass

from telemetry.flight.avoidance.detour import Detour
from telemetry.flight.avoidance.regions import FASTER_M_S, OLD_S, SENSOR_WORDS, Regions, Sight
from telemetry.topics.obstacles import AvoidanceStatus, AvoidBy, Eye


@dataclass(frozen=True, slots=True)
class Now:
    """What there is to tell at ``t_s``. ``released``: by whom; ``failed``: what the vehicle would not do."""

    t_s: float
    enabled: bool
    by: AvoidBy
    released: str
    failed: str
    cannot: bool
    """Something is in the way of a flight that it could not go on with."""
    speed_m_s: float
    slowed_to_m_s: float | None
    slowed_as_late: bool = False
    fence_unread: str = ""
    """What is not known of the fence on board besides its shapes."""


def status_of(now: Now, regions: Regions, detour: Detour) -> AvoidanceStatus:
    slowest = regions.slowest(now.t_s)
    return AvoidanceStatus(
        enabled=now.enabled and not now.released,
        state=_state(now, regions, detour),
        text=now.failed or _text(now, regions, detour),
        height_offset_m=round(detour.offset_m, 2),
        largest_speed_m_s=None if slowest is None else round(slowest[1], 1),
        sensors=regions.counted(now.t_s),
        eyes=_eyes(regions, now.t_s),
        by=now.by,
    )


def _eyes(regions: Regions, now_s: float) -> tuple[Eye, ...]:
    return tuple(
        Eye(
            sight.sensor,
            round(sight.since_s, 1),
            sight.depth_m,
            round(regions.stopping(sight).largest_speed_m_s(sight.depth_m), 1),
            is_late=sight.is_late,
        )
        for sight in regions.eyes(now_s)
    )


def _state(now: Now, regions: Regions, detour: Detour):
    if now.released:
        return "released"
    if not detour.is_engaged:
        if not now.enabled:
            return "off"
        return "watching" if regions.eyes(now.t_s) else "blind"
    if detour.phase in ("holding", "ceiling"):
        return detour.phase
    if detour.is_manoeuvre or detour.phase == "aside":
        return "holding" if detour.aside.why and not detour.is_manoeuvre else "manoeuvre"
    return "offset" if detour.phase in ("going", "ending") else "climbing"


def _text(now: Now, regions: Regions, detour: Detour) -> str:
    if now.released:
        return f"{now.released} Avoidance is off for this flight."
    if detour.is_engaged:
        return _engaged_text(regions, detour, now.t_s)
    if not now.enabled:
        return ""
    if now.cannot:
        return "Something is in the way, but what is flown now is nothing that avoidance can go on with."
    if now.by == "sidestep" and (why := detour.aside.why_not(now.t_s)):
        return why
    slowest = regions.slowest(now.t_s)
    if slowest is None:
        if regions.eyes(now.t_s):
            return _fence_words(now, detour)
        return "No sensor sees ahead: nothing brakes by itself."
    return " ".join(filter(None, (_speed_words(now, *slowest), _late_words(now, regions)))) or _fence_words(now, detour)


def _fence_words(now: Now, detour: Detour) -> str:
    if unknown := detour.fence.unknown:
        what = "it" if now.fence_unread else "its shapes"
        return f"The fence on board {unknown}: no way of avoidance is held against {what}."
    return f"{now.fence_unread}: no way of avoidance is held against that." if now.fence_unread else ""


def _speed_words(now: Now, sight: Sight, largest_m_s: float) -> str:
    """Why it is, or was made, no faster than its sensors see."""
    sees = f"the {SENSOR_WORDS[sight.sensor]} sees {sight.depth_m:g} m ahead"
    if now.speed_m_s > largest_m_s + FASTER_M_S:
        return f"Too fast to stop, {sees}: {now.speed_m_s:.1f} m/s, at most {largest_m_s:.1f} m/s."
    if now.slowed_to_m_s is not None:
        return f"Slowed to {now.slowed_to_m_s:.1f} m/s: {sees}{', and came late' if now.slowed_as_late else ''}."
    return ""


def _late_words(now: Now, regions: Regions) -> str:
    who = " and ".join(SENSOR_WORDS[sight.sensor] for sight in regions.eyes(now.t_s) if sight.is_late)
    does = "It brakes that much later, and then holds; end what else runs here."
    return f"{who.capitalize()}: over {OLD_S:g} s late. {does}" if who else ""


def _engaged_text(regions: Regions, detour: Detour, now_s: float) -> str:
    if detour.phase == "holding":
        return detour.why
    if detour.phase == "aside":
        return detour.aside.why or "Steps aside past what is on its way, then goes on along the mission."
    if detour.phase == "ceiling":
        where = "below the ceiling of its fence" if detour.is_below_fence else "at the highest allowed height"
        return f"Still not clear {where}: it holds. Return home or take over."
    if detour.phase in ("going", "ending"):
        if detour.is_manoeuvre:
            return "On the way past it."
        if detour.offset_m:
            return f"Goes on {detour.offset_m:.1f} m higher than planned."
        return (
            "Goes on at its proper height, certified past what was seen." if detour.came_down else "Goes on in GUIDED."
        )
    seen = regions.occupied(now_s)
    what = f"{SENSOR_WORDS[seen[0].sensor]}, {seen[0].distance_m or 0.0:.0f} m ahead" if seen else ""
    if detour.phase in ("stopping", "taking"):
        return f"Braking: {what}." if what else "Braking."
    if detour.phase == "backing":
        return "Goes back: it is too near to see what is in the way."
    if what or detour.phase != "levelling":
        return f"Climbing: {what or 'until it has been seen to be clear'}."
    return "Climbing: clear, it levels off."
