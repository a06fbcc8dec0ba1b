"""``hedgehop radar tracks``: a data set as ODA's, made of a simulated hall with two poles, comes out as it was."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.errors import RadarDataError
from mapping.radar.radar_params import POSITION2GO
from telemetry.sensors.adc.oda import open_oda
from telemetry.sensors.optitrack import read_optitrack
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.sensors.iq import IqRadarSensor
from telemetry.simulation.simulator.sensors.iq_model import POSITION2GO_IQ
from telemetry.topics.vehicle import SimTruth
from tests.server.cli_runs import Run, hedgehop
from tests.telemetry.test_adc_files import oda_line

HOME = (51.99, 4.37, 0.0)
POLES_EN_M = ((0.6, 5.0), (-1.2, 8.5))
SPEED_M_S, SECONDS, LATE_S, UP_M = 0.8, 4.0, 0.5, 1.5
"""The radar's file begins ``LATE_S`` after the capture's."""
RADAR_ZERO_NS, CAPTURE_ZERO_NS = 7_000_000_000, 90_000_000_000


def at(t_s: float) -> tuple[float, float]:
    """East and north: straight on, and a little to the left."""
    return -0.1 * t_s, SPEED_M_S * t_s


def heading_rad(t_s: float) -> float:
    return math.radians(6.0) * math.sin(t_s)


def truth(t_s: float) -> SimTruth:
    place, velocity = (*at(t_s), UP_M), (-0.1, SPEED_M_S, 0.0)
    return SimTruth(t_s, t_s, t_s, *HOME, place, velocity, 0.0, 0.0, heading_rad(t_s), True)


def capture_line(t_s: float) -> str:
    """y up, the nose is the body's x: turned about y by what is left from east to the heading."""
    east, north = at(t_s)
    turn = math.pi / 2 - heading_rad(t_s)
    values = (east, UP_M, -north, math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0)
    return ",".join([str(CAPTURE_ZERO_NS + round(t_s * 1e9)), *(f"{value:.6f}" for value in values)])


def made(folder: Path) -> Path:
    """The two files of a flight towards the poles."""
    poles = [
        {"type": "cylinder", "at_m": list(place), "radius_m": 0.15, "height_m": 4.0, "material": "plaster"}
        for place in POLES_EN_M
    ]
    world = World.parse({"format": "hedgehop-world", "version": 1, "objects": poles}, frame=NeuFrame(*HOME))
    radar = IqRadarSensor(world, seed=3, model=POSITION2GO_IQ)
    times_s = LATE_S + np.arange(round(SECONDS * 15.7)) / 15.7
    lines = [oda_line(RADAR_ZERO_NS + round((t - LATE_S) * 1e9), 100 * radar.cube(truth(t))) for t in times_s.tolist()]
    (folder / "radar.csv").write_text("\n".join(lines))
    captured_s = np.arange(0.0, SECONDS + 1.5, 1 / 80).tolist()
    heading = "time [ns],x,y,z,a [rad],b [rad],c [rad],d [rad]"
    (folder / "optitrack.csv").write_text("\n".join([heading, *(capture_line(t) for t in captured_s)]))
    return folder


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("oda"))


def tracks(folder: Path, *more: object, offset_s: float = LATE_S) -> Run:
    poles = [word for east, north in POLES_EN_M for word in ("--pole", f"{east},{-north}")]
    files = (folder / "radar.csv", folder / "optitrack.csv")
    return hedgehop("radar", "tracks", *files, *poles, "--offset-s", offset_s, *more)


