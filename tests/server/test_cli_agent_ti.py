"""``hedgehop agent`` with a TI radar: options that go together, and a board whose frames reach the bus."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from mapping.sensor_frames import RadarFrame, rows
from server.door.sensor_token import sensor_token
from telemetry.topics.messages import Topic, VehicleText
from tests.server.cli_runs import hedgehop
from tests.server.running import Running, running
from tests.telemetry.test_ti_config import GOOD
from tests.telemetry.ti_board import Board, plugged
from tests.telemetry.ti_packets import packet, sdk3, side_information, tlv

pytestmark = pytest.mark.xdist_group("sensor-link")
PATIENCE_S = 90.0
POINTS = [(1.0, 20.0, 0.5, -3.0), (-4.0, 60.0, 2.0, 0.31)]
NOWHERE = "http://127.0.0.1:9"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data")) as made:
        yield made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "radar.cfg").write_text(GOOD)
    (tmp_path / "token.txt").write_text("x" * 40)
    return tmp_path


def frame(number: int) -> bytes:
    return sdk3(number, POINTS, [20.0, 15.5])


def command(server: Running, folder: Path, *arguments: object) -> list[str]:
    (folder / "token.txt").write_text(sensor_token(server.settings.data_dir))
    server.flying.published.clear()
    base = [sys.executable, "-m", "server", "agent", server.origin, "--token-file", str(folder / "token.txt"), "--json"]
    return [*base, *map(str, arguments)]


def radar_frames(server: Running) -> list[RadarFrame]:
    return [m for topic, m in server.flying.published if topic == Topic.RADAR_FRAME and isinstance(m, RadarFrame)]


def test_a_capture_reaches_the_bus_and_its_lost_frames_are_gaps(server: Running, folder: Path) -> None:
    profile = tlv(2, bytes(2 * 128))
    second = packet(2, 2, [tlv(1, np.array(POINTS, "<f4").tobytes()), side_information([20.0, 15.5]), profile])
    (folder / "capture.bin").write_bytes(frame(1) + b"noise" + second + frame(5))
    arguments = ("--ti-capture", folder / "capture.bin", "--ti-config", folder / "radar.cfg")
    done = subprocess.run(
        command(server, folder, *arguments), capture_output=True, text=True, timeout=2 * PATIENCE_S, check=False
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["sent"], answer["received"], answer["lost"]) == (3, 3, 2)
    assert (answer["radar"]["bad_bytes"], answer["radar"]["lost_packets"], answer["radar"]["points"]) == (5, 2, 6)
    assert done.stderr.count("128 range cells and radar.cfg makes 256") == 1
    frames = radar_frames(server)
    assert [one.number for one in frames] == [0, 1, 4]
    assert rows(frames[0].xyz_m, 3).tolist() == [[1.0, 20.0, 0.5], [-4.0, 60.0, 2.0]]


def test_a_board_is_configured_read_and_found_again(server: Running, folder: Path) -> None:
    arguments = ("--ti-data", folder / "ttyACM1", "--ti-config", folder / "radar.cfg")
    with plugged(folder) as board, started(command(server, folder, *arguments)) as agent:
        send_until(server, board, wanted=1)
        board.unplug()
        board.plug()
        send_until(server, board, wanted=len(radar_frames(server)) + 1)
        notices = [m.text for topic, m in server.flying.published if topic == Topic.TEXT and isinstance(m, VehicleText)]
        agent.send_signal(signal.SIGINT)
        out, err = agent.communicate(timeout=PATIENCE_S)
    assert b"sensorStart" in board.lines
    answer = json.loads(out)
    assert answer["radar"]["interruptions"] == 1
    assert answer["radar"]["trouble"] == ""
    assert any("radar: " in text for text in notices)
    assert "configured through" in err
    assert "The radar sends frames again." in err


@contextmanager
def started(arguments: list[str]) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as agent:
        try:
            yield agent
        finally:
            agent.kill()


def send_until(server: Running, board: Board, *, wanted: int) -> None:
    """A frame now and then, as a radar does, until so many have come through."""
    end_s, number = time.monotonic() + PATIENCE_S, 0
    while len(radar_frames(server)) < wanted:
        assert time.monotonic() < end_s, "no frame came"
        number += 1
        board.send(frame(number))
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(("--ti-data", "/dev/ttyACM1"), "configuration is missing"),
     (("--ti-config", "radar.cfg"), "no radar for this configuration"),
     (("--ti-config-port", "/dev/ttyACM0"), "needs a data port"),
     (("--ti-baud", "921600"), "A baud rate needs a data port"),
     (("--ti-baud", "115200", "--ti-capture", "a.bin"), "A baud rate needs a data port"),
     (("--ti-capture", "a.bin", "--recording", "b.mcap"), "two sources"),
     (("--ti-capture", "token.txt", "--ti-config", "none.cfg"), "none.cfg: No such file"),
     (("--ti-capture", "none.bin"), "none.bin: No such file"),
     (("--recording", "none.mcap"), "none.mcap: No such file"),
     (("--ti-data", "/dev/nowhere", "--ti-config", "mute.cfg"), "sends no points"),
     (("--ti-data", "/dev/nowhere", "--ti-config", "broken.cfg"), "broken.cfg, line 8")],
)  # fmt: skip
def test_what_does_not_go_together_is_said(
    folder: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], words: str
) -> None:
    monkeypatch.chdir(folder)
    Path("mute.cfg").write_text(GOOD.replace("guiMonitor -1 1", "guiMonitor -1 0"))
    Path("broken.cfg").write_text(GOOD.replace("profileCfg 0 77", "profileCfg 0 x"))
    run = hedgehop("agent", NOWHERE, "--token-file", "token.txt", *arguments)
    assert run.code == 2
    assert words in run.err
    assert "ground station" not in run.err


def test_a_port_that_is_not_there_is_said_before_anybody_is_called(folder: Path) -> None:
    run = hedgehop("agent", NOWHERE, "--token-file", folder / "token.txt", "--ti-config", folder / "radar.cfg",
                   "--ti-data", folder / "ttyACM1")  # fmt: skip
    assert run.code == 1
    assert "There is no such port" in run.err
    assert "ground station" not in run.err


def test_a_data_port_alone_needs_its_config_port(folder: Path) -> None:
    with plugged(folder) as board:
        board.config.rename(folder / "elsewhere")
        run = hedgehop("agent", NOWHERE, "--token-file", folder / "token.txt", "--ti-config", folder / "radar.cfg",
                       "--ti-data", board.data)  # fmt: skip
        (folder / "elsewhere").rename(board.config)
    assert run.code == 2
    assert "is not known" in run.err


def test_what_the_map_does_not_count_on_is_said(shared_data: Path, folder: Path) -> None:
    cfg = shared_data / "radar" / "awr1843_cfg" / "AWR1843config.cfg"
    run = hedgehop("agent", NOWHERE, "--token-file", folder / "token.txt", "--ti-config", cfg,
                   "--ti-data", "/dev/nowhere")  # fmt: skip
    assert "It sees to 8.92 m; the map counts on 120 m." in run.err
    assert run.code == 1
