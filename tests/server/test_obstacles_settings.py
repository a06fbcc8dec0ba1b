"""What perception is set to: checked as a whole before anything is changed, then published and kept."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any, cast

import pytest

from mapping.errors import CapacityError
from server.errors import status_of
from server.obstacles.kept_settings import read_settings
from server.obstacles.obstacle_desk import ObstacleDesk
from server.obstacles.obstacle_watch import Watch
from server.schemas import ObstaclesState, PerceptionSettingsBody
from telemetry.perception import sensor_kinds
from telemetry.topics.obstacles import PerceptionSettings
from tests.server.fakes import Told

GB = 1_000_000_000


class Desk:
    """One that nobody asks for anything else."""

    def __init__(self, root: Path) -> None:
        self.root, self.published = root, list[PerceptionSettings]()
        nobody = cast(Any, None)
        watch = Watch("live", Told())
        self.desk = ObstacleDesk(
            root,
            {"live": watch},
            nobody,
            nobody,
            nobody,
            nobody,
            nobody,
            nobody,
            cast(Any, self),
        )

    def publish(self, topic: str, settings: PerceptionSettings) -> None:
        """As the bus does."""
        self.published.append(settings)

    def change(self, **fields: Any) -> ObstaclesState:
        return asyncio.run(self.desk.change_settings(PerceptionSettingsBody(**fields)))


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    monkeypatch.setattr(sensor_kinds, "computer_bytes", lambda: 8 * GB)
    made = Desk(tmp_path)
    asyncio.run(made.desk.start())
    return made


def test_map_and_vehicle_are_published_and_kept(desk: Desk) -> None:
    fields = {
        "memory_limit_bytes": GB // 2,
        "radar_resolution_m": 0.5,
        "vision_resolution_m": 0.4,
        "vehicle_radius_m": 0.6,
        "position_error_m": 0.0,
    }
    state = desk.change(**fields)
    wanted = PerceptionSettings(**fields)
    assert state.settings == desk.published[-1] == read_settings(desk.root) == wanted


@pytest.mark.parametrize(
    ("fields", "where", "what", "advice"),
    [
        ({"vision_resolution_m": 0.05}, "vision map", "One look out to 40 m", "0.06 m or coarser"),
        ({"vision_resolution_m": 0.25, "memory_limit_bytes": GB // 100}, "vision map", "10 MB", "0.276 m or coarser"),
        ({"memory_limit_bytes": 3 * GB}, "memory", "12,000 MB; this computer has 8,000 MB", "2,000 MB"),
        ({"radar_resolution_m": 0.2}, "radar map", "A corridor 120 m long and 1.6 m wide at 0.2 m", "m or coarser"),
        ({"vision_depth_m": 40, "fov_deg": 120, "height_m": 20, "vision_resolution_m": 0.18}, "vision map",
         "A region 40 m deep", "5,000,000 are the most"),
    ],
)  # fmt: skip
def test_what_cannot_fit_is_refused_with_the_number_and_nothing_changes(
    desk: Desk, fields: dict[str, Any], where: str, what: str, advice: str
) -> None:
    with pytest.raises(CapacityError) as caught:
        desk.change(**fields)
    assert status_of(caught.value) == 422
    assert caught.value.where == where
    assert what in caught.value.what
    assert advice in caught.value.advice
    assert desk.published == [PerceptionSettings()]
    assert read_settings(desk.root) == PerceptionSettings()


def test_what_would_do_does(desk: Desk) -> None:
    desk.change(memory_limit_bytes=2_000_000_000)
    desk.change(vision_resolution_m=0.276)
    desk.change(memory_limit_bytes=GB // 100)
    assert desk.published[-1].memory_limit_bytes == GB // 100


def test_a_small_computer_refuses_only_what_is_about_memory(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The usual limit is more than it has, and the maps seldom need it."""
    monkeypatch.setattr(sensor_kinds, "computer_bytes", lambda: GB)
    assert desk.change(radar_depth_m=12.0).settings.radar_depth_m == 12.0
    with pytest.raises(CapacityError, match="this computer has 1,000 MB"):
        desk.change(memory_limit_bytes=GB)
