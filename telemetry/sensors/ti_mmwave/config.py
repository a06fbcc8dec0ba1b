"""Reads a radar's configuration: the commands that shape its chirps and frames, checked against each other."""

from __future__ import annotations

import math
from pathlib import Path

from mapping.errors import RadarDataError
from telemetry.sensors.ti_mmwave.cfg_commands import Command, read_commands
from telemetry.sensors.ti_mmwave.ti_config import TiConfig

LEAST_SNR_DB = 15.0
"""Of a detection where the configuration names no threshold in decibels: the demo's default."""

MOST_CHIRPS = 512
"""That the radar's sequencer knows."""


def read_config(path: Path) -> TiConfig:
    """Raises RadarDataError naming line and value, and OSError."""
    return config_of(read_commands(path))


def config_of(commands: tuple[Command, ...]) -> TiConfig:
    """Raises RadarDataError for what is missing or contradicts itself."""
    file = commands[0].file
    mode = _last(commands, "dfeDataOutputMode")
    if mode is not None and mode.whole(0, "the mode") != 1:
        raise mode.error("Only plain frames (dfeDataOutputMode 1) are understood, no sub-frames.")
    profile, frame = _only(commands, "profileCfg"), _needed(commands, "frameCfg")
    channels, adc = _needed(commands, "channelCfg"), _last(commands, "adcbufCfg")
    samples = profile.whole(9, "the number of samples")
    rate_hz = profile.number(10, "the sample rate") * 1e3
    config = TiConfig(
        file=file,
        commands=commands,
        start_frequency_hz=profile.number(1, "the start frequency") * 1e9,
        slope_hz_per_s=profile.number(7, "the slope") * 1e12,
        idle_s=profile.number(2, "the idle time") * 1e-6,
        adc_start_s=profile.number(3, "the start of sampling") * 1e-6,
        ramp_end_s=profile.number(4, "the ramp's end") * 1e-6,
        samples=samples,
        sample_rate_hz=rate_hz,
        rx=_bits(channels.whole(0, "the receivers' mask")),
        tx_order=_tx_order(commands, frame, channels),
        loops=frame.whole(2, "the number of loops"),
        frame_period_s=frame.number(4, "the frame's period") * 1e-3,
        is_complex=adc is None or adc.whole(len(adc.values) - 4, "the ADC's format") == 0,
        q_first=adc is not None and adc.whole(len(adc.values) - 3, "the sample swap") == 1,
        sends_points=_gui(commands) != 0,
        sends_side_information=_gui(commands) == 1,
        removes_static=_removes_static(commands),
        least_snr_db=_threshold_db(commands),
    )
    _check(config, profile, frame, channels)
    return config


def _check(config: TiConfig, profile: Command, frame: Command, channels: Command) -> None:
    positive = (config.start_frequency_hz, config.slope_hz_per_s, config.sample_rate_hz, config.samples)
    if not all(math.isfinite(value) and value > 0 for value in positive):
        raise profile.error("Start frequency, slope, samples and sample rate must be above 0.")
    if min(config.idle_s, config.adc_start_s, config.ramp_end_s) < 0:
        raise profile.error("A time is negative.")
    if not config.rx:
        raise channels.error("No receiver is switched on.")
    if config.loops < 1 or not config.frame_period_s > 0:
        raise frame.error(f"{config.loops} loops every {1e3 * config.frame_period_s:g} ms are no frames.")
    sampled_s = config.adc_start_s + config.samples / config.sample_rate_hz
    if sampled_s > config.ramp_end_s:
        raise profile.error(
            f"Its {config.samples} samples end {1e6 * sampled_s:.2f} us after the ramp's start, and the ramp ends "
            f"after {1e6 * config.ramp_end_s:g} us."
        )
    busy_s = config.loops * config.chirp_interval_s
    if busy_s > config.frame_period_s:
        period_ms = 1e3 * config.frame_period_s
        raise frame.error(f"Its chirps take {1e3 * busy_s:.1f} ms, and a frame has {period_ms:g} ms.")


def _tx_order(commands: tuple[Command, ...], frame: Command, channels: Command) -> tuple[int, ...]:
    """Raises RadarDataError for chirps that are not described, or sent by several transmitters at once."""
    first, last = frame.whole(0, "the first chirp"), frame.whole(1, "the last chirp")
    if not 0 <= first <= last < MOST_CHIRPS:
        raise frame.error(f"Chirps {first} to {last} are no sequence.")
    masks: dict[int, tuple[Command, int]] = {}
    for command in (command for command in commands if command.name == "chirpCfg"):
        begin, end = command.whole(0, "the first chirp"), command.whole(1, "the last chirp")
        for chirp in range(max(begin, 0), min(end, MOST_CHIRPS - 1) + 1):
            masks[chirp] = (command, command.whole(7, "the transmitters' mask"))
    order: list[int] = []
    for chirp in range(first, last + 1):
        if chirp not in masks:
            raise frame.error(f"Chirp {chirp} has no chirpCfg.")
        command, mask = masks[chirp]
        if len(_bits(mask)) != 1:
            raise command.error(f"Transmitters {mask} at once: only one after the other is understood.")
        if not mask & channels.whole(1, "the transmitters' mask"):
            raise command.error(f"Transmitter TX{_bits(mask)[0] + 1} is not switched on by channelCfg.")
        order.append(_bits(mask)[0])
    return tuple(order)


def _gui(commands: tuple[Command, ...]) -> int:
    """0: no points are sent, 1: points with side information, 2: points alone."""
    command = _last(commands, "guiMonitor")
    return 1 if command is None else command.whole(len(command.values) - 6, "the choice of points")


def _removes_static(commands: tuple[Command, ...]) -> bool:
    command = _last(commands, "clutterRemoval")
    return command is not None and bool(command.whole(len(command.values) - 1, "the choice"))


def _threshold_db(commands: tuple[Command, ...]) -> float:
    """Of the detection along range; SDK 2 writes it in a scale of its own, which is no decibels."""
    for command in commands:
        if command.name == "cfarCfg" and len(command.values) == 9 and command.whole(1, "the direction") == 0:
            threshold = command.number(7, "the threshold")
            return threshold if 1.0 <= threshold <= 60.0 else LEAST_SNR_DB
    return LEAST_SNR_DB


def _bits(mask: int) -> tuple[int, ...]:
    return tuple(bit for bit in range(8) if mask >> bit & 1)


def _last(commands: tuple[Command, ...], name: str) -> Command | None:
    return next((command for command in reversed(commands) if command.name == name), None)


def _needed(commands: tuple[Command, ...], name: str) -> Command:
    command = _last(commands, name)
    if command is None:
        raise RadarDataError(
            f"It has no {name}.", where=commands[0].file, advice="Give the whole configuration that the radar is sent."
        )
    return command


def _only(commands: tuple[Command, ...], name: str) -> Command:
    found = [command for command in commands if command.name == name]
    if len(found) > 1:
        raise found[1].error(f"A second {name}: only one is understood.")
    return _needed(commands, name)
