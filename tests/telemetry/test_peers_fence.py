"""MAVProxy, unchanged and in a process of its own, and Hedgehop hand each other fences, by the simulated vehicle."""

import importlib.util
from pathlib import Path

import pytest

from planning.fence.fence_model import Fence, RallyPoint, circle, polygon
from planning.formats.fence_files import read_fence, write_fence
from tests.server.cli_runs import hedgehop
from tests.telemetry.simulator_process import child, simulated_vehicle

CORNERS = [(-37.126, 175.687), (-37.126, 175.692), (-37.122, 175.692), (-37.122, 175.687)]
FENCE = Fence(
    polygons=(polygon(CORNERS, inclusion=True, where="t"),),
    circles=(circle(-37.123, 175.69, 25.0, inclusion=False, where="t"),),
)
RALLY = (RallyPoint(-37.1245, 175.6895, 40.0), RallyPoint(-37.1235, 175.688, 55.0))


@pytest.mark.fact("A46")
@pytest.mark.slow
def test_what_mavproxy_sends_hedgehop_reads_and_the_other_way_round(tmp_path: Path) -> None:
    if importlib.util.find_spec("MAVProxy") is None:
        pytest.skip("MAVProxy is not installed: pip install --no-deps -r requirements-peers.txt")
    files = {kind: tmp_path / f"{kind}.waypoints" for kind in ("fence", "rally")}
    files["fence"].write_text(write_fence("fence.waypoints", FENCE, ()))
    files["rally"].write_text(write_fence("rally.waypoints", Fence(), RALLY))
    with simulated_vehicle(tmp_path) as (_, port):
        link = f"tcp:127.0.0.1:{port}"
        arguments = ["-m", "MAVProxy.mavproxy", "--master", link, "--default-modules", "param,fence,rally"]
        arguments += ["--source-system", "254", "--source-component", "190", "--logfile", str(tmp_path / "mav.tlog")]
        environment = {"HOME": str(tmp_path), "MAVLINK20": "1"}
        with child(arguments, tmp_path / "station.log", typing=True, environment=environment) as station:
            station.wait_for("parameters")
            station.type(f"fence load {files['fence']}")
            station.wait_for("Fence received")
            station.type(f"rally load {files['rally']}")
            station.wait_for("Rally points received")
            for kind, sent in (("fence", (FENCE, ())), ("rally", (Fence(), RALLY))):
                saved = tmp_path / f"{kind}.plan"
                run = hedgehop(kind, link, "download", saved)
                assert run.code == 0, run.err
                found = read_fence(saved.name, saved.read_bytes())
                assert (found.fence, found.rally) == sent
            run = hedgehop("fence", link, "clear")
            assert run.code == 0, run.err
            files["fence"].write_text(write_fence("fence.waypoints", Fence(circles=FENCE.circles), ()))
            run = hedgehop("fence", link, "upload", files["fence"])
            assert run.code == 0, run.err
            at = len(station.output())
            station.type("fence list")
            at = station.wait_for("5004 0 -37.1230000000 175.6900000000", after=at)
            station.wait_for("p1=25.0", after=at)
