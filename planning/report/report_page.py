"""The printable report of a plan: one HTML page with figures, without script, that loads nothing."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from mapping.version import __version__
from planning.basics.plan_model import FlownLine, Mission, SampledPath, SurfaceParams, Timing, VehicleProfile
from planning.certificate.certificate_model import Certificate, LegClearance
from planning.formats.commands import home_altitude_note
from planning.formats.safe_text import clean_name
from planning.margins.budget import SUM_RULE
from planning.margins.words import is_by_hand, tube_words
from planning.missions.feasibility import Feasibility, verdict_words
from planning.report.figures.curves import altitude_profile, clearance_trend, speed_chart, time_chart
from planning.report.figures.plan_view import plan_view
from planning.report.words import COMMAND_NAMES, assumption_rows, duration, metres, metres_up
from planning.route.survey_coverage import SurveyCoverage
from planning.terrain.dsm import Dsm

TIGHTEST_LEGS = 8


@dataclass(frozen=True, slots=True)
class TradeRow:
    """What another number of waypoints would have cost or gained."""

    waypoints: int
    excess_height_m: float
    """How far the flown lines run above the sampled profile at most."""
    duration_s: float
    chosen: bool = False


@dataclass(frozen=True, slots=True)
class ReportInput:
    """Everything the report shows; made by the planner, nothing is computed anew but figures."""

    title: str
    dsm: Dsm
    path: SampledPath
    timing: Timing
    mission: Mission
    """Its home and POIs are the report's."""
    line: FlownLine
    certificate: Certificate
    profile: VehicleProfile
    surface: SurfaceParams
    feasibility: Feasibility
    predicted_duration_s: float
    """With the autopilot's corner behaviour, take-off and return."""
    max_items: int
    created_utc: str
    """As it shall be printed."""
    gsd_cm: float | None = None
    """Achieved ground sampling distance; None without a camera."""
    coverage: SurveyCoverage | None = None
    """What a survey's photos see."""
    trade: Sequence[TradeRow] = ()
    warnings: Sequence[str] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    """Computing time per step."""
    version: str = __version__


def render_report(plan: ReportInput) -> str:
    """The report as one HTML page.

    All text is escaped by the template engine; only our own SVG is inserted as markup. A content
    security policy forbids scripts and anything loaded from elsewhere.
    """
    figures = {
        "map": plan_view(plan.dsm, plan.line, plan.certificate, plan.mission.pois),
        "profile": altitude_profile(plan.path, plan.line, plan.certificate, plan.mission.pois),
        "trend": clearance_trend(plan.certificate),
        "speed": speed_chart(plan.path, plan.timing),
        "time": time_chart(plan.path, plan.timing),
    }
    return (
        _environment()
        .get_template("report.html.jinja")
        .render(
            plan=plan,
            title=clean_name(plan.title) or "Mission",
            figures={name: Markup(svg) for name, svg in figures.items()},
            tiles=_tiles(plan),
            certificate_rows=_certificate_rows(plan),
            assumptions=assumption_rows(plan.certificate.assumptions),
            term_rows=_term_rows(plan.certificate),
            verdict=verdict_words(certified=plan.certificate.certified, feasible=plan.feasibility.feasible),
            tube=tube_words(plan.certificate.following_m, plan.certificate.min_distance_m),
            legs=_tightest(plan.certificate.legs),
            mission_rows=_mission_rows(plan),
            parameter_rows=_parameter_rows(plan),
            pois=[(clean_name(p.name), p) for p in plan.mission.pois],
            home_note=home_altitude_note(plan.mission.home),
        )
    )


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"metres": metres, "metres_up": metres_up, "duration": duration}
    return environment


def _tiles(plan: ReportInput) -> list[tuple[str, str, str, bool]]:
    """The key figures: (caption, value, remark, whether it is a concern)."""
    certificate, profile = plan.certificate, plan.profile
    usable_s = profile.usable_endurance_s
    items, need, rtl_m = len(plan.mission.items), certificate.required_clearance_m, certificate.rtl_height_needed_m
    tiles = [
        (
            "Smallest distance",
            metres(certificate.min_distance_m),
            f"required {metres_up(need)}",
            certificate.min_distance_m < need,
        ),
        (
            "Height above",
            metres(certificate.min_vertical_m),
            "straight down",
            certificate.min_vertical_m < need,
        ),
        (
            "Return height",
            metres_up(rtl_m, 1),
            f"set to {metres(profile.rtl_height_m, 1)}",
            rtl_m > profile.rtl_height_m,
        ),
        ("Length", metres(float(plan.path.s_m[-1]), 0), f"{len(plan.path.s_m)} samples", False),
        (
            "Duration",
            duration(plan.predicted_duration_s),
            f"usable {duration(usable_s)}",
            any(row.code == "battery" for row in plan.feasibility.failures),
        ),
        ("Mission items", str(items), f"limit {plan.max_items}", items > plan.max_items),
    ]
    if plan.gsd_cm is not None:
        tiles.append(("Ground sampling", f"{plan.gsd_cm:.2f} cm", "per pixel", False))
    return tiles + ([] if plan.coverage is None else _photo_tiles(plan.coverage))


