"""What an operator sets about moving and standing objects: how they are followed, and what velocities keep to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Literal, get_args

from mapping.errors import ParameterError
from mapping.radar.radar_params import OBJECT_SPEED_CELL_M_S, OBJECT_SPEED_CELLS
from mapping.tracking.tracker_params import TrackerParams
from planning.evading.velocity_choice import Limits

Choice = Literal["room", "edge"]
MOST_TRACKS = 400
USUAL_MAX_SPEED_M_S = 5.0
"""Of a vehicle of which nothing is known."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """As ``mapping.tracking.TrackerParams``, of which ``params`` makes them; the defaults are an AWR1843's."""

    coordinates: Literal["cartesian", "polar"] = "cartesian"
    """polar: range, bearing and their rates, as in Wessendorp 2021; cartesian: place and velocity over ground."""
    range_sigma_m: float = 0.15
    bearing_sigma_deg: float = 1.0
    bearing_edge_deg: float = 45.0
    """Farther off the nose the bearing's error is the next one."""
    bearing_edge_sigma_deg: float = 2.0
    radial_speed_sigma_m_s: float = 0.2
    radial_speed_folded_m_s: float = round(OBJECT_SPEED_CELLS * OBJECT_SPEED_CELL_M_S, 2)
    """Radial speeds that differ by this look the same; 0: none do."""
    extent_m: float = 0.6
    acceleration_m_s2: float = 2.0
    speed_m_s: float = 5.0
    detection_probability: float = 0.997
    gate: float = 11.345
    birth: float = 0.7
    birth_updates: int = 3
    death: float = 9.0
    apart_m: float = 0.75

    def params(self) -> TrackerParams:
        """Raises ParameterError for what no tracker can work with."""
        return TrackerParams(
            coordinates=self.coordinates,
            range_sigma_m=self.range_sigma_m,
            bearing_sigma_rad=math.radians(self.bearing_sigma_deg),
            bearing_edge_rad=math.radians(self.bearing_edge_deg),
            bearing_edge_sigma_rad=math.radians(self.bearing_edge_sigma_deg),
            radial_speed_sigma_m_s=self.radial_speed_sigma_m_s,
            radial_speed_folded_m_s=self.radial_speed_folded_m_s or math.inf,
            extent_m=self.extent_m,
            acceleration_m_s2=self.acceleration_m_s2,
            speed_m_s=self.speed_m_s,
            detection_probability=self.detection_probability,
            gate=self.gate,
            birth=self.birth,
            birth_updates=self.birth_updates,
            death=self.death,
            apart_m=self.apart_m,
            most=MOST_TRACKS,
        )


@dataclass(frozen=True, slots=True)
class VelocitySettings:
    """What a proposed or flown velocity keeps to (Wessendorp 2021, III-C, which prints no values)."""

    max_speed_m_s: float = 0.0
    """0: that of the vehicle whose plan is on board."""
    max_turn_deg: float = 180.0
    """From the present direction, to either side."""
    leave_m_s: float = 0.3
    """At which it goes away, at least, from what is nearer than it should be."""
    nearest_only: bool = False
    """As in the paper: only the nearest obstacle is looked at."""
    stands_m: float = 2.0
    """Kept from what stands still, between middles."""
    stands_s: float = 5.0
    """What stands still counts when it would be met within so long."""
    choice: Choice = "room"
    """Where the velocity nearest to the present one cannot be reached in time: the one that leaves the most room. edge:
    always the nearest on a cone's edge, as in the paper."""

    def limits(self, vehicle: Limits) -> Limits:
        """Those of the vehicle where nothing else is set. Raises ParameterError for what nothing can keep to."""
        if self.choice not in get_args(Choice):
            raise ParameterError(
                f'There is no choice "{self.choice}".',
                where="choice",
                advice=f"Choose of {', '.join(get_args(Choice))}.",
            )
        return Limits(
            max_speed_m_s=self.max_speed_m_s or vehicle.max_speed_m_s,
            max_turn_rad=math.radians(self.max_turn_deg),
            leave_m_s=self.leave_m_s,
        )


def with_figures(part: TrackerSettings | VelocitySettings, figures: Mapping[str, object]):
    """The same with other figures, given as text or as they are. Raises ParameterError, naming the figure."""
    known = {field.name: getattr(part, field.name) for field in fields(part)}
    made: dict[str, object] = {}
    for name, value in figures.items():
        if name not in known:
            raise ParameterError(f'There is no "{name}".', where=name, advice=f"Choose of {', '.join(known)}.")
        made[name] = _as_is(name, known[name], value)
    changed = replace(part, **made)  # type: ignore[arg-type]
    if isinstance(changed, TrackerSettings):
        changed.params()
    else:
        changed.limits(Limits())
    return changed


def unusual(tracker: TrackerSettings, velocities: VelocitySettings) -> tuple[str, ...]:
    """ "tracker.gate=9": all that is set otherwise than usual, as ``with_figures`` takes it."""
    parts = (("tracker", tracker, TrackerSettings()), ("velocities", velocities, VelocitySettings()))
    return tuple(
        f"{part}.{field.name}={_told(getattr(now, field.name))}"
        for part, now, usual in parts
        for field in fields(now)
        if getattr(now, field.name) != getattr(usual, field.name)
    )


def _told(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value).lower()


def _as_is(name: str, known: object, value: object) -> object:
    """Text as the kind of value that ``known`` is."""
    if isinstance(known, bool):
        if str(value).lower() in ("true", "false"):
            return str(value).lower() == "true"
        raise ParameterError(f'"{value}" is neither true nor false.', where=name, advice="Give one of them.")
    if isinstance(known, str):
        return str(value)
    try:
        number = float(str(value))
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= 0.0):
        raise ParameterError(f'"{value}" is no number to set it to.', where=name, advice="Give 0 or more.")
    if isinstance(known, int) and number != int(number):
        raise ParameterError(f'"{value}" is no whole number.', where=name, advice="Give one.")
    return int(number) if isinstance(known, int) else number
