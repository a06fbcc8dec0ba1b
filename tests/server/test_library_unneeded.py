"""What was seen is removed once no kept plan, undo step or mission on board names it, and never before."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from planning.evading.seen import Columns
from server.errors import StorageError
from server.heard.onboard import Aboard, onboard
from server.library import Library
from server.library import library as whole_library
from server.library.history import History
from server.library.seen_columns import SeenColumns, load_seen, store_seen
from server.library.terrains import store_terrain
from server.schemas import PlanDoc
from telemetry.topics.messages import PlanRecord
from tests.server.scene_fixtures import hill

SEEN = SeenColumns((Columns(np.zeros((2, 2)), np.ones(2), 1.0),))


class Data:
    """A data directory with one surface model; ``start()`` is the next morning."""

    def __init__(self, root: Path) -> None:
        self.library = Library(root)
        self.root = self.library.root
        self.terrain_id = store_terrain(self.root, hill(), name="Hill").id
        self.folder = self.root / "terrains" / self.terrain_id

    def start(self) -> Library:
        self.library.close()
        self.library = Library(self.root)
        return self.library

    def seen(self) -> str:
        return store_seen(self.folder, SEEN)

    def document(self, seen_id: str | None) -> PlanDoc:
        return PlanDoc(name="Hill", terrain_id=self.terrain_id, seen_id=seen_id)

    @property
    def files(self) -> set[str]:
        return {path.stem.removeprefix("seen-") for path in self.folder.glob("seen-*")}


@pytest.fixture
def data(tmp_path: Path) -> Iterator[Data]:
    made = Data(tmp_path / "data")
    yield made
    made.library.close()


def test_those_of_plans_and_of_all_their_undo_and_redo_steps_stay(data: Data) -> None:
    undone, present, redone, dropped = (data.seen() for _ in range(4))
    history = History([data.document(undone), data.document(present), data.document(redone)], ["a", "b"], 1)
    plan_id, _ = data.library.create_plan(history)
    library = data.start()
    assert data.files == {undone, present, redone}
    assert load_seen(data.folder, present).count == 2
    assert library.load_plan(plan_id).documents[0].seen_id == undone
    library.delete_plan(plan_id)
    assert dropped not in data.files
    data.start()
    assert data.files == set()


def test_that_of_the_mission_on_board_stays_without_its_plan(data: Data) -> None:
    flown, unused = data.seen(), data.seen()
    record = PlanRecord(
        0.0, "Hill", "", "", "ardupilot", data.terrain_id, "Hill", "", None, None, "", "",
        plan_json=data.document(flown).model_dump_json(),
    )  # fmt: skip
    aboard = Aboard(data.root / "onboard.json")
    aboard.read_back(onboard(record, 3, []))
    aboard.save()
    data.start()
    assert data.files == {flown}
    assert unused not in data.files


def test_that_of_a_damaged_plan_stays_for_who_mends_it(data: Data) -> None:
    kept = data.seen()
    plan_id, _ = data.library.create_plan(History([data.document(kept)]))
    manifest = data.root / "plans" / plan_id / "manifest.json"
    stored = json.loads(manifest.read_text())
    del stored["saved_utc"]
    manifest.write_text(json.dumps(stored))
    for _ in range(2):
        library = data.start()
        assert library.plans() == []
        assert data.files == {kept}


def test_half_written_files_beside_a_model_go_and_its_own_stay(data: Data) -> None:
    (data.folder / ".tmp-seen-abc").write_bytes(b"half")
    (data.folder / "traversability.npz").write_bytes(b"maps")
    data.start()
    assert sorted(path.name for path in data.folder.iterdir()) == [
        "elevation.npy",
        "manifest.json",
        "traversability.npz",
    ]


def test_plans_that_cannot_be_read_leave_everything_and_are_no_reason_not_to_start(
    data: Data, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = data.seen()
    data.library.create_plan(History([data.document(None)]))
    read = Path.read_bytes

    def torn(path: Path) -> bytes:
        if "plans" in path.parts:
            raise OSError(5, "Input/output error")
        return read(path)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", torn)
        with pytest.raises(StorageError, match="Input/output error"):
            whole_library.remove_unneeded(data.root)
    assert data.files == {kept}
    with monkeypatch.context() as patch:
        patch.setattr(whole_library, "_not_named", lambda files, texts: [data.root / "not there"])
        library = data.start()
    assert [notice.code for notice in library.notices] == [StorageError.code]
