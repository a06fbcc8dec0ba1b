"""ODA's tracks against truth through the doors: the command line's own figures, as a job that can be cancelled, and
what does not fit refused in plain words."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from mapping.radar.radar_params import POSITION2GO
from server.door.guard import IMPORT_LIMIT_BYTES
from server.schemas import JobDoc, JobMessage, RadarFileDoc, RadarTracksDoc
from tests.server.cli_runs import hedgehop
from tests.server.station import Station, ok, station
from tests.server.test_cli_radar import echo
from tests.server.test_cli_radar_tracks import LATE_S, POLES_EN_M, made
from tests.telemetry.test_adc_files import oda_line

pytestmark = [pytest.mark.xdist_group("process"), pytest.mark.slow]

FILES = "/api/radar/files"
RAW = {"Content-Type": "application/octet-stream"}
POLES = [{"x_m": east, "z_m": -north} for east, north in POLES_EN_M]
ASKED: dict[str, Any] = {"poles": POLES, "offset_s": LATE_S}


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("oda"))


@pytest.fixture
def there(tmp_path: Path) -> Iterator[Station]:
    with station(tmp_path / "data") as one:
        yield one


def sent(there: Station, data: bytes, name: str = "radar.csv") -> str:
    answer = ok(there.http.post(FILES, params={"filename": name}, content=data, headers=RAW))
    return f"{FILES}/{answer.json()['id']}"


def given(there: Station, file: str, data: bytes) -> httpx.Response:
    options = {"params": {"filename": "optitrack.csv"}, "content": data, "headers": RAW}
    return there.http.put(f"{file}/capture", **options)


def both(there: Station, data_set: Path) -> str:
    file = sent(there, (data_set / "radar.csv").read_bytes())
    doc = RadarFileDoc.model_validate_json(ok(given(there, file, (data_set / "optitrack.csv").read_bytes())).text)
    assert (doc.capture_name, doc.has_tracks) == ("optitrack.csv", False)
    return file


def over(there: Station, file: str, asked: dict[str, Any]) -> JobDoc:
    """The job, as pages are told of its end."""
    job = JobDoc.model_validate_json(ok(there.http.post(f"{file}/tracks", json=asked)).text)
    ended = there.until(lambda m: isinstance(m, JobMessage) and m.job.id == job.id and m.job.state != "running")
    return ended.job


def test_the_figures_are_the_command_lines(there: Station, data_set: Path) -> None:
    file = both(there, data_set)
    assert there.http.get(f"{file}/tracks").status_code == 404
    assert over(there, file, ASKED).state == "done"
    found = RadarTracksDoc.model_validate_json(ok(there.http.get(f"{file}/tracks")).text)
    assert found.asked.model_dump() == {**ASKED, "forward": "x"}
    poles = [word for pole in POLES for word in ("--pole", f"{pole['x_m']},{pole['z_m']}")]
    files = (data_set / "radar.csv", data_set / "optitrack.csv")
    told = hedgehop("radar", "tracks", *files, *poles, "--offset-s", LATE_S, "--json").json["figures"]
    here = [(one.words, one.value, one.paper) for one in found.part.figures if "processing" not in one.words]
    assert here == [
        (one["words"], one["value"] if one["value"] is None else pytest.approx(one["value"], abs=1e-4), one["paper"])
        for one in told
        if "processing" not in one["words"]
    ]
    charts = {chart.title: chart for chart in found.part.charts}
    assert len(charts) == 6
    followed, truth = charts["From the radar (fig. 7, right)"].series[:2]
    assert (truth.name, followed.name, followed.drawn) == ("pole 1, true", "pole 1, followed", "points")
    assert len(followed.x) > 0.75 * len(truth.x) > 30
    assert [one.y for one in charts["Bearing error (fig. 8)"].series if one.printed] == [[2.0, 2.0, 8.0, 8.0]]

    # It goes with the capture that it was held against.
    assert ok(there.http.get(FILES)).json()[0]["has_tracks"]
    ok(given(there, file, (data_set / "optitrack.csv").read_bytes()))
    assert not ok(there.http.get(FILES)).json()[0]["has_tracks"]
    assert there.http.get(f"{file}/tracks").status_code == 404
    ok(there.http.delete(f"{file}/capture"))
    refused = there.http.post(f"{file}/tracks", json=ASKED)
    assert (refused.status_code, "optitrack.csv" in refused.json()["advice"]) == (422, True)


def test_what_does_not_fit_is_refused_in_clear_words(there: Station, data_set: Path) -> None:
    radar, capture = ((data_set / name).read_bytes() for name in ("radar.csv", "optitrack.csv"))
    file = both(there, data_set)
    wrong = {
        "lies within the 5.5 s of the capture": {**ASKED, "offset_s": 60.0},
        "Pole 2, x 40 m and z -5 m, is never nearer than": {**ASKED, "poles": [POLES[0], {"x_m": 40, "z_m": -5}]},
    }
    for words, asked in wrong.items():
        error = over(there, file, asked).error
        assert error is not None
        assert words in error.what
    swapped = sent(there, capture)
    ok(given(there, swapped, radar))
    error = over(there, swapped, ASKED).error
    assert error is not None
    assert (error.where, error.advice) == (
        "optitrack.csv, line 1",
        "These look like the radar's samples: radar.csv comes first, optitrack.csv second.",
    )
    ok(given(there, swapped, b"time [ns],x,y,z,a,b,c,d\n"))
    error = over(there, swapped, ASKED).error
    assert error is not None
    assert (error.what, error.where) == ("There are 0 rows in it.", "optitrack.csv")
    assert given(there, file, b"").status_code == 422
    for body in (
        {"poles": []}, {"poles": [{"x_m": 4000, "z_m": 0}]}, {**ASKED, "forward": "y"}, {**ASKED, "more": 1},
        {**ASKED, "offset_s": 1e9},
    ):  # fmt: skip
        assert there.http.post(f"{file}/tracks", json=body).status_code == 422
    array = sent(there, b"anything", "cube.npy")
    refused = given(there, array, capture)
    assert (refused.status_code, "A capture goes with its radar.csv" in refused.json()["advice"]) == (422, True)
    assert list((there.server.settings.data_dir / "uploads").iterdir()) == []
    assert given(there, file, b"1" * (IMPORT_LIMIT_BYTES + 1)).status_code == 413
    for path in ("capture", "tracks"):
        assert there.http.get(f"{FILES}/nothing/{path}").status_code in (404, 405)


def test_it_tells_how_far_it_is_and_can_be_cancelled(there: Station, data_set: Path) -> None:
    """Of a long file: minutes of frames."""
    cube = echo(POSITION2GO, 6.0, 1.0, -0.2)
    first = oda_line(0, cube).partition(",")[2]
    rows = "\n".join(f"{63_694_000 * number},{first}" for number in range(3000))
    file = sent(there, rows.encode())
    lines = [f"{12_500_000 * number},0,1.5,0,1,0,0,0" for number in range(3000 * 6)]
    ok(given(there, file, "\n".join(lines).encode()))
    asked = {"poles": [{"x_m": 6.0, "z_m": 0.0}], "offset_s": 0.5}
    job = JobDoc.model_validate_json(ok(there.http.post(f"{file}/tracks", json=asked)).text)
    part_way = there.until(lambda m: isinstance(m, JobMessage) and m.job.id == job.id and bool(m.job.progress))
    assert part_way.job.step.endswith("of 3000")
    ok(there.http.post(f"/api/jobs/{job.id}/cancel"))
    there.until(lambda m: isinstance(m, JobMessage) and m.job.id == job.id and m.job.state == "cancelled")
    assert not ok(there.http.get(FILES)).json()[0]["has_tracks"]
