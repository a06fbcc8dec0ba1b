"""The autopilot's own words for its parameters: from a file that is given once and kept in the data directory."""

from __future__ import annotations

from pathlib import Path

from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import say_notes
from server.flying.descriptions import keep_descriptions, kept_descriptions
from telemetry.parameters.described import Description, read_descriptions
from telemetry.topics.vehicle import Autopilot


def descriptions(given: Path | None, data_dir: Path | None, autopilot: Autopilot) -> dict[str, Description]:
    """By name; empty where no file was ever given. A given one is kept for this autopilot."""
    if given is not None:
        data = read_small(given)
        if data_dir is None:
            return read_descriptions(given.name, data)
        return keep_descriptions(data_dir, autopilot, given.name, data)
    found, why = ({}, "") if data_dir is None else kept_descriptions(data_dir, autopilot)
    if why:
        say_notes(why)
    return found
