"""MAVSDK against us, both ways: it flies the simulated vehicle, and a vehicle made of it takes our missions."""

import json
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.mavlink.actions import Action, Done, Failed, Send, ended
from telemetry.mavlink.upload import MissionUpload
from telemetry.recording.flight_log import read_flight_log
from telemetry.topics.onboard_lists import Item, UploadReport
from tests.telemetry.simulator_process import FAST, PATIENCE_S, ROOT, child, simulated_vehicle

pytest.importorskip("mavsdk")
HOME = (-37.1244507, 175.6892878, 803.24)
ITEMS = (
    Item(22, 3, (0.0, 0.0, 0.0, None), HOME[0], HOME[1], 10.0),
    Item(16, 3, (0.0, 0.0, 0.0, None), HOME[0] + 0.00015, HOME[1], 12.34),
    Item(16, 3, (2.0, 0.0, 0.0, None), HOME[0] + 0.00015, HOME[1] + 0.00015, 15.5),
    Item(20, 3, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0),
)


@pytest.mark.fact("A49")
@pytest.mark.slow
def test_mavsdk_uploads_a_mission_and_flies_it_to_the_end(tmp_path: Path) -> None:
    with simulated_vehicle(tmp_path, *FAST) as (_, port):
        place = [f"tcpout://127.0.0.1:{port}", "-371244507", "1756892878", str(tmp_path / "newest.bin")]
        done = subprocess.run(
            [sys.executable, "-m", "tests.telemetry.mavsdk_pilot", *place],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=2 * PATIENCE_S,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    seen = json.loads(done.stdout.strip().splitlines()[-1])
    assert seen["autopilot"] == "ARDUPILOT"
    assert [row[:2] for row in seen["kept"]] == [[0, 16], [3, 22], [3, 16], [3, 16], [0, 20]]
    assert [row[2:] for row in seen["kept"][2:4]] == [[-371243007, 1756892878, 12.0], [-371243007, 1756894378, 15.0]]
    assert seen["high_m"] > 14
    assert abs(seen["end_m"]) < 0.5
    own = read_flight_log(tmp_path / "newest.bin")
    assert (tmp_path / "newest.bin").stat().st_size == seen["log_bytes"][-1]
    assert [armed for _, armed in own.armed] == [True, False]
    assert own.track.alt_rel_home_m.max() == pytest.approx(seen["high_m"], abs=1.0)
    assert own.faults == ()


@pytest.mark.fact("P39")
@pytest.mark.slow
def test_mavsdk_flies_the_simulated_px4(tmp_path: Path) -> None:
    quick = ("--speedup", "8", "--parameter", "MPC_LAND_SPEED=1.5", "--parameter", "MPC_LAND_CRWL=1")
    with simulated_vehicle(tmp_path, "--autopilot", "px4", *quick) as (_, port):
        done = subprocess.run(
            [sys.executable, "-m", "tests.telemetry.mavsdk_px4_pilot", f"tcpout://127.0.0.1:{port}", "-371244507",
             "1756892878"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=2 * PATIENCE_S,
        )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    seen = json.loads(done.stdout.strip().splitlines()[-1])
    assert (seen["autopilot"], seen["cone_deg"]) == ("PX4", 45)
    assert [row[:2] for row in seen["kept"]] == [[6, 22], [6, 16], [6, 16], [2, 20]]
    assert seen["kept"][1][2:] == pytest.approx([1.6, -371243007, 1756892878, 12.34], abs=1e-5)
    assert seen["high_m"] > 14
    assert abs(seen["end_m"]) < 0.5


class _Station:
    """A datagram socket with the transfer machines behind it."""

    def __init__(self, ours: socket.socket) -> None:
        self._socket = ours
        self._in, self._out = wire.MAVLink(None), wire.MAVLink(None, 255, 190)
        self._in.robust_parsing = True
        self._vehicle = ("", 0)

    def messages(self) -> list[wire.MAVLink_message]:
        try:
            data, self._vehicle = self._socket.recvfrom(2048)
        except TimeoutError:
            return []
        return self._in.parse_buffer(data) or []

    def wait_for(self, kind: str) -> wire.MAVLink_message:
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            for message in self.messages():
                if message.get_type() == kind:
                    return message
        raise AssertionError(f"no {kind} came")

    def send(self, message: wire.MAVLink_message) -> None:
        self._socket.sendto(message.pack(self._out), self._vehicle)

    def carry_out(self, machine: MissionUpload) -> Done | Failed:
        actions = machine.start(time.monotonic())
        while not (end := ended(actions)):
            self._carry(actions)
            actions = [
                action for message in self.messages() for action in machine.on_message(message, time.monotonic())
            ]
            actions += [] if ended(actions) else machine.on_tick(time.monotonic())
        return end

    def _carry(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, Send):
                self.send(action.message)


@pytest.mark.slow
def test_hedgehop_uploads_to_a_mavsdk_vehicle_and_reads_back(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(0.05)
        url = f"udpout://127.0.0.1:{ours.getsockname()[1]}"
        with child(["-m", "tests.telemetry.mavsdk_vehicle", url], tmp_path / "vehicle.log") as vehicle:
            vehicle.wait_for("ready")
            station = _Station(ours)
            assert station.wait_for("HEARTBEAT").get_srcSystem() == 1
            station.send(wire.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            end = station.carry_out(MissionUpload(ITEMS, HOME, firmware="px4", target=(1, 1), now_s=time.monotonic()))
            assert isinstance(end, Done), end
            vehicle.wait_for("[[0,")
    report = end.result
    assert isinstance(report, UploadReport)
    assert report.verified, report.differences
    assert [item.command for item in report.onboard.items] == [22, 16, 16, 20]
