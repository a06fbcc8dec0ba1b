"""Files of raw radar samples through the doors: kept, opened, looked at frame by frame, and refused in plain words."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapping.radar.radar_params import AWR1843, POSITION2GO
from server.door.guard import UPLOADS
from server.schemas import RadarFileDoc, RadarFrame, RadarOpened
from server.schemas.study_docs import RadarMap
from telemetry.sensors.ti_mmwave.ti_config import fmcw_params
from tests.server.running import Running, running
from tests.server.station import ok
from tests.server.test_cli_radar import echo
from tests.telemetry.test_adc_files import dca1000_bytes, oda_line
from tests.telemetry.test_ti_config import GOOD, config

pytestmark = [pytest.mark.xdist_group("process"), pytest.mark.slow]

FILES = "/api/radar/files"
RAW = {"Content-Type": "application/octet-stream"}
PAGE = {"page": "p1"}
LIMIT = 16 * 1024**2


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data"), upload_limit_bytes=LIMIT) as made:
        yield made


def sent(server: Running, name: str, data: bytes) -> RadarFileDoc:
    answer = ok(server.http.post(FILES, params={"filename": name}, content=data, headers=RAW))
    return RadarFileDoc.model_validate_json(answer.text)


def opened(server: Running, file: RadarFileDoc, **how: str | int) -> RadarOpened:
    answer = ok(server.http.get(f"{FILES}/{file.id}/open", params={**PAGE, **how}))
    return RadarOpened.model_validate_json(answer.text)


def frame(server: Running, file: RadarFileDoc, number: int, **how: str | int) -> RadarFrame:
    answer = ok(server.http.get(f"{FILES}/{file.id}/frames/{number}", params={**PAGE, **how}))
    return RadarFrame.model_validate_json(answer.text)


def npy(*cubes: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, np.stack(cubes))
    return file.getvalue()


def cells(drawn: RadarMap) -> np.ndarray:
    return np.frombuffer(base64.b64decode(drawn.cells), np.uint8).reshape(drawn.rows, drawn.columns)


def strongest(drawn: RadarMap) -> tuple[float, float]:
    """What its axes say of the strongest cell: row and column."""
    row, column = np.unravel_index(cells(drawn).argmax(), (drawn.rows, drawn.columns))
    return drawn.first_row + row * drawn.row_step, drawn.first_column + column * drawn.column_step


def test_an_array_is_kept_opened_and_looked_at_in_any_order(server: Running) -> None:
    file = sent(server, "../cube.npy", npy(*(echo(AWR1843, range_m, -3.0, 0.3) for range_m in (40.0, 30.0))))
    assert (file.name, file.cfg_name) == ("cube.npy", "")
    found = opened(server, file)
    assert (found.frames, found.parameters.sensor, found.parameters.antennas) == (2, "awr1843", 12)
    for number, range_m in ((1, 30.0), (0, 40.0)):
        seen = frame(server, file, number)
        assert (seen.number, seen.t_s) == (number, pytest.approx(0.1 * number))
        first = seen.detections[0]
        assert first.range_m == pytest.approx(range_m, abs=0.2)
        assert first.radial_speed_m_s == pytest.approx(-3.0, abs=0.1)
        assert first.azimuth_deg == pytest.approx(np.degrees(np.arcsin(0.3)), abs=1.0)
        assert seen.doppler.top_db - seen.doppler.floor_db == 60.0
        assert cells(seen.doppler).max() == 255
        speed_m_s, column_m = strongest(seen.doppler)
        assert speed_m_s == pytest.approx(-3.0, abs=0.2)
        assert column_m == pytest.approx(range_m, abs=0.3)
        assert seen.azimuth is not None
        row_m, sine = strongest(seen.azimuth)
        assert row_m == pytest.approx(range_m, abs=0.3)
        assert sine == pytest.approx(0.3, abs=0.04)
    assert server.parts.radar.message().files[0].id == file.id


def test_a_capture_asks_for_its_configuration_and_takes_another(server: Running) -> None:
    cube = echo(fmcw_params(config()), 40.0, -3.0, 0.3)
    file = sent(server, "adc.bin", dca1000_bytes([cube, cube], q_first=True))
    without = server.http.get(f"{FILES}/{file.id}/open", params=PAGE)
    assert without.status_code == 422
    assert (without.json()["where"], "configuration" in without.json()["advice"]) == ("adc.bin", True)

    def give(text: str, name: str) -> dict[str, Any]:
        options = {"params": {"filename": name}, "content": text.encode(), "headers": RAW}
        return ok(server.http.put(f"{FILES}/{file.id}/cfg", **options)).json()

    assert give("profileCfg 0 77", "wrong.cfg")["cfg_name"] == "wrong.cfg"
    wrong = server.http.get(f"{FILES}/{file.id}/open", params=PAGE)
    assert wrong.status_code == 422
    assert "wrong.cfg" in wrong.json()["where"]
    give(GOOD, "radar.cfg")
    assert opened(server, file).frames == 2
    assert opened(server, file, most=1).frames == 1
    assert frame(server, file, 1).detections[0].range_m == pytest.approx(40.0, abs=0.2)
    ok(server.http.delete(f"{FILES}/{file.id}/cfg"))
    assert server.http.get(f"{FILES}/{file.id}/open", params=PAGE).status_code == 422


def test_rows_of_a_position2go_and_how_samples_are_read(server: Running) -> None:
    rows = [oda_line(k * 63_694_000, echo(POSITION2GO, 6.0, 1.0, -0.2)) for k in range(3)]
    file = sent(server, "radar.csv", "\n".join(rows).encode())
    assert (opened(server, file).frames, opened(server, file).parameters.sensor) == (3, "position2go")
    assert frame(server, file, 2).t_s == pytest.approx(2 * 0.063694)
    assert frame(server, file, 2).detections[0].range_m == pytest.approx(6.0, abs=0.3)
    offset = sent(server, "offset.npy", npy(echo(POSITION2GO, 6.0, 1.0, 0.0) + (32768 + 32768j)))
    found = opened(server, offset, sensor="position2go")
    assert any("offset binary of 16 bits" in note for note in found.notes)
    refused = server.http.get(
        f"{FILES}/{offset.id}/open", params={**PAGE, "sensor": "position2go", "samples": "twos-complement"}
    )
    assert refused.status_code == 422
    assert "no unclipped signal" in refused.json()["what"]


def test_one_antenna_tells_no_azimuth(server: Running) -> None:
    file = sent(server, "one.npy", npy(echo(POSITION2GO, 6.0, 1.0, 0.0)[:, :1]))
    assert frame(server, file, 0).azimuth is None


def test_a_map_is_sent_no_finer_than_it_can_be_drawn(server: Running) -> None:
    long = np.zeros((16, 1, 2000), np.complex64)
    long[:] = 100 * np.exp(2j * np.pi * 0.25 * np.arange(2000)) + np.random.default_rng(1).normal(size=long.shape)
    drawn = frame(server, sent(server, "long.npy", npy(long)), 0).doppler
    assert drawn.columns == 1000
    assert strongest(drawn)[1] == pytest.approx(500 * AWR1843.range_resolution_m * 256 / 2000, rel=0.01)


@pytest.mark.parametrize(
    ("name", "data", "status", "words"),
    [
        ("radar.mcap", b"\x89MCAP", 422, "neither in .npy"),
        ("cube.npy", b"", 422, "empty"),
    ],
)
def test_what_is_no_file_of_samples_is_not_kept(
    server: Running, name: str, data: bytes, status: int, words: str
) -> None:
    before = server.parts.radar.message()
    answer = server.http.post(FILES, params={"filename": name}, content=data, headers=RAW)
    assert (answer.status_code, words in answer.json()["what"]) == (status, True)
    assert server.parts.radar.message() == before
    assert list((server.settings.data_dir / "uploads").iterdir()) == []


def test_the_limit_is_that_of_uploads() -> None:
    """What the guard does beyond it is tested there: who still sends when it refuses may not hear the answer."""
    assert FILES in UPLOADS


def test_what_cannot_be_read_says_what_where_and_what_to_do(server: Running) -> None:
    file = sent(server, "noise.npy", b"no array at all")
    answer = server.http.get(f"{FILES}/{file.id}/frames/0", params=PAGE)
    assert answer.status_code == 422
    assert answer.json() == {
        "code": answer.json()["code"],
        "what": "This is no NumPy array.",
        "where": "noise.npy",
        "advice": "Save the cube with numpy.save.",
    }
    good = sent(server, "good.npy", npy(echo(POSITION2GO, 6.0, 1.0, 0.0)))
    beyond = server.http.get(f"{FILES}/{good.id}/frames/1", params={**PAGE, "sensor": "position2go"})
    assert (beyond.status_code, "There is no frame 1" in beyond.json()["what"]) == (422, True)
    for query in ({}, {**PAGE, "sensor": "x"}, {**PAGE, "most": 0}, {**PAGE, "more": 1}):
        assert server.http.get(f"{FILES}/{good.id}/frames/0", params=query).status_code == 422
    ok(server.http.delete(f"{FILES}/{good.id}"))
    assert server.http.get(f"{FILES}/{good.id}/open", params=PAGE).status_code == 404
    assert server.http.delete(f"{FILES}/..%2F..%2Fplans").status_code == 404
    large = {"params": {"filename": "a.cfg"}, "content": b"x" * (1024**2 + 1), "headers": RAW}
    assert server.http.put(f"{FILES}/{file.id}/cfg", **large).status_code == 413


def test_strangers_see_and_bring_nothing(server: Running) -> None:
    file = sent(server, "good.npy", npy(echo(POSITION2GO, 6.0, 1.0, 0.0)))
    with server.stranger(headers={"Origin": server.origin}) as other:
        for method, path in (
            ("GET", FILES), ("POST", f"{FILES}?filename=a.npy"), ("PUT", f"{FILES}/{file.id}/cfg?filename=a.cfg"),
            ("DELETE", f"{FILES}/{file.id}"), ("DELETE", f"{FILES}/{file.id}/cfg"),
            ("GET", f"{FILES}/{file.id}/open?page=a"), ("GET", f"{FILES}/{file.id}/frames/0?page=a"),
        ):  # fmt: skip
            content = b"x" if method in ("POST", "PUT") else None
            assert other.request(method, path, content=content, headers=RAW).status_code == 401, path


def test_files_are_there_again_after_a_restart(tmp_path: Path) -> None:
    with running(tmp_path) as first:
        file = sent(first, "cube.npy", npy(echo(POSITION2GO, 6.0, 1.0, 0.0)))
        ok(first.http.put(f"{FILES}/{file.id}/cfg", params={"filename": "a.cfg"}, content=b"x", headers=RAW))
    with running(tmp_path) as second:
        assert [(one.name, one.cfg_name) for one in second.parts.radar.message().files] == [("cube.npy", "a.cfg")]
