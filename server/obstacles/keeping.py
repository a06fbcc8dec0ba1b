"""What an operator has set about perception, kept on disk so that the next start has it too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec

from server.library.files import write_atomically
from server.schemas import PerceptionSettingsBody
from telemetry.obstacles import PerceptionSettings

FILE = "perception.json"


def read_settings(root: Path) -> PerceptionSettings:
    """The defaults when there are none; damaged ones cost no more than setting them again."""
    try:
        found = msgspec.json.decode((root / FILE).read_bytes(), type=PerceptionSettings)
    except (FileNotFoundError, msgspec.MsgspecError):
        return PerceptionSettings()
    return found if _makes_sense(found) else PerceptionSettings()


def _makes_sense(settings: PerceptionSettings) -> bool:
    """Every figure is used as a divisor, a length or an angle somewhere."""
    lengths = (
        settings.radar_depth_m,
        settings.vision_depth_m,
        settings.ranges_depth_m,
        settings.height_m,
        settings.brake_m_s2,
        settings.radar_resolution_m,
        settings.vision_resolution_m,
        settings.memory_limit_bytes,
        settings.safety_radius_m,
        settings.approach_s,
    )
    spare = (settings.vehicle_radius_m, settings.position_error_m, settings.clear_count)
    return all(value > 0 for value in lengths) and all(value >= 0 for value in spare) and 0 < settings.fov_deg <= 180


def write_settings(root: Path, settings: PerceptionSettings) -> None:
    write_atomically(root / FILE, msgspec.json.encode(settings))


def changed(settings: PerceptionSettings, body: PerceptionSettingsBody) -> PerceptionSettings:
    """What the body leaves out stays."""
    return replace(settings, **body.model_dump(exclude_none=True))
