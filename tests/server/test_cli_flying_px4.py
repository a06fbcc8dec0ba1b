"""``hedgehop fly --mode auto`` from upload to landing, on a simulated PX4."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.server.flight_logs import PLAIN
from tests.server.test_cli_flying import HOME, SHORT, hedgehop, simulated_vehicle, write_dsm, write_mission

QUICK = (
    "--autopilot", "px4", "--boot-s", 1, "--speedup", 6, "--parameter", "RTL_RETURN_ALT=20", "--parameter",
    "MPC_LAND_SPEED=1.5",
)  # fmt: skip


@pytest.mark.slow
def test_a_px4_is_flown_to_the_end(tmp_path: Path) -> None:
    write_dsm(tmp_path / "plain.tif", PLAIN)
    flight = write_mission(tmp_path / "short.waypoints", replace(SHORT, firmware="px4"))
    (tmp_path / "px4.toml").write_text('name = "x500"\nfirmware = "px4"\nposition_error_m = 0.1\nrtl_height_m = 20.0\n')
    with simulated_vehicle(HOME, *QUICK) as link:
        run = hedgehop(
            "fly", flight, "--link", link, "--dsm", tmp_path / "plain.tif", "--profile", tmp_path / "px4.toml",
            "--mode", "auto", "--json",
        )  # fmt: skip
    assert run.code == 0, run.out + run.err
    assert run.json["completed"] is True
    assert "px4 1.17.0" in run.err
    assert run.json["cross_track_max_m"] < 2.0
    assert run.json["height_error_max_m"] < 1.6
    assert 9.0 < run.json["min_distance_m"] < 13.0
