"""What an operator has set about perception, kept on disk so that the next start has it too."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import msgspec
from pydantic import ValidationError

from mapping.errors import MappingError
from server.library.whole_files import write_atomically
from server.schemas import PerceptionSettingsBody, VelocitySettingsBody
from telemetry.perception.sensor_kinds import check_perception
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import VelocitySettings

FILE = "perception.json"
WIDEST_M = 100.0


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
        settings.climb_m_s,
        settings.climb_ceiling_m,
        settings.brake_decel_m_s2,
        settings.brake_jerk_m_s3,
        settings.safety_radius_m,
        settings.approach_s,
    )
    around = (settings.vehicle_radius_m, settings.position_error_m)
    if not (all(value > 0 for value in lengths) and all(0 <= value <= WIDEST_M for value in around)):
        return False
    if settings.clear_count < 0 or not _are_limits(settings.velocities):
        return False
    try:
        check_perception(settings)
    except MappingError:
        return False
    return True


def _are_limits(velocities: VelocitySettings) -> bool:
    """The longest and widest are those that a page may ask for."""
    try:
        VelocitySettingsBody(**asdict(velocities))
    except ValidationError:
        return False
    return True


def write_settings(root: Path, settings: PerceptionSettings) -> None:
    write_atomically(root / FILE, msgspec.json.encode(settings))


def changed(settings: PerceptionSettings, body: PerceptionSettingsBody) -> PerceptionSettings:
    """What the body leaves out stays, of its parts as well."""
    wanted = body.model_dump(exclude_none=True)
    for part in ("tracker", "velocities"):
        if part in wanted:
            wanted[part] = replace(getattr(settings, part), **wanted[part])
    return replace(settings, **wanted)
