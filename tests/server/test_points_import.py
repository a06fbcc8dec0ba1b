"""A file's points taken into the console's plan, and what of the file is left out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from planning.fence.model import Fence, circle
from planning.formats.qgc_plan import write_plan
from server.plan.file_tasks import FENCE_LEFT, read_points
from tests.planning.format_examples import make_dsm, make_mission, make_path


def test_a_fence_that_is_not_taken_is_told(tmp_path: Path) -> None:
    dsm = make_dsm()
    mission, file = make_mission(dsm, make_path(dsm)), tmp_path / "mission.plan"
    file.write_text(write_plan(mission))
    document, remarks = read_points(file, file.name, None, report=lambda step, share: None)
    assert len(document.pois) == 3
    assert FENCE_LEFT not in remarks
    fence = Fence(circles=(circle(47.0, 8.0, 50.0, inclusion=False, where="test"),))
    file.write_text(write_plan(replace(mission, fence=fence)))
    _, remarks = read_points(file, file.name, None, report=lambda step, share: None)
    assert FENCE_LEFT in remarks
