"""What was seen and taken into plans comes with them, and nothing else of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from server.library.library import Library
from server.library.sharing import shared_items
from server.library.sharing.sharing_targets import BLOBS, FOLDER, FolderTarget
from tests.server.sharing_library import add_terrain, bring, send, stick, write_plan

__all__ = ["stick"]


@pytest.mark.parametrize("has_model", [True, False])
def test_only_columns_that_a_plan_names_are_brought(tmp_path: Path, stick: FolderTarget, has_model: bool) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    terrain = add_terrain(one)
    if has_model:
        send(one, stick)
        bring(two, stick)
    model = one / "terrains" / terrain
    for seen_id in ("aaaa1111", "bbbb2222", "cccc3333"):
        (model / f"seen-{seen_id}.npz").write_bytes(seen_id.encode())
    write_plan(one, "Takes one in", terrain_id=terrain, seen_id="bbbb2222")
    write_plan(two, "Mine", plan_id="feedc0de00000009", seen_id="cccc3333")
    send(one, stick)
    would = bring(two, stick, dry_run=True)
    brought = bring(two, stick)
    assert (brought.whole, would.moved_bytes) == (True, brought.moved_bytes)
    there = {path.name for path in (two / "terrains" / terrain).iterdir()}
    assert there == {path.name for path in model.iterdir()} - {"seen-aaaa1111.npz"}
    Library(two).close()
    again = bring(two, stick)
    assert (again.done, again.moved_bytes, again.whole) == ([], 0, True)
    assert {path.name for path in (two / "terrains" / terrain).iterdir()} == there


def test_where_a_plan_cannot_be_read_all_columns_come(tmp_path: Path, stick: FolderTarget) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    terrain = add_terrain(one)
    (one / "terrains" / terrain / "seen-aaaa1111.npz").write_bytes(b"columns")
    plan = write_plan(one, "Damaged on the way")
    send(one, stick)
    digest = shared_items.digest_of(plan.read_bytes())
    (stick.folder / FOLDER / BLOBS / digest[:2] / digest).write_bytes(b"!" * plan.stat().st_size)
    assert len(bring(two, stick).left_out) == 1
    assert (two / "terrains" / terrain / "seen-aaaa1111.npz").is_file()