def test_poles_are_followed_where_they_are(data_set: Path, tmp_path: Path) -> None:
    run = tracks(data_set, "--plots", tmp_path, "--json")
    assert run.code == 0, run.err
    assert run.json["frames"] == round(SECONDS * 15.7)
    assert run.json["left_out"] == 0
    for pole, (east, north) in zip(run.json["poles"], POLES_EN_M, strict=True):
        assert (pole["x_m"], pole["z_m"]) == (east, -north)
        assert pole["in_view"] > 40
        assert pole["followed"] > 0.75 * pole["in_view"]
        assert pole["range_rms_m"] < 0.15
        assert pole["bearing_rms_deg"] < 2.5
    beside = {figure["words"]: (figure["value"], figure["paper"]) for figure in run.json["figures"]}
    assert beside["pole 1: range error (RMS)"] == (
        pytest.approx(run.json["poles"][0]["range_rms_m"], abs=1e-4),
        "0.15 m (the sensor's)",
    )
    assert beside["processing and following of a frame, median"][1] == "0.78 ms (Intel Up Core)"
    with Image.open(tmp_path / "tracks.png") as image:
        assert image.size >= (1000, 1000)
        assert len(set(image.convert("L").get_flattened_data())) > 20


def test_what_stands_elsewhere_is_not_found(data_set: Path) -> None:
    """The truth decides, not what was followed: poles on the other side are not followed."""
    files = (data_set / "radar.csv", data_set / "optitrack.csv")
    right = tracks(data_set, "--json").json
    run = hedgehop("radar", "tracks", *files, "--pole", "3.0,-7.5", "--offset-s", LATE_S, "--json")
    (pole,) = run.json["poles"]
    assert pole["in_view"] > 20
    assert pole["followed"] < 0.2 * pole["in_view"]
    assert run.json["others"] > right["others"] + 50


def test_the_capture_tells_place_heading_and_velocity(data_set: Path) -> None:
    capture = read_optitrack(data_set / "optitrack.csv")
    for t_s in (0.5, 2.0, 4.3):
        assert capture.position_at(t_s) == pytest.approx(at(t_s), abs=1e-3)
        assert capture.velocity_at(t_s) == pytest.approx((-0.1, SPEED_M_S), abs=1e-3)
        assert capture.heading_at(t_s) == pytest.approx(heading_rad(t_s), abs=1e-3)
    turned = read_optitrack(data_set / "optitrack.csv", forward="z")
    assert turned.heading_at(2.0) == pytest.approx(heading_rad(2.0) + math.pi / 2, abs=1e-3)
    assert not capture.covers(100.0)


def test_what_does_not_fit_is_refused_in_clear_words(data_set: Path, tmp_path: Path) -> None:
    run = tracks(data_set, offset_s=60.0)
    assert run.code == 2
    assert "--offset-s" in run.err
    files = (data_set / "radar.csv", data_set / "optitrack.csv")
    for words in ("here", "nan,-5", "1,2,3"):
        assert "is no place" in hedgehop("radar", "tracks", *files, "--pole", words).err
    far = hedgehop("radar", "tracks", *files, "--pole", "0.6,-5", "--pole", "40,-5", "--offset-s", LATE_S)
    assert far.code == 2
    assert "Pole 2, x 40 m and z -5 m, is never nearer than" in " ".join(far.err.split())
    swapped = hedgehop("radar", "tracks", *reversed(files), "--pole", "0,-5")
    assert swapped.code == 2
    assert "radar.csv comes first, optitrack.csv second" in " ".join(swapped.err.split())
    with pytest.raises(RadarDataError, match="row of 8 values"):
        open_oda(files[1], POSITION2GO).any_frame()
    good = (data_set / "optitrack.csv").read_text().splitlines()
    for lines, words in (
        ([*good[:5], "1,2,3"], "line 6: There are no 8 numbers"),
        ([*good[:5], good[2]], "line 6: The time"),
        ([*good[:5], f"{CAPTURE_ZERO_NS * 2},0,0,0,0,0,0,0"], "line 6: The quaternion"),
        (good[:2], "There are 1 rows"),
    ):
        path = tmp_path / "optitrack.csv"
        path.write_text("\n".join(lines))
        run = hedgehop("radar", "tracks", data_set / "radar.csv", path, "--pole", "0,-5")
        assert run.code == 2
        assert words in " ".join(run.err.split())
