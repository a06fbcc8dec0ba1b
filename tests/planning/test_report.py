import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from planning.basics.plan_model import FlownLine, SurfaceParams, VehicleProfile
from planning.certificate.certificate_model import Certificate, LegClearance, Reason, WorstPoint
from planning.missions.feasibility import feasibility_of
from planning.report.report_page import ReportInput, TradeRow, render_report
from planning.report.words import assumption_rows, duration, metres, metres_up
from planning.route.survey_coverage import SurveyCoverage
from tests.planning.format_examples import HOSTILE, make_dsm, make_mission, make_path, make_timing


def example(names=("P1", "P2", "P3")) -> ReportInput:
    dsm = make_dsm()
    path = make_path(dsm)
    timing, mission = make_timing(path), make_mission(dsm, path, names)
    points = np.column_stack([path.xy_m[path.vertex], path.alt_dsm_m[path.vertex]])
    home_xy = (float(points[0, 0]), float(points[0, 1]))
    line = FlownLine(points, np.array([2, 3]), home_xy, mission.home.alt_dsm_m, float(points[0, 2]), True)
    x, y, z = points[1].tolist()
    lat, lon = dsm.lat_lon_from_xy(points[1:2, :2])[0].tolist()
    worst = WorstPoint(lat, lon, z - mission.home.alt_dsm_m, 0, float(path.s_m[path.vertex[1]]), x, y, z)
    certificate = Certificate(
        certified=True,
        min_distance_m=4.129,
        min_vertical_m=4.2,
        required_clearance_m=3.351,
        worst=worst,
        legs=(LegClearance(0, 2, 4.129, 4.2, 20.0), LegClearance(1, 3, 5.0, 5.1, 30.0)),
        rtl_height_needed_m=12.34,
        home_column_clear=True,
        max_height_above_ground_m=8.0,
        reasons=(),
        trend_s_m=path.s_m,
        trend_distance_m=np.full(len(path.s_m), 5.0),
        assumptions={"dsm_sha256": dsm.sha256, "position_error_m": 2.5, "parameters": {"rtl_height_m": 30.0}},
    )
    return ReportInput(
        title="Ridge",
        dsm=dsm,
        path=path,
        timing=timing,
        mission=mission,
        line=line,
        certificate=certificate,
        profile=VehicleProfile("Quad"),
        surface=SurfaceParams(),
        feasibility=feasibility_of(mission, VehicleProfile("Quad"), 125.0),
        predicted_duration_s=125.0,
        max_items=650,
        created_utc="2026-01-01 00:00 UTC",
        gsd_cm=1.4,
        trade=(TradeRow(3, 0.5, 125.0, True),),
        seconds={"total": 0.5},
    )


def failing() -> ReportInput:
    plan = example()
    trend = plan.certificate.trend_distance_m.copy()
    trend[50:60], trend[55] = 1.0, 0.0
    certificate = replace(
        plan.certificate,
        certified=False,
        min_distance_m=0.0,
        min_vertical_m=-math.inf,
        rtl_height_needed_m=math.inf,
        trend_distance_m=trend,
        reasons=(Reason("terrain", "The line enters <terrain>.", "Raise it."),),
    )
    return replace(plan, certificate=certificate, warnings=("Watch <out>.",))


class Outline(HTMLParser):
    """Tags and attributes of a page."""

    def __init__(self, page: str):
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))


def test_a_certified_plan_says_so_and_shows_five_figures():
    page = render_report(example())
    assert "✓ CERTIFIED" in page
    assert "NOT CERTIFIED" not in page
    assert page.count("<svg") == 5
    assert "at least 4.12 m from the surface model; 3.36 m are required" in page
    assert "above mean sea level (EGM96 height)" in page


def test_a_failing_plan_gives_reasons_mends_and_words_for_the_infinite():
    page = render_report(failing())
    assert "✕ NOT CERTIFIED" in page
    assert "The line enters &lt;terrain&gt;." in page
    assert "Raise it." in page
    assert "Watch &lt;out&gt;." in page
    assert "inside terrain" in page
    assert not re.search(r"\b(nan|inf)\b", re.sub(r"base64,[^\"]*", "", page))


def test_a_survey_shows_what_its_photos_see():
    coverage = SurveyCoverage(51.0, 12_345.0, 99, 1.0, 0.955, 0.8, 0.7, 0.8, 0.7, 1.1, 1.0, -90.0)
    page = render_report(replace(example(), coverage=coverage))
    assert "95 %" in page
    assert "of 12,345 m², 99 photos" in page
    assert "80 %, 70 %" in page
    assert "Photographed" not in render_report(example())


def test_the_page_runs_no_script_and_loads_nothing():
    page = render_report(replace(example((HOSTILE, "'\" onload=alert(1) x=", "P3")), title=HOSTILE))
    tags = Outline(page).tags
    assert {tag for tag, _ in tags}.isdisjoint({"script", "iframe", "object", "embed", "link", "form", "foreignobject"})
    assert not [name for _, attrs in tags for name in attrs if name.startswith("on")]
    links = [attrs[name] or "" for _, attrs in tags for name in ("src", "href", "xlink:href") if name in attrs]
    assert len(links) == 1
    assert links[0].startswith("data:image/png;base64,")
    policy = next(attrs["content"] for tag, attrs in tags if tag == "meta" and "http-equiv" in attrs)
    assert policy == "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    assert "\u202e" not in page
    assert "\x00" not in page


def test_a_model_with_unknown_ground_and_no_worst_point_can_be_shown():
    plan = failing()
    worst = replace(
        plan.certificate.worst, lat_deg=math.nan, lon_deg=math.nan, x_m=math.nan, y_m=math.nan, s_m=math.nan
    )
    ground = plan.path.ground_alt_dsm_m.copy()
    ground[20:40] = np.nan
    page = render_report(
        replace(
            plan,
            path=replace(plan.path, ground_alt_dsm_m=ground, vertex_poi=(None, None, None)),
            certificate=replace(plan.certificate, worst=worst, min_distance_m=math.nan),
            gsd_cm=None,
            mission=replace(plan.mission, pois=()),
            trade=(),
        )
    )
    assert "Ground sampling" not in page
    assert page.count("<svg") == 5


@pytest.mark.parametrize(
    ("value", "down", "up"),
    [
        (4.129, "4.12 m", "4.13 m"),
        (-0.701, "-0.71 m", "-0.70 m"),
        (3.35, "3.35 m", "3.35 m"),
        (math.nan,) + ("unknown",) * 2,
    ],
)
def test_clearances_round_down_and_demands_round_up(value, down, up):
    assert metres(value) == down
    assert metres_up(value) == up


def test_durations_and_assumptions_are_worded():
    assert [duration(s) for s in (59.4, 60, 222, math.inf)] == ["59 s", "1 min", "3 min 42 s", "unknown"]
    rows = assumption_rows(
        {"dsm_sha256": "ab", "max_accel_m_s2": 2.5, "nested": {"floor": True}, "notes": [], "x": None}
    )
    assert rows == [
        ("DSM SHA-256", "ab"),
        ("Max accel", "2.5 m/s²"),
        ("Floor", "yes"),
        ("Notes", "none"),
        ("X", "none"),
    ]
