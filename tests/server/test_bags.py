"""Bags of ROS that pages bring in: archives unpacked, topics listed with what is missing, recordings made."""

from __future__ import annotations

import asyncio
import io
import warnings
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from planning.errors import DescribedError
from server.door import guard
from server.errors import BadRequestError, InUseError, NotFoundError, TooLargeError
from server.flying.bags import bag_task
from server.flying.bags.bag_desk import MOST_KEPT, BagDesk
from server.schemas import BagDoc, BagRecordingBody
from telemetry.errors import RecordingError
from telemetry.recording.describe import describe_recording
from telemetry.recording.flight_log import read_flight_log
from tests.server.running import running
from tests.telemetry.bags import T0_NS, Messages, write_bag
from tests.telemetry.test_ros_bags import Flight


class AtOnce:
    """A board and a lane that work at once, in this process."""

    async def run(self, label: str, work: Any) -> Any:
        return await work(self, None)

    async def call(self, function: Any, *args: Any, progress: Any) -> Any:
        return function(*args, report=said_nothing)


def said_nothing(stage: str, share: float | None) -> None:
    """What a job says is no matter here."""


def desk(folder: Path, made: list[Path]) -> BagDesk:
    names = iter(range(1000))
    library: Any = SimpleNamespace(new_upload=lambda suffix="": folder / f"upload-{next(names)}{suffix}")

    async def add(out: Path, name: str) -> Any:
        made.append(out.rename(folder / name))
        raise InReviewError

    recordings: Any = SimpleNamespace(add=add)
    board: Any = AtOnce()
    return BagDesk(library, board, recordings)


class InReviewError(Exception):
    """The recording has come as far as Review."""


def zipped(folder: Path, path: Path) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for file in sorted(folder.iterdir()):
            packed.write(file, f"{folder.name}/{file.name}")
    return path


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("bags")
    return {kind: write_bag(folder, kind, Flight().entries(kind), name=kind) for kind in ("ros1", "db3", "mcap")}


def added(tmp_path: Path, source: Path, name: str) -> tuple[BagDesk, BagDoc, list[Path]]:
    made: list[Path] = []
    bag_desk, upload = desk(tmp_path, made), tmp_path / f"upload{source.suffix}"
    upload.write_bytes(source.read_bytes())
    return bag_desk, asyncio.run(bag_desk.add(upload, name)), made


def test_a_zipped_folder_is_listed_and_becomes_a_recording(tmp_path: Path, bags: dict[str, Path]) -> None:
    archive = zipped(bags["mcap"], tmp_path / "run.zip")
    bag_desk, doc, made = added(tmp_path, archive, "run.zip")
    assert (doc.kind, doc.name) == ("folder", "run.zip")
    roles = {topic.role: topic.name for topic in doc.topics}
    assert roles["points"] == "/points"
    points = doc.topics[0]
    assert (points.role, points.messages) == ("points", 28)
    assert points.first_utc is not None
    assert not any("NavSatFix" in what for what in doc.missing)
    with pytest.raises(InReviewError):
        asyncio.run(bag_desk.record(doc.id, BagRecordingBody(points="/points", home_alt_amsl_m=432.0)))
    assert [path.name for path in made] == ["run.mcap"]
    assert len(read_flight_log(made[0]).track.t_utc_s) == 28
    assert describe_recording(made[0]).plan_name == "run"
    # Kept, for another sensor; a place that is declared counts before the bag's own.
    body = BagRecordingBody(
        points="/points", sensor="vision", home_lat_deg=10.0, home_lon_deg=20.0, home_alt_amsl_m=5.0
    )
    with pytest.raises(InReviewError):
        asyncio.run(bag_desk.record(doc.id, body))
    assert read_flight_log(made[1]).track.lat_deg[0] == pytest.approx(10.0, abs=1e-6)
    asyncio.run(bag_desk.forget(doc.id))
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"run.zip", "run.mcap"}
    with pytest.raises(NotFoundError):
        asyncio.run(bag_desk.record(doc.id, body))


def test_what_is_missing_is_said_and_what_is_wrong(tmp_path: Path) -> None:
    kind = "ros1"
    bare = [entry for entry in Flight().entries(kind) if entry[0] in ("/points", "/odom")]
    bag_desk, doc, _ = added(tmp_path, write_bag(tmp_path, kind, bare, name="bare"), "bare.bag")
    said = " ".join(doc.missing)
    assert "no transforms" in said
    assert "no NavSatFix" in said
    for body, error, words in (
        (BagRecordingBody(points="/points", home_lat_deg=1.0, home_alt_amsl_m=0.0), BadRequestError, "one number"),
        (BagRecordingBody(points="/none", home_alt_amsl_m=0.0), RecordingError, "/none is not in the bag"),
    ):
        with pytest.raises(error, match=words):
            asyncio.run(bag_desk.record(doc.id, body))


def test_only_the_newest_are_kept(tmp_path: Path, bags: dict[str, Path]) -> None:
    made: list[Path] = []
    bag_desk, docs = desk(tmp_path, made), []
    for number in range(MOST_KEPT + 1):
        upload = tmp_path / f"{number}.upload"
        upload.write_bytes(bags["ros1"].read_bytes())
        docs.append(asyncio.run(bag_desk.add(upload, "run.bag")))
    assert not (tmp_path / "0.upload").exists()
    with pytest.raises(NotFoundError, match="Bring it in again"):
        asyncio.run(bag_desk.forget(docs[0].id))
    asyncio.run(bag_desk.forget(docs[1].id))


def test_a_bag_that_a_job_reads_is_not_put_away(tmp_path: Path, bags: dict[str, Path]) -> None:
    asyncio.run(_kept_while_read(tmp_path, bags["ros1"]))


