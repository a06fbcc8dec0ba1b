"""Detections written as a recording: what reads recordings reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mapping.errors import RadarDataError
from mapping.radar.detections import Detections
from telemetry.agent.client import RadarReading
from telemetry.agent.sources import recorded_readings
from telemetry.errors import RecordingError
from telemetry.sensors.target_recording import write_targets


def detections(count: int) -> Detections:
    ones = np.ones(count)
    return Detections(10 * ones, -ones, 0 * ones, 0 * ones, 20 * ones, np.zeros((count, 2), np.int64))


def test_frames_come_back_with_their_times_and_empty_ones_too(tmp_path: Path) -> None:
    path = tmp_path / "targets.mcap"
    written = write_targets(path, [(0.1 * k, detections(k % 3)) for k in range(6)], t_utc_s=1.6e9, source="awr1843")
    assert written == 6
    readings = [(after_s, reading) for after_s, reading in recorded_readings(path) if isinstance(reading, RadarReading)]
    assert [after_s for after_s, _ in readings] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert [len(reading.targets) for _, reading in readings] == [0, 1, 2, 0, 1, 2]
    assert readings[1][1].targets[0].tolist() == [0.0, 10.0, 0.0, -1.0, 20.0]


def test_a_file_of_that_name_is_replaced_only_by_a_whole_one(tmp_path: Path) -> None:
    path = tmp_path / "targets.mcap"
    path.write_text("precious")

    def failing():
        yield 0.0, detections(1)
        raise RadarDataError("cut")

    with pytest.raises(RadarDataError):
        write_targets(path, failing(), t_utc_s=1.6e9, source="awr1843")
    assert path.read_text() == "precious"
    write_targets(path, [(0.0, detections(1))], t_utc_s=1.6e9, source="awr1843")
    assert len(list(recorded_readings(path))) == 1
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    path = tmp_path / "none" / "targets.mcap"
    with pytest.raises(RecordingError) as caught:
        write_targets(path, [], t_utc_s=1.6e9, source="awr1843")
    assert caught.value.where == str(path)
    assert str(path.parent) in caught.value.advice


def test_a_folder_of_that_name_is_said_and_nothing_is_left(tmp_path: Path) -> None:
    (tmp_path / "targets.mcap").mkdir()
    with pytest.raises(RecordingError, match="Is a directory") as caught:
        write_targets(tmp_path / "targets.mcap", [(0.0, detections(1))], t_utc_s=1.6e9, source="awr1843")
    assert caught.value.where == str(tmp_path / "targets.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["targets.mcap"]
