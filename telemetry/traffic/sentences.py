"""Traffic in the words that pilots use."""

from __future__ import annotations

from telemetry.topics.traffic import GONE_S, OLD_S, Aircraft

ADVICE = "Give way: hold, descend or land, as you decide."
FAR_OFF_S = 600.0
"""A closest approach that is later is not told."""


def traffic_sentence(it: Aircraft, nose_deg: float | None) -> str:
    """ "Traffic DEABC, 2 o'clock, 1.2 km, 80 m above, closing, 35 s", without its full stop."""
    where = [f"Traffic {it.name}", _clock(it, nose_deg)]
    if it.distance_m is not None:
        where.append(distance_words(it.distance_m))
    where.append(height_words(it))
    if it.closing_m_s is None:
        where.append("course unknown")
    elif it.closing_m_s > 0 and it.closest_in_s is not None:
        where.append("closing" if it.closest_in_s > FAR_OFF_S else f"closing, {it.closest_in_s:.0f} s")
    else:
        where.append("going away")
    if it.age_s > OLD_S:
        where.append(f"heard {it.age_s:.0f} s ago")
    if it.emergency:
        where.append("in an emergency")
    return ", ".join(part for part in where if part)


def clear_sentence(it: Aircraft) -> str:
    away = "" if it.distance_m is None else f", {distance_words(it.distance_m)} away"
    return f"Traffic {it.name}: clear{away}."


def gone_sentence(it: Aircraft) -> str:
    return f"Traffic {it.name}: not heard for {GONE_S:.0f} s. It may still be there: look out."


def same_sentence(it: Aircraft, other: Aircraft) -> str:
    return f"Traffic {it.name}: the same aircraft as {other.name}."


def distance_words(distance_m: float) -> str:
    if distance_m < 995.0:
        return f"{10 * round(distance_m / 10)} m"
    return f"{distance_m / 1000:.1f} km" if distance_m < 9_950.0 else f"{distance_m / 1000:.0f} km"


def height_words(it: Aircraft) -> str:
    """With how wrong it may be, where that could turn above into below."""
    if it.height_m is None:
        return "height unknown"
    side = "above" if it.height_m >= 0 else "below"
    words = f"{10 * round(abs(it.height_m) / 10)} m {side}"
    if it.height_within_m < abs(it.height_m):
        return words
    reason = {"pressure": "by pressure", "gnss": "datum not told"}.get(it.alt_datum, "uncertain")
    return f"{words} ({reason}, within {10 * round(it.height_within_m / 10)} m)"


def _clock(it: Aircraft, nose_deg: float | None) -> str:
    if it.bearing_deg is None:
        return ""
    if nose_deg is None:
        return f"bearing {round(it.bearing_deg) % 360:03d}"
    return f"{round((it.bearing_deg - nose_deg) / 30.0) % 12 or 12} o'clock"
