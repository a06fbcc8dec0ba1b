"""Which vertical datums count as "above mean sea level".

A height above the ellipsoid taken for one above the sea is wrong by tens of metres, and so may be a height in
a datum nobody knows. Therefore a datum counts only when its name is known to be a geoid's or a levelling
network's; a tidal chart datum, a depth, an ellipsoid, "unknown" or a site's own datum does not.
"""

from __future__ import annotations

import re
from functools import lru_cache

_NOT_SEA_LEVEL = re.compile(
    r"ellipsoid|ellipsoïd|\bhae\b|\bdepths?\b|undulation|\bgeoid(al)? (height|separation)\b.*\babove\b"
    r"|\b(unknown|undefined|unnamed|unspecified|local|arbitrary|assumed|relative|custom|site|not|no|non)\b"
    r"|\b(agl|above ground|chart|low(est)?|high(est)?|tide|tidal|lat|hat|mllw|mlw|mhw|mhhw)\b"
)
_SEA_LEVEL = re.compile(
    r"\begm ?-?(84|96|08|20|2008|2020)\b|\bgeoid ?-?(96|99|03|06|09|12a|12b|12|18|2022)\b"
    r"|\b(usgg|gsigeo|ausgeoid|osgm|raf|dvr|dhhn|cgvd|navd|ngvd|evrf|evrs|nzvd|rh|igld|lhn)[ -]?(\d{2}|\d{4})[a-z]?\b"
    r"|\b(ahd|amsl|msl|orthometric|n2000|n60|nn2000|nn1954|nn54|ln02|nap|taw|mean sea level|m\.s\.l\.)\b"
    r"|\b(ordnance datum newlyn|odn|newlyn|normaal amsterdams peil|australian height datum|ngf-?ign ?69|ign69)\b"
)

_KNOWN_ELLIPSOID = re.compile(r"\b(wgs[ _-]?(19)?84|grs[ _-]?(19)?80)\b")


@lru_cache(maxsize=64)
def is_amsl(vertical_datum: str | None) -> bool:
    """Whether heights in this datum are known to be above mean sea level: a geoid or a levelling network.

    E.g. "EGM96 height", "NAVD88 height (ftUS)".
    """
    if vertical_datum is None:
        return False
    words = re.sub(r"[_\s]+", " ", vertical_datum.strip().lower())
    if _NOT_SEA_LEVEL.search(words):
        return False
    return bool(_SEA_LEVEL.search(words)) or _registered(vertical_datum.strip())


def _registered(name: str) -> bool:
    """Whether PROJ's registry knows a vertical system of this name whose heights grow upwards, no chart datum."""
    # Only here: the link node must be up in a moment, and most names are known above.
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        system = CRS.from_user_input(name)
    except CRSError:
        return False
    vertical = system.sub_crs_list[1] if system.is_compound else system
    return (
        vertical.is_vertical
        and not _NOT_SEA_LEVEL.search(vertical.name.lower())
        and all(axis.direction == "up" for axis in vertical.axis_info)
    )


def datums_differ(one: str | None, other: str | None) -> bool:
    """Whether both are named and name different datums: "NAVD88 height (ftUS)" is that of "NAVD88"."""
    return bool(one and other) and _datum(str(one)) != _datum(str(other))


def is_same_ellipsoid(one: str, other: str) -> bool:
    """Whether both are of an ellipsoid that is named and known: WGS 84 and GRS 80 lie within a millimetre."""
    return all("ellipsoid" in name.lower() and _KNOWN_ELLIPSOID.search(name.lower()) for name in (one, other))


def _datum(name: str) -> str:
    """The datum's own name where the registry knows it, else the name's words without those that tell nothing."""
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    for known in (name.strip(), f"{name.strip()} height"):
        try:
            system = CRS.from_user_input(known)
        except CRSError:
            continue
        vertical = system.sub_crs_list[1] if system.is_compound else system
        if vertical.is_vertical and vertical.datum:
            return _plain(vertical.datum.name)
    return "ellipsoid" if "ellipsoid" in name.lower() else _plain(name)


def _plain(name: str) -> str:
    words = re.sub(r"\(.*?\)|[_\s-]+", " ", name.lower())
    return re.sub(r"\b(geoid(al)?|orthometric|heights?|above)\b|\s+", "", words)