def _photo_tiles(coverage: SurveyCoverage) -> list[tuple[str, str, str, bool]]:
    """Shares are rounded down, as clearances are."""

    def least(share: float) -> str:
        return f"{math.floor(max(0.0, share) * 100 + 1e-6)} %"

    faulty = bool(coverage.faults())
    asked = f"{coverage.asked_front_overlap:.0%} and {coverage.asked_side_overlap:.0%} asked"
    return [
        (
            "Photographed twice",
            least(coverage.twice_share),
            f"of {coverage.area_m2:,.0f} m², {coverage.photos} photos",
            faulty,
        ),
        (
            "Overlap",
            f"{least(coverage.front_overlap)}, {least(coverage.side_overlap)}",
            f"front, side; {asked}",
            faulty,
        ),
    ]


def _certificate_rows(plan: ReportInput) -> list[tuple[str, str, bool | None]]:
    """(statement, figures, whether it holds; None: for information)."""
    c, rtl_set_m = plan.certificate, plan.profile.rtl_height_m
    place = f"{c.worst.lat_deg:.7f}°, {c.worst.lon_deg:.7f}°, {metres(c.worst.alt_rel_home_m)} above home"
    return [
        (
            "Distance to the surface model along the whole flown line",
            f"at least {metres(c.min_distance_m)}, required {metres_up(c.required_clearance_m)}",
            c.min_distance_m >= c.required_clearance_m,
        ),
        ("Height above the cell below", f"at least {metres(c.min_vertical_m)}", None),
        ("Worst point", place if math.isfinite(c.worst.lat_deg) else "unknown", None),
        (
            "Straight return from every sample",
            f"needs {metres_up(c.rtl_height_needed_m, 1)} above home, the autopilot is set to {metres(rtl_set_m, 1)}",
            c.rtl_height_needed_m <= rtl_set_m,
        ),
        ("Take-off and landing column over home", "clear" if c.home_column_clear else "blocked", c.home_column_clear),
        ("Greatest height above ground", metres_up(c.max_height_above_ground_m, 1), None),
    ]


def _term_rows(certificate: Certificate) -> list[tuple[str, str, str]]:
    """(term, metres, where it comes from), then the sum, and what a smaller clearance leaves out."""
    budget, required_m = certificate.budget, certificate.required_clearance_m
    if budget is None:
        return [("Required", metres_up(required_m), "as given; what it is for is not known")]
    rows = [(t.name.capitalize(), metres_up(t.value_m), t.source) for t in budget.terms]
    rows.append(("Sum", metres_up(budget.total_m), SUM_RULE))
    if is_by_hand(budget, required_m):
        rows.append(("Required", metres_up(required_m), "set by hand"))
    rows += [
        (f"Not covered: {part.name}", metres_up(part.missing_m), "left out") for part in budget.uncovered_by(required_m)
    ]
    return rows


def _tightest(legs: Sequence[LegClearance]) -> list[LegClearance]:
    return sorted(legs, key=lambda leg: leg.min_distance_m)[:TIGHTEST_LEGS]


def _mission_rows(plan: ReportInput) -> list[tuple[str, str]]:
    mission, home = plan.mission, plan.mission.home
    counts = Counter(COMMAND_NAMES.get(item.command, f"command {item.command}") for item in mission.items)
    speed = mission.cruise_speed_m_s
    return [
        ("Home", f"{home.lat_deg:.7f}°, {home.lon_deg:.7f}°"),
        ("Home altitude", home_altitude_note(home).removeprefix("home altitude ")),
        ("Vehicle", f"{clean_name(plan.profile.name)}, {plan.profile.firmware}"),
        ("Items", ", ".join(f"{n} \u00d7 {name}" for name, n in counts.most_common())),
        ("Cruise speed", "as set in the vehicle" if speed is None else f"{speed:.1f} m/s"),
        ("Predicted duration", duration(plan.predicted_duration_s)),
        ("Duration by the timing law", duration(float(plan.timing.t_s[-1]))),
    ]


def _parameter_rows(plan: ReportInput) -> list[tuple[str, str]]:
    surface, profile, dsm = plan.surface, plan.profile, plan.dsm
    sigma_m = surface.radius_m / 10 if surface.smooth_sigma_m is None else surface.smooth_sigma_m
    known = float(np.isfinite(dsm.elevation_m).mean())
    return [
        (
            "Surface model",
            f"{dsm.width_px} \u00d7 {dsm.height_px} cells of {dsm.resolution_m:.4g} m, {known:.1%} known",
        ),
        ("Vertical datum", clean_name(dsm.vertical_datum or "not declared")),
        ("Dilation", f"ball of radius {metres(surface.radius_m, 1)}, height {metres(surface.height_m, 1)}"),
        (
            "Smoothing",
            f"standard deviation {metres(sigma_m)}{', kept above the floor' if surface.floor else ', without floor'}",
        ),
        ("Speed", f"mean {profile.mean_speed_m_s:g}, at most {profile.max_speed_m_s:g} m/s"),
        ("Climb, descent", f"at most {profile.max_climb_m_s:g} m/s up, {profile.max_descent_m_s:g} m/s down"),
    ]
