"""Configurations of TI's radars: what they make of the sensor, and every way to contradict oneself."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mapping.errors import RadarDataError
from mapping.radar.radar_params import AWR1843
from telemetry.flight.avoidance.regions import OLD_S
from telemetry.sensors.ti_mmwave.cfg_commands import parse_commands, read_commands
from telemetry.sensors.ti_mmwave.config import config_of, read_config
from telemetry.sensors.ti_mmwave.differences import SILENT_S, differences
from telemetry.sensors.ti_mmwave.ti_config import TiConfig, fmcw_params

GOOD = """% 120 m at 0.5 m, three transmitters
sensorStop
flushCfg
dfeDataOutputMode 1
channelCfg 15 7 0
adcCfg 2 1
adcbufCfg -1 0 1 1 1
profileCfg 0 77 3 3 31.5 0 0 11.71 1 256 10000 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
chirpCfg 2 2 0 0 0 0 0 2
frameCfg 0 2 60 0 100 1 0
guiMonitor -1 1 0 0 0 0 0
cfarCfg -1 0 2 8 4 3 0 15 1
clutterRemoval -1 0
aoaFovCfg -1 -90 90 -90 90
sensorStart
"""


def config(text: str = GOOD, **changes: str) -> TiConfig:
    """The good one, with single lines replaced; an empty line removes the command."""
    lines = [
        next((new for name, new in changes.items() if line.split()[0] == name), line) for line in text.splitlines()
    ]
    return config_of(parse_commands("\n".join(lines), file="radar.cfg"))


# Values of TI's visualizer, from the files' own comments and gates; its 0.13 m/s are 0.122 here.
@pytest.mark.parametrize(
    ("name", "range_m", "farthest_m", "velocity_m_s", "elevation"),
    [("1843RangeDoppler.cfg", 0.044, 3.38, 0.13, True), ("AWR1843config.cfg", 0.044, 8.92, 0.13, False)],
)
def test_the_recorded_configurations_come_out_as_their_comments_say(
    shared_data: Path, name: str, range_m: float, farthest_m: float, velocity_m_s: float, elevation: bool
) -> None:
    found = read_config(shared_data / "radar" / "awr1843_cfg" / name)
    assert found.range_cell_m == pytest.approx(range_m, abs=0.0005)
    assert found.farthest_m == pytest.approx(farthest_m, abs=0.01)
    assert found.velocity_cell_m_s == pytest.approx(velocity_m_s, rel=0.07)
    assert found.fastest_m_s == pytest.approx(1.0, rel=0.03)
    assert math.degrees(found.azimuth_cell_rad) == pytest.approx(15, abs=1)
    assert found.measures_elevation is elevation
    notes = differences(found)
    assert any("map counts on 120 m" in note for note in notes)
    assert any("map counts on 0.5 m" in note for note in notes)
    assert any("no elevation" in note for note in notes) is not elevation


@pytest.mark.parametrize(("period_ms", "brakes"), [(300, False), (400, True), (1000, True)])
def test_a_radar_so_slow_that_avoidance_takes_it_for_silent_is_said(period_ms: int, brakes: bool) -> None:
    notes = differences(config(frameCfg=f"frameCfg 0 2 60 0 {period_ms} 1 0"))
    (note,) = (note for note in notes if note.startswith("A frame comes every"))
    assert ("Avoidance brakes and holds where frames are more than 0.5 s apart." in note) is brakes


def test_silence_is_what_avoidance_takes_for_it() -> None:
    assert SILENT_S == OLD_S


@pytest.mark.parametrize(
    ("samples", "adc", "cells"),
    [(256, "adcbufCfg -1 0 1 1 1", 256), (240, "adcbufCfg -1 0 1 1 1", 256), (256, "adcbufCfg -1 1 1 1 1", 128)],
)
def test_range_cells_are_those_of_the_radars_own_transform(samples: int, adc: str, cells: int) -> None:
    profile = f"profileCfg 0 77 3 3 31.5 0 0 11.71 1 {samples} 10000 0 0 30"
    assert config(profileCfg=profile, adcbufCfg=adc).range_cells == cells


def test_a_radar_as_the_map_counts_on_differs_in_nothing() -> None:
    found = config()
    assert differences(found) == []
    assert found.range_cell_m == pytest.approx(0.5, abs=0.01)
    assert found.fastest_m_s == pytest.approx(10.4, rel=0.2)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"clutterRemoval": "clutterRemoval -1 1"}, "no obstacle"),
     ({"guiMonitor": "guiMonitor -1 2 0 0 0 0 0"}, "15 dB strong"),
     ({"frameCfg": "frameCfg 0 0 60 0 100 1 0"}, "29 deg"),
     ({"frameCfg": "frameCfg 0 2 60 0 400 1 0"}, "every 0.4 s"),
     ({"frameCfg": "frameCfg 0 2 16 0 100 1 0"}, "Speed cells"),
     ({"aoaFovCfg": "aoaFovCfg -1 -45 45 -90 90"}, "-45 to 45 deg"),
     ({"cfarCfg": "cfarFovCfg -1 0 0 50.0"}, "nothing beyond 50 m"),
     ({"profileCfg": "profileCfg 0 77 400 3 31.5 0 0 11.71 1 256 10000 0 0 30"}, "fixed things for moving")],
)  # fmt: skip
def test_each_difference_is_said(changes: dict[str, str], words: str) -> None:
    changes = {"frameCfg": "frameCfg 0 2 60 0 100 1 0"} | changes
    if "400" in changes.get("profileCfg", ""):
        changes["frameCfg"] = "frameCfg 0 2 60 0 100 1 0".replace("60", "32")
    assert any(words in note for note in differences(config(**changes)))


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"profileCfg": ""}, "no profileCfg"),
     ({"frameCfg": ""}, "no frameCfg"),
     ({"profileCfg": "profileCfg 0 77 3"}, "profileCfg has 3 values, and the number of samples is not among them"),
     ({"profileCfg": "profileCfg 0 77 x 3 31.5 0 0 11.71 1 256 10000 0 0 30"}, 'idle time is "x"'),
     ({"profileCfg": "profileCfg 0 77 3 3 31.5 0 0 11.71 1 256.5 10000 0 0 30"}, "no whole number"),
     ({"profileCfg": "profileCfg 0 77 3 3 31.5 0 0 0 1 256 10000 0 0 30"}, "must be above 0"),
     ({"profileCfg": "profileCfg 0 77 3 3 31.5 0 0 nan 1 256 10000 0 0 30"}, 'the slope is "nan"'),
     ({"profileCfg": "profileCfg 0 77 -3 3 31.5 0 0 11.71 1 256 10000 0 0 30"}, "negative"),
     ({"profileCfg": "profileCfg 0 77 3 3 31.5 0 0 11.71 1 512 10000 0 0 30"}, "the ramp ends after 31.5 us"),
     ({"frameCfg": "frameCfg 0 3 60 0 100 1 0"}, "Chirp 3 has no chirpCfg"),
     ({"frameCfg": "frameCfg 2 0 60 0 100 1 0"}, "no sequence"),
     ({"frameCfg": "frameCfg 0 2 0 0 100 1 0"}, "no frames"),
     ({"frameCfg": "frameCfg 0 2 255 0 10 1 0"}, "a frame has 10 ms"),
     ({"frameCfg": "frameCfg 0 2 inf 0 10 1 0"}, 'is "inf"'),
     ({"channelCfg": "channelCfg 15 5 0"}, "TX2 is not switched on"),
     ({"channelCfg": "channelCfg 0 7 0"}, "No receiver"),
     ({"dfeDataOutputMode": "dfeDataOutputMode 3"}, "no sub-frames"),
     ({"flushCfg": "profileCfg 1 77 3 3 31.5 0 0 11.71 1 256 10000 0 0 30"}, "second profileCfg"),
     ({"chirpCfg": "chirpCfg 0 2 0 0 0 0 0 3"}, "at once")],
)  # fmt: skip
def test_a_configuration_that_contradicts_itself_is_refused(changes: dict[str, str], words: str) -> None:
    with pytest.raises(RadarDataError) as caught:
        config(**changes)
    assert words in caught.value.what
    assert caught.value.where.startswith("radar.cfg")


def test_the_line_is_named() -> None:
    with pytest.raises(RadarDataError) as caught:
        config(profileCfg="profileCfg 0 77 x 3 31.5 0 0 11.71 1 256 10000 0 0 30")
    assert caught.value.where == "radar.cfg, line 8"


@pytest.mark.parametrize("data", [b"", b"% only a comment\n\n", b"\0\1\2", b"\xff\xfe\xfd", b"x" * 200_000])
def test_other_files_are_no_configuration(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "other.cfg"
    path.write_bytes(data)
    with pytest.raises(RadarDataError, match=r"other\.cfg"):
        read_commands(path)


NUMBERS = st.sampled_from(
    ["", "-1", "0", "1e300", "inf", "nan", "255", "0.5", "65536", "profileCfg", "-99999999999", "x"]
)


@given(st.lists(st.tuples(st.integers(0, 10_000), NUMBERS), min_size=1, max_size=6))
@example([(440, "nan")])
def test_any_damage_leaves_a_configuration_or_is_refused(damage: list[tuple[int, str]]) -> None:
    words = [[str(word) for word in line.split()] for line in GOOD.splitlines()]
    places = [(row, column) for row, line in enumerate(words) for column in range(len(line))]
    for place, value in damage:
        row, column = places[place % len(places)]
        words[row][column] = value
    text = "\n".join(" ".join(line) for line in words)
    with contextlib.suppress(RadarDataError):
        found = config_of(parse_commands(text, file="radar.cfg"))
        differences(found)
        params = fmcw_params(found)
        assert found.range_cell_m > 0
        assert params.range_resolution_m == pytest.approx(found.range_cell_m)


def test_comments_and_spaces_do_not_count() -> None:
    commands = parse_commands("  % all\n\n  frameCfg  0 2\t16 % why\r\n", file="a.cfg")
    assert [(command.line, command.text) for command in commands] == [(3, "frameCfg 0 2 16")]


def test_the_waveform_is_that_of_the_usual_radar() -> None:
    params = fmcw_params(config(frameCfg="frameCfg 0 2 64 0 100 1 0"))
    assert params.shape == AWR1843.shape
    assert params.antennas == AWR1843.antennas
    assert params.tdm_order == AWR1843.tdm_order
    assert params.range_resolution_m == pytest.approx(AWR1843.range_resolution_m, rel=0.01)


def test_antennas_follow_the_order_of_the_transmitters() -> None:
    lines = {"channelCfg": "channelCfg 5 7 0", "frameCfg": "frameCfg 1 2 16 0 100 1 0"}
    params = fmcw_params(config(**lines))
    assert params.antennas == ((2.0, 0.0), (3.0, 0.0), (1.0, 0.5), (2.0, 0.5))
    assert params.tdm_order == (0, 0, 1, 1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"adcbufCfg": "adcbufCfg -1 1 1 1 1"}, "real samples"), ({"chirpCfg": "chirpCfg 0 2 0 0 0 0 0 1"}, "twice")],
)
def test_what_the_chain_cannot_process_is_said(changes: dict[str, str], words: str) -> None:
    with pytest.raises(RadarDataError, match=words):
        fmcw_params(config(**changes))
