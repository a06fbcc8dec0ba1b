"""The tracker beside Stone Soup's: the same detections, the same errors, and far less time."""

from __future__ import annotations

from tests.mapping.tracks_compared import compared


def test_as_exact_as_stone_soups_and_many_times_as_fast():
    both = compared((1,), objects=5, count=40)
    assert both.error_ratio <= 1.05
    assert both.covered[0] >= both.covered[1] - 0.03
    assert both.covered[0] > 0.8
    assert both.times_as_fast >= 30
