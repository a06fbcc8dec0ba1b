"""``hedgehop agent`` with a Position2Go: a board whose samples reach the bus as targets, lost and found again."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mapping.sensor_frames import rows
from tests.server.cli_runs import hedgehop
from tests.server.running import Running, running
from tests.server.test_cli_agent_ti import NOWHERE, PATIENCE_S, command, radar_frames, started
from tests.telemetry.position2go_board import plugged

pytestmark = pytest.mark.xdist_group("sensor-link")


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data")) as made:
        yield made


def until(wanted: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not wanted():
        assert time.monotonic() < end_s, "it never came"
        time.sleep(0.05)


def test_a_board_is_set_up_read_and_found_again(server: Running, tmp_path: Path) -> None:
    with plugged(tmp_path) as board, started(command(server, tmp_path, "--position2go", board.device)) as agent:
        until(lambda: len(radar_frames(server)) >= 5)
        board.damage = ["lost byte", "cut short"]
        until(lambda: not board.damage)
        damaged = board.frames
        until(lambda: board.frames >= damaged + 3)
        board.unplug()
        board.plug()
        begun = len(radar_frames(server))
        until(lambda: len(radar_frames(server)) >= begun + 5)
        agent.send_signal(signal.SIGINT)
        out, err = agent.communicate(timeout=PATIENCE_S)
    answer = json.loads(out)
    assert answer["radar"]["interruptions"] == 1
    assert answer["radar"]["lost_frames"] >= 2
    assert answer["lost"] >= 2
    assert "range cells are 0.75 m" in err
    assert "The radar sends frames again." in err
    for frame in radar_frames(server):
        places, snr_db = rows(frame.xyz_m, 3), rows(frame.snr_db, 1)[:, 0]
        right, forward, up = places[np.argmax(snr_db)]
        assert (np.hypot(right, forward), np.degrees(np.arctan2(right, forward)), up) == pytest.approx(
            (8.0, 20.0, 0.0), abs=3.0
        )


def test_options_that_do_not_go_together_and_a_port_that_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "token.txt").write_text("x" * 40)
    base = ("agent", NOWHERE, "--token-file", tmp_path / "token.txt", "--position2go", tmp_path / "ttyACM0")
    run = hedgehop(*base)
    assert (run.code, "There is no such port" in run.err) == (1, True)
    both = hedgehop(*base, "--ti-capture", tmp_path / "a.bin")
    assert (both.code, "--ti-capture and --position2go are two sources" in both.err) == (2, True)
