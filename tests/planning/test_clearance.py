"""The clearance certificate on made terrain: what it certifies, what it refuses and why."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS, Geod

from planning.basics.plan_model import FlownLine, Unjudged, VehicleProfile
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.certificate.clearance import certificate_json, certify
from planning.errors import MissionError, ParameterError
from planning.missions.vehicle_terms import budget_of
from planning.terrain.dsm import Dsm

WEST, NORTH = 500_000.0, 5_000_100.0
PARAMS = ClearanceParams(3.0, vehicle_radius_m=0.35, position_error_m=1.0, rtl_height_m=40.0)


def dsm_of(cells: np.ndarray, *, res: float = 1.0, epsg: int = 32633) -> Dsm:
    return Dsm(cells.astype(np.float32), Affine(res, 0.0, WEST, 0.0, -res, NORTH), CRS.from_epsg(epsg), None, "ab" * 32)


def flat(*, value_m: float = 0.0) -> np.ndarray:
    return np.full((100, 100), value_m, np.float32)


def line_of(*points: tuple[float, float, float], **changes) -> FlownLine:
    """A line through points given in metres east and south of the north-west corner; home is under the first."""
    xyz = np.array(points, dtype=np.float64)
    xyz = np.column_stack([xyz[:, 0] + WEST, NORTH - xyz[:, 1], xyz[:, 2]])
    line = FlownLine(xyz, np.arange(len(points) - 1), (xyz[0, 0], xyz[0, 1]), 0.0, float(xyz[0, 2]), True)
    return replace(line, **changes)


PLAIN = ((20.5, 20.5, 8.0), (60.5, 20.5, 10.0), (60.5, 70.5, 6.0))


def codes(certificate: Certificate) -> list[str]:
    return [reason.code for reason in certificate.reasons]


def test_a_line_over_flat_ground_is_certified():
    certificate = certify(dsm_of(flat()), line_of(*PLAIN), PARAMS)
    assert certificate.certified
    assert certificate.reasons == ()
    assert certificate.min_distance_m == pytest.approx(6.0)
    assert certificate.min_vertical_m == pytest.approx(6.0)
    assert certificate.max_height_above_ground_m == pytest.approx(10.0)
    assert certificate.rtl_height_needed_m == 0.0
    assert certificate.home_column_clear
    assert certificate.worst.leg == 1
    assert certificate.worst.s_m == pytest.approx(90.0)
    assert certificate.worst.alt_rel_home_m == pytest.approx(6.0)
    assert [leg.min_distance_m for leg in certificate.legs] == pytest.approx([8.0, 6.0])


def test_the_trend_covers_the_line_and_never_undercuts_the_minimum():
    certificate = certify(dsm_of(flat()), line_of(*PLAIN), PARAMS, trend_step_m=0.7)
    assert certificate.trend_s_m[[0, -1]] == pytest.approx([0.0, 90.0])
    assert np.diff(certificate.trend_s_m).max() <= 0.7
    assert certificate.trend_distance_m.min() == pytest.approx(certificate.min_distance_m)
    assert certificate.trend_distance_m[0] == pytest.approx(8.0)


def test_too_little_clearance_says_where_how_much_and_what_helps():
    certificate = certify(dsm_of(flat()), line_of(*PLAIN), replace(PARAMS, required_clearance_m=6.5))
    assert codes(certificate) == ["clearance"]
    assert "leg 2 (item 2)" in certificate.reasons[0].text
    assert "0.50 m less than the required 6.50 m" in certificate.reasons[0].text
    assert "Raise H by at least 0.50 m" in certificate.reasons[0].mend
    assert "RTK" not in certificate.reasons[0].mend  # set by hand: it does not fall with the position error


def test_rtk_is_named_where_it_would_help():
    budget = budget_of(VehicleProfile("quad", position_error_m=6.0))
    params = replace(PARAMS, position_error_m=6.0, required_clearance_m=budget.total_m, budget=budget)
    reasons = {r.code: r for r in certify(dsm_of(flat()), line_of(*PLAIN), params).reasons}
    assert "With RTK (0.1 m)" in reasons["clearance"].mend


def test_the_certificate_is_of_a_tube():
    """Whatever lies within the following distance of the line keeps what is stated for the tube."""
    budget = budget_of(VehicleProfile("quad", position_error_m=0.5, following_m=1.5))
    params = replace(PARAMS, required_clearance_m=budget.total_m, budget=budget, rtl_height_m=60.0)
    cells = flat()
    cells[25:40, 30:34] = 4.0
    certificate = certify(dsm_of(cells), line_of(*PLAIN), params)
    tube = certificate_json(certificate)["tube"]
    assert certificate.certified
    assert certificate.min_distance_m >= 1.5 + tube["required_m"]
    assert (tube["radius_m"], tube["min_distance_m"]) == (1.5, pytest.approx(certificate.min_distance_m - 1.5))
    assert "everything within 1.50 m of the line" in tube["statement"]
    random = np.random.default_rng(3)
    for _ in range(40):
        off_m = random.normal(size=3)
        off_m *= 1.5 / np.linalg.norm(off_m)
        beside = line_of(*(np.array(PLAIN) + off_m * (1, 1, 1)))
        assert certify(dsm_of(cells), beside, params).min_distance_m >= tube["min_distance_m"] - 1e-9


def test_the_height_limit_is_of_the_tube_too():
    budget = budget_of(VehicleProfile("quad", position_error_m=0.5, following_m=1.5))
    params = replace(PARAMS, required_clearance_m=budget.total_m, budget=budget, max_height_above_ground_m=11.5)
    assert certify(dsm_of(flat()), line_of(*PLAIN), params).certified
    lower = certify(dsm_of(flat()), line_of(*PLAIN), replace(params, max_height_above_ground_m=11.4))
    assert codes(lower) == ["height_above_ground"]
    assert "the vehicle may be 1.50 m above it" in lower.reasons[0].text


def test_clearance_equal_to_the_required_is_enough():
    assert certify(dsm_of(flat()), line_of(*PLAIN), replace(PARAMS, required_clearance_m=6.0)).certified


def test_a_thin_mast_beside_the_line_is_found():
    cells = np.zeros((2000, 2000), np.float32)  # 1 cm
    cells[1000, 1200] = 30.0
    line = line_of((5.0, 10.0, 8.0), (15.0, 10.0, 8.0))
    params = replace(PARAMS, rtl_height_m=60.0)
    assert certify(dsm_of(np.zeros_like(cells), res=0.01), line, params).certified
    hit = certify(dsm_of(cells, res=0.01), line, params)
    assert hit.min_distance_m == 0.0
    assert "terrain_hit" in codes(hit)
    beside = certify(dsm_of(cells, res=0.01), line_of((5.0, 11.0, 8.0), (15.0, 11.0, 8.0)), params)
    assert beside.min_distance_m == pytest.approx(0.99)
    assert beside.min_vertical_m == pytest.approx(8.0)
    assert beside.worst.x_m - WEST == pytest.approx(12.0, abs=0.011)


def test_a_hole_is_a_column_without_end():
    cells = flat()
    cells[24, 40] = np.nan  # south of the first leg by 3.5 m
    certificate = certify(dsm_of(cells), line_of(*PLAIN), replace(PARAMS, required_clearance_m=3.6))
    assert certificate.min_distance_m == pytest.approx(3.5)
    assert codes(certificate) == ["clearance", "return_unknown"]
    assert "unknown cell" in certificate.reasons[0].text
    assert "Raise H" not in certificate.reasons[0].mend
    assert certificate.rtl_height_needed_m == math.inf


def test_over_a_hole_or_outside_is_endless_depth():
    cells = flat()
    cells[20, 40] = np.nan
    over = certify(dsm_of(cells), line_of(*PLAIN), PARAMS)
    outside = certify(dsm_of(flat()), line_of(*PLAIN, (60.5, 120.0, 9.0)), PARAMS)
    for certificate in (over, outside):
        assert certificate.min_vertical_m == -math.inf
        assert certificate.min_distance_m == 0.0
        assert {"unknown_terrain", "clearance"} <= set(codes(certificate))


def test_a_line_far_outside_does_not_crash():
    certificate = certify(dsm_of(flat()), line_of(PLAIN[0], (5e4, 20.5, 9.0)), PARAMS)
    assert not certificate.certified


def test_a_line_around_the_world_is_an_error():
    with pytest.raises(MissionError, match="20000 km long"):
        certify(dsm_of(flat()), line_of(PLAIN[0], (2e7, 20.5, 9.0)), PARAMS)


def test_the_return_needs_to_pass_a_ridge_off_the_line():
    cells = flat()
    cells[40:45, 35:45] = 25.0  # between home and the end, away from both legs
    low, high = replace(PARAMS, rtl_height_m=27.9), replace(PARAMS, rtl_height_m=28.0)
    refused = certify(dsm_of(cells), line_of(*PLAIN), low)
    assert refused.rtl_height_needed_m == pytest.approx(28.0)
    assert codes(refused) == ["return_height"]
    assert "RTL_ALT 2800 cm" in refused.reasons[0].mend
    assert certify(dsm_of(cells), line_of(*PLAIN), high).certified


def test_a_return_from_above_the_ridge_needs_no_return_height():
    cells = flat()
    cells[40:45, 35:45] = 25.0
    high = [(x, y, 29.0) for x, y, _ in PLAIN]
    certificate = certify(dsm_of(cells), line_of(*high), replace(PARAMS, rtl_height_m=5.0))
    assert certificate.certified
    assert certificate.rtl_height_needed_m == 0.0


def test_near_home_the_return_height_is_not_reached():
    cells = flat()
    cells[20, 26] = 12.0  # a lamp post between home and the line's end, 6 m from home
    detour = ((20.5, 20.5, 8.0), (20.5, 28.5, 8.0), (30.5, 28.5, 8.0), (30.5, 20.5, 8.0))
    certificate = certify(dsm_of(cells), line_of(*detour), PARAMS)
    assert certificate.rtl_height_needed_m == pytest.approx(15.0)
    assert PARAMS.rtl_height_m > 15.0
    assert codes(certificate) == ["return_near_home"]
    assert "15.00 m above home" in certificate.reasons[0].text
    higher = [(x, y, 15.0) for x, y, _ in detour]
    assert certify(dsm_of(cells), line_of(*higher), PARAMS).certified
    farther = [(20.5 + 2 * (x - 20.5), y, z) for x, y, z in detour]
    assert certify(dsm_of(cells), line_of(*farther), PARAMS).certified


@pytest.mark.parametrize(
    ("row", "col", "rise_m", "clear"),
    [(20, 20, 0.0, True), (20, 21, 0.9, True), (20, 21, 1.4, False), (21, 21, 1.4, False), (20, 22, 30.0, True)],
)
def test_the_home_column_takes_slopes_but_no_walls(row, col, rise_m, clear):
    cells = flat()
    cells[row, col] = rise_m
    line = line_of((20.5, 20.5, 40.0), (60.5, 20.5, 40.0), home_alt_dsm_m=float(cells[20, 20]))
    certificate = certify(dsm_of(cells), line, PARAMS)
    assert certificate.home_column_clear == clear
    assert ("home_column" in codes(certificate)) != clear


def test_an_unknown_cell_or_the_edge_blocks_the_home_column():
    cells = flat()
    cells[21, 20] = np.nan
    hole = certify(dsm_of(cells), line_of(*PLAIN), PARAMS)
    edge = certify(dsm_of(flat()), line_of((1.0, 20.5, 8.0), (60.5, 20.5, 10.0)), PARAMS)
    for certificate, said in ((hole, "unknown cells"), (edge, "ends within")):
        assert not certificate.home_column_clear
        assert any(said in reason.text for reason in certificate.reasons)


@pytest.mark.parametrize("slope_deg", [10.0, 25.0, 34.0])
@pytest.mark.parametrize("res", [0.1, 0.5, 1.0])
def test_a_plane_slope_is_no_obstacle_to_the_home_column(slope_deg, res):
    count = round(40 / res)
    rise = math.tan(math.radians(slope_deg)) * res * np.arange(count)
    cells = np.broadcast_to(rise[None, :], (count, count)).copy()
    for offset_m in (0.0, 0.3, 0.77):
        line = line_of((20.0 + offset_m, 20.0, 60.0), (22.0, 20.0, 60.0))
        assert certify(dsm_of(cells, res=res), line, PARAMS).home_column_clear


def test_landing_elsewhere_is_judged_as_home_is():
    cells = flat()
    cells[70, 61] = 3.0
    there = (WEST + 60.5, NORTH - 70.5)
    high = [(x, y, 20.0) for x, y, _ in PLAIN]
    line = line_of(*high, landing_xy_m=there)
    assert codes(certify(dsm_of(cells), line, PARAMS)) == ["landing_column"]
    assert certify(dsm_of(flat()), line, PARAMS).certified


def test_the_height_above_ground_is_limited():
    certificate = certify(dsm_of(flat()), line_of(*PLAIN), replace(PARAMS, max_height_above_ground_m=9.5))
    assert codes(certificate) == ["height_above_ground"]
    assert "10.00 m above ground on leg 1" in certificate.reasons[0].text
    assert certify(dsm_of(flat()), line_of(*PLAIN), replace(PARAMS, max_height_above_ground_m=10.0)).certified


def test_what_cannot_be_judged_is_not_certified():
    line = line_of(*PLAIN, unjudged=(Unjudged("flies a spline.", "A", 2, 82), Unjudged("jumps.", "B", 4, 177)))
    certificate = certify(dsm_of(flat()), line, PARAMS)
    assert codes(certificate) == ["unjudged", "unjudged"]


def test_a_crs_whose_metre_is_not_a_metre_is_refused():
    certificate = certify(dsm_of(flat(), epsg=3857), line_of(*PLAIN), PARAMS)
    assert codes(certificate) == ["crs_scale"]
    assert "1.32" in certificate.reasons[0].text


def test_distances_are_those_on_the_ground_where_the_crs_stretches_them():
    """At 5.4 degrees of latitude a metre is 1.0044 m of EPSG:3857."""
    cells = flat()
    cells[:, 80:] = 200.0
    dsm = replace(dsm_of(cells, epsg=3857), transform=Affine(1.0, 0.0, 1.67e6, 0.0, -1.0, 6.0e5))
    points_m = np.array([[1.67e6 + x, 6.0e5 - 50.0, 90.0] for x in (50.0, 60.0)])
    line = replace(line_of(*PLAIN), points_m=points_m, home_xy_m=(1.67e6 + 50.0, 6.0e5 - 50.0))
    ends = dsm.lat_lon_from_xy(np.array([[1.67e6 + x, 6.0e5 - 50.0] for x in (60.0, 80.0)]))
    true_m = Geod(ellps="WGS84").inv(*ends[0, ::-1], *ends[1, ::-1])[2]
    assert true_m == pytest.approx(19.91, abs=0.01)
    certificate = certify(dsm, line, PARAMS)
    assert certificate.min_distance_m == pytest.approx(true_m, abs=1e-3)
    assert certificate.trend_distance_m.min() == pytest.approx(true_m, abs=1e-3)
    assert codes(certify(dsm, line, replace(PARAMS, required_clearance_m=true_m - 0.01))) == []
    too_near = certify(dsm, line, replace(PARAMS, required_clearance_m=true_m + 0.01))
    assert codes(too_near) == ["clearance", "return_height"]


@pytest.mark.parametrize(
    "changes",
    [
        {"required_clearance_m": 0.0},
        {"required_clearance_m": math.nan},
        {"vehicle_radius_m": -1.0},
        {"position_error_m": math.nan},
        {"rtl_height_m": math.nan},
        {"max_height_above_ground_m": 0.0},
    ],
)
def test_parameters_that_make_no_sense_are_errors(changes):
    with pytest.raises(ParameterError):
        certify(dsm_of(flat()), line_of(*PLAIN), replace(PARAMS, **changes))


@pytest.mark.parametrize("step_m", [0.0, -1.0, math.nan, math.inf])
def test_a_trend_without_a_step_is_an_error(step_m):
    with pytest.raises(ParameterError):
        certify(dsm_of(flat()), line_of(*PLAIN), PARAMS, trend_step_m=step_m)


@pytest.mark.parametrize("points", [((20.5, 20.5, math.nan), (30.0, 20.5, 9.0)), ((20.5, 20.5, 9.0),)])
def test_a_line_that_is_no_line_is_an_error(points):
    with pytest.raises(MissionError):
        certify(dsm_of(flat()), line_of(*points), PARAMS)


def test_the_json_is_plain_and_complete():
    cells = flat()
    cells[20, 40] = np.nan
    certificate = certify(dsm_of(cells), line_of(*PLAIN), PARAMS, assumptions={"plan": {"radius_m": 20.0}})
    plain = certificate_json(certificate)
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["min_vertical_m"] is None
    assert plain["rtl_height_needed_m"] is None
    assert plain["certified"] is False
    assert set(plain["worst"]) == {"lat_deg", "lon_deg", "alt_rel_home_m", "leg"}
    assert plain["reasons"][0].keys() == {"code", "text", "mend"}
    assumed = plain["assumptions"]
    assert assumed["dsm_sha256"] == "ab" * 32
    assert assumed["crs"] == "EPSG:32633"
    assert assumed["vertical_datum"] == "unknown"
    assert assumed["parameters"]["required_clearance_m"] == 3.0
    assert assumed["plan"] == {"radius_m": 20.0}


def test_a_window_of_a_model_is_judged_like_a_copy():
    rng = np.random.default_rng(3)
    whole = dsm_of(rng.uniform(0.0, 3.0, (100, 100)))
    part = whole.window(10, 10, 80, 85)
    copy = replace(part, elevation_m=part.elevation_m.copy())
    line = line_of(*PLAIN)
    ours, theirs = certify(part, line, PARAMS), certify(copy, line, PARAMS)
    assert ours.min_distance_m == theirs.min_distance_m
    assert ours.rtl_height_needed_m == theirs.rtl_height_needed_m
