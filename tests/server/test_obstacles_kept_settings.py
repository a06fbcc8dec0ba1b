"""Settings of perception on disk."""

from dataclasses import replace
from pathlib import Path

import pytest

from server.obstacles.kept_settings import FILE, changed, read_settings, write_settings
from server.schemas import PerceptionSettingsBody
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import TrackerSettings, VelocitySettings


def test_what_was_set_is_there_again(tmp_path: Path) -> None:
    body = PerceptionSettingsBody(
        radar_depth_m=12.0, paper_bare=True, memory_limit_bytes=50_000_000, position_error_m=0.4
    )
    write_settings(tmp_path, changed(PerceptionSettings(), body))
    assert read_settings(tmp_path) == replace(
        PerceptionSettings(), radar_depth_m=12.0, paper_bare=True, memory_limit_bytes=50_000_000, position_error_m=0.4
    )


def test_of_tracker_and_velocities_what_is_not_named_stays(tmp_path: Path) -> None:
    first = changed(PerceptionSettings(), PerceptionSettingsBody.model_validate({"tracker": {"coordinates": "polar"}}))
    more = {"tracker": {"gate": 9.0}, "velocities": {"max_turn_deg": 60, "nearest_only": True}}
    write_settings(tmp_path, changed(first, PerceptionSettingsBody.model_validate(more)))
    found = read_settings(tmp_path)
    assert found.tracker == TrackerSettings(coordinates="polar", gate=9.0)
    assert found.velocities == VelocitySettings(max_turn_deg=60, nearest_only=True)


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", '{"brake_jerk_m_s3": 0}', '{"vision_depth_m": -1}', '{"fov_deg": 400}', '{"radar_resolution_m": 0}',
     '{"memory_limit_bytes": 0}', '{"height_m": "high"}', '{"safety_radius_m": 0}', '{"approach_s": -1}',
     '{"tracker": {"coordinates": "round"}}', '{"tracker": {"birth": 9.5}}', '{"tracker": {"gate": 0}}',
     '{"velocities": {"max_turn_deg": -1}}', '{"velocities": {"stands_m": 0}}',
     '{"climb_m_s": 0}', '{"climb_ceiling_m": -3}', '{"radar_high_deg": 3}', '{"radar_low_deg": 2}',
     '{"vision_resolution_m": 0.01}', '{"position_error_m": 1e300}', '{"clear_count": -1}'],
)  # fmt: skip
def test_damaged_settings_are_the_defaults(text: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text)
    assert read_settings(tmp_path) == PerceptionSettings()
    assert read_settings(tmp_path / "none") == PerceptionSettings()
