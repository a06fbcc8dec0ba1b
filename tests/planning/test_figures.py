import re
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.report.figures.chart import (
    Chart,
    Mark,
    Series,
    keep_extremes,
    label,
    padded,
    render_chart,
    round_step,
    ticks,
)
from planning.safe_surface.surface import fit_within
from tests.planning.format_examples import HOSTILE, make_dsm


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.integers(2, 12))
def test_ticks_are_round_and_inside(low, span, count):
    step = round_step(span, count)
    mantissa = step / 10 ** np.floor(np.log10(step) + 1e-9)
    assert min(abs(mantissa - m) for m in (1, 2, 5)) < 1e-6
    values = ticks(low, low + span, count)
    assert len(values) <= count + 1
    assert all(low - 1e-6 * step - 1e-6 <= v <= low + span + 1e-6 * step + 1e-6 for v in values)


@given(st.floats(-1e4, 1e4), st.floats(0, 1e4))
def test_a_padded_range_holds_the_values_and_is_never_empty(low, span):
    a, b = padded(low, low + span)
    assert a <= low + 1e-6
    assert b >= low + span - 1e-6 * max(1.0, span)
    assert b > a


@pytest.mark.parametrize(
    ("value", "step", "text"), [(0.3, 0.1, "0.3"), (-0.0, 5, "0"), (1500, 500, "1500"), (0.25, 0.05, "0.25")]
)
def test_tick_labels_have_the_decimals_of_their_step(value, step, text):
    assert label(value, step) == text


@given(st.integers(0, 99_999))
def test_a_single_spike_survives_thinning(place):
    y = np.zeros(100_000)
    y[place] = -7.0
    kept = keep_extremes(y, 400)
    assert place in kept
    assert {0, 99_999} <= set(kept.tolist())
    assert len(kept) <= 402
    assert (np.diff(kept) > 0).all()


def test_gaps_break_the_line_and_all_text_is_escaped():
    x = np.arange(6.0)
    y = np.array([1.0, 2.0, np.nan, 4.0, 5.0, np.inf])
    chart = Chart(
        "x <m>", HOSTILE.replace("\x00", "").replace("\x1b", ""), [Series(x, y, "<b>", "#000")], [Mark(1.0, 2.0, "<i>")]
    )
    svg = render_chart(chart)
    assert len(re.findall("<polyline", svg)) == 2
    assert "<script" not in svg
    assert "<b>" not in svg
    assert "nan" not in svg
    assert fromstring(svg).tag == "svg"


def test_a_chart_of_nothing_known_still_has_axes():
    svg = render_chart(Chart("x", "y", [Series(np.array([0.0]), np.array([np.nan]), "a", "#000")]))
    assert fromstring(svg).tag == "svg"


def test_reducing_keeps_the_highest_cell_and_the_corner():
    dsm = make_dsm()
    heights = dsm.elevation_m.copy()
    heights[31, 17] = 999.0
    small = fit_within(dsm.with_elevation(heights), 25)
    assert small.elevation_m.shape == (20, 20)
    assert small.elevation_m[10, 5] == 999.0
    assert small.bounds_m[0] == dsm.bounds_m[0]
    assert small.bounds_m[3] == dsm.bounds_m[3]
    assert fit_within(dsm, 60) is dsm
