"""Where a radar's configuration differs from what the obstacle map counts on, and from what the radar then sends."""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.sensors.ti_mmwave.cfg_commands import Command
from telemetry.sensors.ti_mmwave.ti_config import TiConfig
from telemetry.sensors.ti_mmwave.ti_frame import TiFrame

ENOUGH = 1.2
"""Differences smaller than this factor are not worth a word."""

SILENT_S, NEARLY_SILENT_S = 0.5, 0.4
"""A radar without a frame for so long counts as silent where avoidance relies on it; the delays of the link come to
the period."""


@dataclass(frozen=True, slots=True)
class Assumed:
    """The radar of Miccinesi 2022, section 2.1, an AWR1843 set to 120 m: known ground, noise and side lobes are judged
    by it."""

    range_cell_m: float = 0.5
    farthest_m: float = 120.0
    velocity_cell_m_s: float = 0.31
    fastest_m_s: float = 10.4
    azimuth_antennas: int = 8
    frame_period_s: float = 0.1
    field_of_view_deg: float = 120.0


def differences(config: TiConfig, assumed: Assumed | None = None) -> list[str]:
    """One sentence each, for whoever set the radar up; empty where there is none."""
    a = assumed or Assumed()
    notes = [
        _differs("Range cells are", config.range_cell_m, a.range_cell_m, "m"),
        _differs("It sees to", config.farthest_m, a.farthest_m, "m"),
        _differs("Speed cells are", config.velocity_cell_m_s, a.velocity_cell_m_s, "m/s"),
        _fastest(config, a),
        _period(config, a),
        _azimuth(config, a),
        _field_of_view(config, a),
        _far_gate(config),
    ]
    if not config.measures_elevation:
        notes.append("It measures no elevation (TX2 does not send): everything counts as being at the drone's height.")
    if config.removes_static:
        notes.append("It removes what stands still (clutterRemoval 1): a hovering drone will see no obstacle.")
    if not config.sends_side_information:
        notes.append(
            f"It sends no side information (guiMonitor): every target counts as {config.least_snr_db:g} dB strong."
        )
    return [note for note in notes if note]


def other_configuration(frame: TiFrame, config: TiConfig) -> str:
    """Why this frame cannot come from a radar with that configuration, as far as it shows; empty where it may."""
    cells = len(frame.range_profile)
    if cells in (0, config.range_cells):
        return ""
    return (
        f"The radar sends {cells} range cells and {config.file} makes {config.range_cells}: it runs with another "
        "configuration. Speeds and times may be wrong."
    )


def _differs(what: str, value: float, assumed: float, unit: str) -> str:
    if 1 / ENOUGH <= value / assumed <= ENOUGH:
        return ""
    return f"{what} {value:.3g} {unit}; the map counts on {assumed:g} {unit}."


def _fastest(config: TiConfig, a: Assumed) -> str:
    note = _differs("It tells speeds to", config.fastest_m_s, a.fastest_m_s, "m/s")
    if note and config.fastest_m_s < a.fastest_m_s:
        note += " Flown faster than it tells, it takes fixed things for moving ones."
    return note


def _period(config: TiConfig, a: Assumed) -> str:
    note = _differs("A frame comes every", config.frame_period_s, a.frame_period_s, "s")
    if config.frame_period_s >= NEARLY_SILENT_S:
        note += f" Avoidance brakes and holds where frames are more than {SILENT_S:g} s apart."
    return note


def _azimuth(config: TiConfig, a: Assumed) -> str:
    if config.azimuth_antennas == a.azimuth_antennas:
        return ""
    angle, usual = math.degrees(config.azimuth_cell_rad), math.degrees(2 / a.azimuth_antennas)
    return f"It tells azimuths to {angle:.0f} deg; the map counts on {usual:.0f} deg ({a.azimuth_antennas} antennas)."


def _field_of_view(config: TiConfig, a: Assumed) -> str:
    command = _found(config, "aoaFovCfg")
    if command is None:
        return ""
    left, right = (command.number(len(command.values) - k, "an angle") for k in (4, 3))
    if right - left >= a.field_of_view_deg:
        return ""
    return f"It looks {left:g} to {right:g} deg to the sides; the map counts on {a.field_of_view_deg:g} deg in all."


def _far_gate(config: TiConfig) -> str:
    command = _found(config, "cfarFovCfg")
    if command is None or command.whole(len(command.values) - 3, "the direction") != 0:
        return ""
    gate_m = command.number(len(command.values) - 1, "the range")
    return f"It reports nothing beyond {gate_m:g} m (cfarFovCfg)." if gate_m < config.farthest_m / ENOUGH else ""


def _found(config: TiConfig, name: str) -> Command | None:
    return next((command for command in config.commands if command.name == name), None)
