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
        return msgspec.json.decode((root / FILE).read_bytes(), type=PerceptionSettings)
    except (FileNotFoundError, msgspec.MsgspecError):
        return PerceptionSettings()


def write_settings(root: Path, settings: PerceptionSettings) -> None:
    write_atomically(root / FILE, msgspec.json.encode(settings))


def changed(settings: PerceptionSettings, body: PerceptionSettingsBody) -> PerceptionSettings:
    """What the body leaves out stays."""
    return replace(settings, **body.model_dump(exclude_none=True))
