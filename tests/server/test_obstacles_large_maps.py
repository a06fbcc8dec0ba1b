"""Maps of a million voxels: what they cost pages in boxes and bytes, and what time alone costs: nothing."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest

from server.obstacles import drawing
from server.obstacles.drawing import BOXES_MAX, BURST_BYTES, PERIOD_S, RATE_BYTES_S
from server.scene.mirror import MapMirror
from tests.server.large_maps import Clock, Painter, hills, painting, told
from tests.server.obstacle_messages import ORIGIN, delta
from tests.server.test_obstacles_drawing import FakeStage, made

MOST_BOXES, MOST_BYTES = 200_000, 100_000_000


def folded(painter: Painter, voxels: int) -> MapMirror:
    mirror = MapMirror("radar")
    for part in told(hills(voxels), painter.origin):
        mirror.fold(part)
    return mirror


def test_a_million_voxels_are_few_boxes_few_bytes_and_then_silence() -> None:
    with painting() as painter:
        mirror = folded(painter, 1_000_000)
        painter.finish(mirror)
        (described,) = painter.maps.drawn()
        assert described.voxels == 1_000_000
        assert sum(painter.stage.boxes.values()) == described.drawn
        assert 50_000 < described.drawn <= BOXES_MAX["radar"]
        assert 15 * described.drawn < painter.sent_bytes < MOST_BYTES

        sent_bytes = painter.sent_bytes
        painter.finish(mirror)
        for part in told(hills(1_000_000), painter.origin)[:3]:
            mirror.fold(part)
        painter.finish(mirror)
        assert painter.sent_bytes == sent_bytes


def test_all_maps_together_are_within_what_pages_can_draw() -> None:
    assert sum(BOXES_MAX.values()) <= MOST_BOXES


@pytest.mark.parametrize(("more", "detail"), [(0, 1), (1, 2)])
def test_a_map_is_drawn_in_full_up_to_its_limit(more: int, detail: int) -> None:
    stage, mirror, maps = FakeStage(), MapMirror("radar"), made()
    for part in told(hills(BOXES_MAX["radar"] + more), ORIGIN):
        mirror.fold(part)
    maps.draw(stage, "radar", mirror)
    assert maps.drawn()[0].detail == detail


def test_a_map_that_changes_everywhere_at_once_costs_its_rate_and_no_more() -> None:
    chunk_bytes, seconds, clock = 50_000, 120.0, Clock()
    places = np.array([(40 * n, 0, 0) for n in range(30)])
    with patch.object(drawing, "time", clock):
        stage, mirror, maps = FakeStage(cost=chunk_bytes), MapMirror("radar"), made()
        for turn in range(round(seconds / PERIOD_S)):
            clock.now_s += PERIOD_S
            mirror.fold(delta(places, 140 + turn % 100))
            maps.draw(stage, "radar", mirror)
    allowed = BURST_BYTES + RATE_BYTES_S * seconds
    assert 0.99 * allowed < maps.drawn()[0].sent_bytes < allowed + chunk_bytes
