"""Other aircraft as they travel on the bus: who is told of over a vehicle's link, and which of them come too near."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

TrafficSource = Literal["adsb", "remote_id", "utm"]
HeightDatum = Literal["ellipsoid", "gnss", "pressure", "unknown"]
"""ellipsoid: above the WGS84 ellipsoid; gnss: of a satellite receiver, above the sea or the ellipsoid, which is left
open; pressure: of a barometer, whatever pressure it was set to; unknown: not told, or told to be invalid."""
Trust = Literal["other", "own", "echo"]
"""own: by its number it is this vehicle; echo: it has been where this vehicle is ever since it was first heard."""

GONE_S = 60.0
"""An aircraft whose last position is older goes from the list: nobody can say any more where it is."""
OLD_S = 5.0
"""A position that is older is shown as old."""


@dataclass(frozen=True, slots=True)
class TrafficSettings:
    """Which traffic is shown, and of which the pilot is warned. The warning's defaults are those of UgCS."""

    warn_distance_m: float = 9_260.0
    """5 NM, as seen from above."""
    warn_height_m: float = 300.0
    """Above or below."""
    look_ahead_s: float = 60.0
    show_distance_m: float = 37_040.0
    """20 NM"""
    show_height_m: float = 3_000.0
    """Above or below; what is warned of is shown in any case."""
    own_icao: str = ""
    """Of the vehicle's own transponder: six hexadecimal digits; empty: it has none, or nobody has said."""
    own_id: str = ""
    """The vehicle's own remote id, or its id in UTM."""


@dataclass(frozen=True, slots=True)
class Aircraft:
    """One other aircraft, where it should be by now."""

    key: str
    """Source and number, such as "adsb 4b1805"; of one that is heard by ADS-B and by remote ID, its ADS-B's."""
    source: TrafficSource
    name: str
    """Callsign or id as it was sent; its number where it sent none."""
    kind: str
    """In words: "light", "helicopter" ...; empty: not told."""
    trust: Trust
    on_ground: bool
    """By its own account."""
    emergency: bool
    """By its own account: squawk 7500, 7600 or 7700, or its state."""
    lat_deg: float
    lon_deg: float
    """Led on with its last velocity."""
    age_s: float
    """Of the last position, the receiver's delay counted in."""
    within_m: float
    """It may be so far from there: its own error, and what it may have turned since."""
    velocity_enu_m_s: tuple[float, float] | None
    """East and north, over ground; None: unknown."""
    climb_m_s: float | None
    alt_m: float | None
    """As it was sent."""
    alt_datum: HeightDatum
    distance_m: float | None = None
    """As seen from above; None, as what follows, while the vehicle's own position is unknown."""
    bearing_deg: float | None = None
    """Clockwise from true north."""
    height_m: float | None = None
    """Above the vehicle; None: unknown, and it counts as being at the vehicle's own height."""
    height_within_m: float = 0.0
    """So wrong that height may be, most of it because the heights count from different levels."""
    closing_m_s: float | None = None
    """How fast the distance shrinks; None: a velocity is unknown."""
    closest_m: float | None = None
    """Distance at the closest approach, if both go on as they do."""
    closest_in_s: float | None = None
    """0: it is not getting nearer."""
    conflict: bool = False
    """It may come too near within the look-ahead, at the worse end of all that is not known."""
    operator_deg: tuple[float, float] | None = None
    """Latitude and longitude of who flies it, from its remote id."""


@dataclass(frozen=True, slots=True)
class TrafficStatus:
    """Of one vehicle, once a second, and when a warning begins or ends."""

    state: Literal["watching", "no_position"]
    """no_position: where the vehicle itself is, is not known: nothing is held against it."""
    text: str
    """What is wrong and what to do; empty while watching."""
    t_mono_s: float
    t_utc_s: float
    heard: int = 0
    """Aircraft that are kept, this vehicle's own included."""
    aircraft: tuple[Aircraft, ...] = ()
    """Those that are shown: who may come too near first, then the nearest."""
    hidden: int = 0
    """Beyond the 64 that are told."""
    filtered: int = 0
    """Left out because of their distance or height."""
    crowded_out: int = 0
    """Heard lately, and not kept because nearer ones filled the memory; 1,000 may be more."""
    settings: TrafficSettings = field(default_factory=TrafficSettings)
    """By which this was judged."""