async def _kept_while_read(tmp_path: Path, bag: Path) -> None:
    bag_desk, docs = desk(tmp_path, []), []

    async def bring(number: int) -> None:
        upload = tmp_path / f"{number}.upload"
        upload.write_bytes(bag.read_bytes())
        docs.append(await bag_desk.add(upload, f"{number}.bag"))

    for number in range(MOST_KEPT):
        await bring(number)
    begun, go_on = asyncio.Event(), asyncio.Event()

    class Waiting(AtOnce):
        async def run(self, label: str, work: Any) -> Any:
            begun.set()
            await go_on.wait()
            return await work(self, None)

    board = bag_desk._board
    bag_desk._board = Waiting()  # type: ignore[assignment]
    body = BagRecordingBody(points="/points", home_alt_amsl_m=432.0)
    making = asyncio.ensure_future(bag_desk.record(docs[0].id, body))
    await begun.wait()
    bag_desk._board = board
    with pytest.raises(InUseError, match=r"0\.bag is being made"):
        await bag_desk.forget(docs[0].id)
    await bring(MOST_KEPT)
    assert [doc.name for doc in bag_desk.docs()] == ["2.bag", "0.bag"]  # the oldest that is idle had to go
    assert (tmp_path / "0.upload").exists()
    go_on.set()
    with pytest.raises(InReviewError):
        await making
    await bag_desk.forget(docs[0].id)
    assert not (tmp_path / "0.upload").exists()


def test_fixes_that_have_no_fix_are_not_called_missing(tmp_path: Path) -> None:
    m, kind = Messages("ros1"), "ros1"
    entries = [entry for entry in Flight().entries(kind) if entry[0] != "/fix"]
    none = [("/fix", T0_NS, m.fix(T0_NS, float("nan"), 10.0, 480.0))] * 3
    bag_desk, doc, _ = added(tmp_path, write_bag(tmp_path, kind, [*none, *entries], name="none"), "none.bag")
    with pytest.raises(RecordingError, match="none of its 3 NavSatFix has a fix") as refused:
        asyncio.run(bag_desk.record(doc.id, BagRecordingBody(points="/points", home_alt_amsl_m=432.0)))
    assert "latitude and longitude" in refused.value.advice


def archive(*members: tuple[str, bytes]) -> bytes:
    data = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as packed:
        warnings.simplefilter("ignore", UserWarning)  # two of a name are asked for
        for name, content in members:
            packed.writestr(name, content)
    return data.getvalue()


def lying(data: bytes, size: int) -> bytes:
    """The central directory says another size of the first member."""
    at = data.index(b"PK\x01\x02") + 24
    return data[:at] + size.to_bytes(4, "little") + data[at + 4 :]


WRONG: list[tuple[str, bytes, type[DescribedError], str]] = [
    ("no bag", b"hello", RecordingError, "no bag of ROS"),
    ("no archive", b"PK\x03\x04" + bytes(100), BadRequestError, "cannot be unpacked"),
    ("empty archive", archive(("notes.txt", b"x")), BadRequestError, "0 bag files"),
    ("two bags", archive(("a.bag", b"x"), ("b/c.bag", b"y")), BadRequestError, "which bag is meant"),
    ("two of a name", archive(("metadata.yaml", b"x"), ("a.db3", b"y"), ("a.db3", b"z")), BadRequestError, "unpacked"),
    ("a bomb", lying(archive(("a.bag", bytes(1000))), 2**32 - 2), BadRequestError, "unpacked|no bag"),
    ("short of its size", lying(archive(("a.bag", bytes(1000))), 10), BadRequestError, "unpacked"),
    ("out of its folder", archive(("../../../tmp/evil.bag", b"#ROSBAG V2.0\n")), RecordingError, "run.zip"),
]


@pytest.mark.parametrize(("data", "error", "words"), [case[1:] for case in WRONG], ids=[case[0] for case in WRONG])
def test_wrong_files_are_refused_and_leave_nothing(
    tmp_path: Path, data: bytes, error: type[DescribedError], words: str
) -> None:
    (tmp_path / "inner").mkdir()
    upload = tmp_path / "inner" / "0123.zip"
    upload.write_bytes(data)
    with pytest.raises((error, RecordingError), match=words) as caught:
        asyncio.run(desk(tmp_path / "inner", []).add(upload, "run.zip"))
    assert "0123" not in str(caught.value)
    assert list((tmp_path / "inner").iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == ["inner"]


def test_an_archive_of_too_much_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bag_task, "_MOST_BYTES", 999)
    (tmp_path / "a.zip").write_bytes(archive(("a.bag", bytes(1000))))
    with pytest.raises(TooLargeError, match="there is room for"):
        bag_task.unpacked(tmp_path / "a.zip", tmp_path / "out", "a.zip", report=said_nothing)
    assert not (tmp_path / "out").exists()


def test_a_bag_of_more_than_what_json_may_be_is_taken(tmp_path: Path, bags: dict[str, Path]) -> None:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as packed:
        packed.write(bags["ros1"], "run.bag")
        packed.writestr("video.avi", bytes(guard.JSON_LIMIT_BYTES))
    with running(tmp_path / "data") as server:
        fleet: Any = server.parts.fleet
        board: Any = AtOnce()
        fleet.bags = BagDesk(server.parts.library, board, fleet.recordings)
        raw = {"Content-Type": "application/octet-stream"}
        answer = server.http.post("/api/bags", params={"filename": "run.zip"}, content=data.getvalue(), headers=raw)
        assert answer.status_code == 200, answer.text
        assert answer.json()["topics"][0]["name"] == "/points"
        assert server.http.get("/api/bags").json() == [answer.json()]
