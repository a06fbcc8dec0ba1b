"""Traversability: where ground can be driven on, what of it a UWB radar has shown to be foliage, and where to land."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mapping.uwb.uwb_params import Rule, UwbGeometry, UwbParams, of_rule
from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Asked, Strict

_UWB = UwbParams()
LayerName = Literal["before", "cleared", "probability", "time_in_view"]


class LandingSiteDoc(Strict):
    """A place to land, best first."""

    rank: int
    lat_deg: float
    lon_deg: float
    alt_dsm_m: float
    distance_m: float
    """From the point that was asked about."""
    slope_deg: float
    """Largest within the touchdown circle."""
    roughness_m: float
    obstacle_distance_m: float
    """To the nearest untraversable cell of the map BEFORE clearing."""
    reasons: list[str]
    """For the pilot, such as "Slope 3.1 deg" and "6.4 m from the nearest obstacle"."""


class UwbLiveDoc(Strict):
    """A UWB radar whose scans come in now."""

    state: Literal["none", "live", "silent"] = "none"
    source: str = ""
    """The agent that sends them."""
    silent_s: int = 0
    """So long nothing has come, where it is silent."""
    scans: int = 0
    """Since it began; those with a place."""
    per_s: float = 0.0
    unplaced: int = 0
    """Left out: where the vehicle was then is not known."""
    other_geometry: int = 0
    """Left out: they lie otherwise in range than the first one."""
    is_full: bool = False
    """No more are taken until the maps are put away."""
    problem: str = ""
    """Why they could not be fused; empty: they were."""
    rule: str = ""


class TraversabilityState(Strict):
    """Of the open surface model; everything is 0 or empty until it has been worked out."""

    state: Literal["none", "working", "ready", "failed"] = "none"
    text: str = ""
    """What is being done, or what the map says in one line."""
    error: ErrorDoc | None = None
    terrain_id: str = ""
    resolution_m: float = 0.0
    cells: int = 0
    """That are known."""
    untraversable: int = 0
    """Before clearing."""
    cleared: int = 0
    """Of those, shown to be soft vegetation by the radar: a rover may pass, a rotor may not touch."""
    seen: int = 0
    """Cells that were in the radar's view for more than 2 s."""
    uwb_log: str = ""
    """Name of the radar log that cleared it; empty: none."""
    uwb_rule: str = ""
    """How it was fused, and with which numbers."""
    uwb_left_out: str = ""
    """Which of its scans count for nothing, and why; empty: all count."""
    scans: int = 0
    legend: list[str] = Field(default_factory=list)
    """What the colours of the layer on show mean, from the lowest to the highest."""
    legend_colors: list[str] = Field(default_factory=list)
    """Of each of them, as "#3a2a78"."""
    sites_near: tuple[float, float] | None = None
    """Latitude and longitude that landing sites were asked for."""
    sites: list[LandingSiteDoc] = Field(default_factory=list)
    no_site: str = ""
    """Why there is none, if one was asked for."""
    live: UwbLiveDoc = Field(default_factory=UwbLiveDoc)


class TraversabilityBody(Strict):
    """Works out the traversability of the open surface model."""

    resolution_m: Annotated[float, Field(ge=0.1, le=10), Asked(initial=UwbGeometry().bin_m)] | None = None
    """Of the grid; null: 0.3 m, or the model's own where that is coarser."""


class UwbRule(Strict):
    """How a radar log is fused; numbers that are left out are the paper's (Ahtiainen, section III)."""

    rule: Rule = "explained"
    """explained: an echo that a likely obstacle accounts for says little of other cells; paper: all are to blame."""
    p_o: Annotated[float, Field(gt=0.5, lt=1), Asked(0.51, 0.99, initial=_UWB.most_occupied)] | None = None
    p_c2: Annotated[float, Field(gt=0, lt=0.5), Asked(0.01, 0.49, initial=_UWB.free_before)] | None = None
    p_c3: Annotated[float, Field(gt=0, lt=0.5), Asked(0.01, 0.49, initial=_UWB.free_behind)] | None = None
    """At least P_C2; left out: 0.1 above it."""
    c_th: Annotated[float, Field(gt=0, le=100), Asked(min=0.5, initial=_UWB.least_headroom)] | None = None
    nearest_m: Annotated[float, Field(gt=0, le=50), Asked(min=0.5, initial=_UWB.nearest_m)] | None = None
    farthest_m: Annotated[float, Field(gt=0, le=100), Asked(min=1, initial=_UWB.farthest_m)] | None = None
    prior: Annotated[float, Field(gt=0.5, lt=1), Asked(0.51, 0.99, initial=_UWB.prior)] | None = None

    def params(self) -> UwbParams:
        """Raises ParameterError for numbers that contradict each other."""
        return of_rule(
            self.rule,
            most_occupied=self.p_o,
            free_before=self.p_c2,
            free_behind=self.p_c3,
            least_headroom=self.c_th,
            nearest_m=self.nearest_m,
            farthest_m=self.farthest_m,
            prior=self.prior,
        )


class LandingSitesBody(Strict):
    lat_deg: Annotated[float, Field(ge=-90, le=90)]
    lon_deg: Annotated[float, Field(ge=-180, le=180)]
    rotor_span_m: Annotated[float, Field(ge=0.1, le=10)] = 0.8
    """Across all rotors; sites keep twice as much from any obstacle."""
    radius_m: Annotated[float, Field(ge=5, le=2000)] = 150.0
    """So far from the point sites are looked for."""
