"""Places and directions as the command line gives them."""

from __future__ import annotations

from typing import Literal

from planning.errors import ParameterError

Heading = Literal["path", "fixed", "point"]


def parse_place(text: str | None, option: str) -> tuple[float, float] | None:
    """ "LAT,LON" in degrees; None stays None."""
    if text is None:
        return None
    try:
        lat_deg, lon_deg = (float(part) for part in text.split(","))
    except ValueError:
        raise ParameterError(
            f"{text!r} is no place.", where=option, advice="Give LAT,LON in degrees, such as -37.1245,175.6893."
        ) from None
    if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
        raise ParameterError(
            f"{text!r} lies outside the range of degrees.", where=option, advice="Give the latitude first."
        )
    return lat_deg, lon_deg


def chosen_heading(heading: Heading | None, heading_deg: float | None, look_at: tuple[float, float] | None) -> Heading:
    """What the nose points at; a direction or a point alone says it already.

    Raises ParameterError when the options contradict each other or one is missing.
    """
    implied = {"fixed": heading_deg is not None, "point": look_at is not None}
    chosen: Heading = heading or ("fixed" if implied["fixed"] else "point" if implied["point"] else "path")
    for kind, option in (("fixed", "--heading-deg"), ("point", "--look-at")):
        if (chosen == kind) != implied[kind]:
            what = f"The heading {chosen!r} " + (f"needs {option}." if chosen == kind else f"takes no {option}.")
            raise ParameterError(what, where=option, advice=f"Give {option} with --heading {kind}, and only then.")
    return chosen
