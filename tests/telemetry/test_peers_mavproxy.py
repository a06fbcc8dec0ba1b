"""MAVProxy, unchanged and in a process of its own, flies the simulated vehicle."""

import importlib.util
from pathlib import Path

import pytest

from tests.telemetry.simulator_process import FAST, child, simulated_vehicle

MODULES = "wp,param,arm,mode,cmdlong,misc"
"""The default ones also talk to radios, terrain servers and joysticks."""
MISSION = """QGC WPL 110
0	1	0	16	0	0	0	0	-37.1244507	175.6892878	803.24	1
1	0	3	22	0	0	0	0	-37.1244507	175.6892878	10	1
2	0	3	16	0	0	0	0	-37.1243007	175.6892878	12	1
3	0	3	16	1	0	0	0	-37.1243007	175.6894378	15	1
4	0	3	20	0	0	0	0	0	0	0	1
"""


@pytest.fixture
def mavproxy() -> None:
    if importlib.util.find_spec("MAVProxy") is None:
        pytest.skip("MAVProxy is not installed: pip install --no-deps -r requirements-peers.txt")


@pytest.mark.fact("A50")
@pytest.mark.slow
@pytest.mark.usefixtures("mavproxy")
def test_mavproxy_loads_a_mission_and_flies_it_to_the_end(tmp_path: Path) -> None:
    mission = tmp_path / "mission.waypoints"
    mission.write_text(MISSION)
    with simulated_vehicle(tmp_path, *FAST) as (_, port):
        arguments = ["-m", "MAVProxy.mavproxy", "--master", f"tcp:127.0.0.1:{port}", "--default-modules", MODULES]
        arguments += ["--source-system", "255", "--source-component", "190", "--logfile", str(tmp_path / "mav.tlog")]
        with child(arguments, tmp_path / "station.log", typing=True, environment={"HOME": str(tmp_path)}) as station:
            station.wait_for("parameters")
            station.type(f"wp load {mission}")
            station.wait_for("Flight plan received")
            station.type("mode GUIDED")
            station.wait_for("Mode GUIDED")
            station.type("arm throttle")
            station.wait_for("ARMED")
            station.type("mode AUTO")
            station.wait_for("Mode AUTO")
            station.type("long MISSION_START 0 0")
            at = station.wait_for("Reached command #2")
            at = station.wait_for("Reached command #3", after=at)
            at = station.wait_for("Mission: 4 RTL", after=at)
            at = station.wait_for("SIM Hit ground at", after=at)
            station.wait_for("DISARMED", after=at)
            assert "Sent all 5 waypoints" in station.output()
