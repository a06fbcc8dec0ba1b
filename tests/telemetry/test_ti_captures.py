"""A TI radar's frames as readings, and captures of its data port: played by the numbers of their frames."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from mapping.errors import RadarDataError
from telemetry.agent.client import RadarReading
from telemetry.agent.sources import at
from telemetry.agent.ti_radar import LONGEST_PAUSE_S, TiStatus, captured_readings, frame_reading
from telemetry.sensors.ti_mmwave.cfg_commands import parse_commands
from telemetry.sensors.ti_mmwave.config import config_of
from telemetry.sensors.ti_mmwave.packets import TiStream
from telemetry.sensors.ti_mmwave.ti_config import TiConfig
from tests.telemetry.test_ti_config import GOOD
from tests.telemetry.ti_packets import POINTS, frame, sdk2, sdk3, with_profile

CONFIG = config_of(parse_commands(GOOD, file="radar.cfg"))


def captured(
    path: Path,
    config: TiConfig | None = CONFIG,
    *,
    status: TiStatus | None = None,
    tell: Callable[[str], None] = pytest.fail,
) -> list[tuple[float, RadarReading]]:
    return list(captured_readings(path, config, status or TiStatus(), tell=tell))


def test_a_thousand_targets_are_sent_and_no_more() -> None:
    points = [(0.0, 10.0 + 0.01 * k, 0.0, 0.0) for k in range(1500)]
    (found,) = TiStream().feed(sdk3(1, points, [10.0 + 0.1 * (k // 500) for k in range(1500)]))
    reading = frame_reading(found, 0.0, 15.0)
    assert reading.targets.shape == (1000, 5)
    assert reading.targets[0, 1] == pytest.approx(15.0)
    assert reading.targets[:, 4].min() > 10.05


def test_targets_beyond_a_thousand_are_counted_and_told_once(tmp_path: Path) -> None:
    path, status, told = tmp_path / "radar.bin", TiStatus(), list[str]()
    crowd = [(0.0, 10.0 + 0.01 * k, 0.0, 0.0) for k in range(1300)]
    path.write_bytes(frame(1) + sdk3(2, crowd) + sdk3(3, crowd[:1000]) + sdk3(4, crowd[:1100]))
    assert [len(reading.targets) for _, reading in captured(path, status=status, tell=told.append)] == [
        2, 1000, 1000, 1000,
    ]  # fmt: skip
    assert told == ["A frame has 1,300 targets: the 1,000 strongest are passed on, the others are not."]
    assert (status.left_out, status.as_dict()["left_out"]) == (400, 400)
    assert "400 beyond 1,000 of a frame left out" in str(status)
    assert "left out" not in str(TiStatus())


def test_targets_of_unknown_strength_count_as_just_detected() -> None:
    (found,) = TiStream().feed(sdk3(1, POINTS))
    reading = frame_reading(found, 0.0, 13.5)
    assert reading.targets[:, 4].tolist() == [13.5, 13.5]


def test_a_capture_plays_by_the_numbers_of_its_frames(tmp_path: Path) -> None:
    path, status = tmp_path / "radar.bin", TiStatus()
    path.write_bytes(frame(10) + sdk3(11, []) + b"noise" + frame(14) + frame(15)[:60])
    readings = captured(path, status=status)
    assert [after_s for after_s, _ in readings] == pytest.approx([0.0, 0.1, 0.4])
    assert [len(reading.targets) for _, reading in readings] == [2, 0, 2]
    assert [reading.lost for _, reading in readings] == [0, 0, 2]
    assert (status.stream.bad_bytes, status.stream.lost_packets, status.points) == (65, 2, 4)
    moved = at(readings[2][1], 9.0)
    assert isinstance(moved, RadarReading)
    assert (moved.t_s, moved.lost) == (9.0, 2)


@pytest.mark.parametrize(
    ("numbers", "after_s", "lost"),
    [((10, 11, 12 + 8192, 13, 14), (0.0, 0.1, 0.2, 0.3, 0.4), 0),
     ((10, 11, 42, 43), (0.0, 0.1, 3.2, 3.3), 30),
     ((10, 11, 8012, 8013), (0.0, 0.1, 0.1 + LONGEST_PAUSE_S, 0.2 + LONGEST_PAUSE_S), 8000),
     ((10, 11, 1, 2), (0.0, 0.1, 0.2, 0.3), 0),
     ((10, 11, 500), (0.0, 0.1, 0.2), 0)],
    ids=["flipped bit", "gap", "long gap", "begun anew", "flipped at the end"],
)  # fmt: skip
def test_a_capture_pauses_for_gaps_alone_and_never_for_long(
    tmp_path: Path, numbers: tuple[int, ...], after_s: tuple[float, ...], lost: int
) -> None:
    path, status = tmp_path / "radar.bin", TiStatus()
    path.write_bytes(b"".join(frame(n) for n in numbers))
    assert [after for after, _ in captured(path, status=status)] == pytest.approx(after_s)
    assert status.stream.lost_packets == lost


@pytest.mark.parametrize(("cells", "told"), [(256, 0), (128, 1), (0, 0)])
def test_a_capture_from_another_configuration_is_said_once(tmp_path: Path, cells: int, told: int) -> None:
    path, said = tmp_path / "radar.bin", list[str]()
    path.write_bytes(b"".join(with_profile(n, cells) for n in range(3)))
    assert len(captured(path, tell=said.append)) == 3
    assert len(said) == told
    for text in said:
        assert text.startswith("The radar sends 128 range cells and radar.cfg makes 256")
        assert "--ti-config" in text


def test_a_capture_without_a_configuration_contradicts_none(tmp_path: Path) -> None:
    path, said = tmp_path / "radar.bin", list[str]()
    path.write_bytes(with_profile(1, 128))
    captured(path, None, tell=said.append)
    assert said == []


def test_an_old_capture_needs_its_configuration(tmp_path: Path) -> None:
    path = tmp_path / "old.bin"
    path.write_bytes(sdk2(1, [(40, -10, -2.5, 19.75, 0.25)]))
    with pytest.raises(RadarDataError, match="--ti-config"):
        captured(path, None)
    ((_, reading),) = captured(path)
    assert reading.targets[0, 3] == pytest.approx(-10 * CONFIG.velocity_cell_m_s)


@pytest.mark.parametrize("data", [b"", b"no radar at all", bytes(100_000)])
def test_a_file_without_a_frame_is_no_capture(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "other.bin"
    path.write_bytes(data)
    with pytest.raises(RadarDataError, match=r"other\.bin: There is no frame"):
        captured(path)
