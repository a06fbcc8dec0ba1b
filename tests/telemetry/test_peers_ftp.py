"""MAVProxy, unchanged and in a process of its own, and Hedgehop read the same log and the same file of all parameters
by MAVLink FTP."""

import importlib.util
from pathlib import Path

import pytest

from telemetry.mavlink.parameters.packed import read_packed
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS
from tests.server.cli_runs import hedgehop
from tests.telemetry.simulator_process import child, simulated_vehicle


@pytest.mark.fact("A48")
@pytest.mark.slow
def test_mavproxy_and_hedgehop_read_the_same_files(tmp_path: Path) -> None:
    if importlib.util.find_spec("MAVProxy") is None:
        pytest.skip("MAVProxy is not installed: pip install --no-deps -r requirements-peers.txt")
    theirs, ours = tmp_path / "theirs.bin", tmp_path / "ours"
    ours.mkdir()
    with simulated_vehicle(tmp_path, "--parameter", "ARMING_CHECK=0", "--parameter", "DISARM_DELAY=1") as (_, port):
        link = f"tcp:127.0.0.1:{port}"
        arguments = ["-m", "MAVProxy.mavproxy", "--master", link, "--default-modules", "param,arm,ftp"]
        arguments += ["--source-system", "254", "--source-component", "190", "--logfile", str(tmp_path / "mav.tlog")]
        environment = {"HOME": str(tmp_path), "MAVLINK20": "1"}
        with child(arguments, tmp_path / "station.log", typing=True, environment=environment) as station:
            station.wait_for("parameters (ftp)")
            packed = tmp_path / "param.pck"
            station.type(f"ftp get @PARAM/param.pck?withdefaults=1 {packed}")
            station.wait_for(f"bytes to {packed}")
            # It disarms by itself on the ground; from then on the log is whole.
            station.type("arm throttle force")
            armed = station.wait_for("ARMED")
            station.wait_for("DISARMED", after=armed)
            station.type("ftp list /APM/LOGS")
            station.wait_for("00000001.BIN")
            station.type(f"ftp get /APM/LOGS/00000001.BIN {theirs}")
            station.wait_for(f"bytes to {theirs}")
        run = hedgehop("logs", "get", "newest", "--link", link, "--out", ours)
        assert run.code == 0, run.err
    found = read_packed(packed.read_bytes())
    assert {(p.name, p.value) for p in found} >= {("ARMING_CHECK", 0.0), ("DISARM_DELAY", 1.0), ("RTL_ALT", 1500.0)}
    assert len(found) == len(SPECS)
    (log,) = ours.glob("*.bin")
    assert log.read_bytes() == theirs.read_bytes()
    assert log.stat().st_size > 1000
