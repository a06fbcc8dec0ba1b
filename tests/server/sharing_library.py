"""Small libraries on disk for the tests of pushing and pulling, and targets that fail when they are told to."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.terrain.dsm import Dsm
from planning.terrain.orthophoto import Orthophoto
from server.errors import TargetError
from server.library.history import History
from server.library.orthophotos import store_orthophoto
from server.library.plans import save_plan
from server.library.radar_files import RadarShelf
from server.library.sharing.outcome import Outcome
from server.library.sharing.pull import pull
from server.library.sharing.push import push
from server.library.sharing.sharing_targets import FolderTarget, Target
from server.library.terrains import store_terrain
from server.schemas import PlanDoc
from telemetry.recording.file_types import MCAP_MAGIC

PLAN_ID = "feedc0de00000001"


@pytest.fixture
def stick(tmp_path: Path) -> FolderTarget:
    (tmp_path / "stick").mkdir()
    return FolderTarget(tmp_path / "stick")


def closed_mcap(content: bytes) -> bytes:
    """As far as anyone looks without reading it."""
    return MCAP_MAGIC + content + MCAP_MAGIC


def add_recording(root: Path, name: str, data: bytes) -> Path:
    path = root / "recordings" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def add_terrain(root: Path, name: str = "Hill") -> str:
    heights_m = np.arange(12, dtype=np.float32).reshape(3, 4)
    dsm = Dsm(heights_m, Affine(1.0, 0.0, 500_000.0, 0.0, -1.0, 4_000_000.0), CRS.from_epsg(32633), None, "0" * 64)
    (root / "terrains").mkdir(parents=True, exist_ok=True)
    return store_terrain(root, dsm, name=name).id


def add_photo(root: Path, terrain_id: str) -> str:
    photo = Orthophoto(np.zeros((2, 3, 3), np.uint8), np.ones((2, 3), bool), (0.0, 0.0, 3.0, 2.0), CRS.from_epsg(32633))
    (root / "orthophotos").mkdir(parents=True, exist_ok=True)
    return store_orthophoto(root, photo, name="Photo", terrain_id=terrain_id).id


def add_radar(root: Path, data: bytes = b"samples") -> str:
    root.mkdir(parents=True, exist_ok=True)
    upload = root / "upload.npy"
    upload.write_bytes(data)
    return RadarShelf(root, lambda error: None).add(upload, "capture.npy").id


def write_plan(
    root: Path, name: str, *, plan_id: str = PLAN_ID, terrain_id: str | None = None, seen_id: str | None = None
) -> Path:
    (root / "plans").mkdir(parents=True, exist_ok=True)
    save_plan(root / "plans" / plan_id, History([PlanDoc(name=name, terrain_id=terrain_id, seen_id=seen_id)]))
    return root / "plans" / plan_id / "manifest.json"


def full_library(root: Path) -> None:
    terrain_id = add_terrain(root)
    (root / "terrains" / terrain_id / "seen-0123456789abcdef.npz").write_bytes(b"columns")
    add_photo(root, terrain_id)
    add_radar(root)
    add_recording(root, "flight.mcap", closed_mcap(b"a flight"))
    add_recording(root, "other.tlog", b"another station's")
    add_recording(root / "vehicles" / "2", "second.bin", b"of the second vehicle")
    write_plan(root, "Slope", terrain_id=terrain_id, seen_id="0123456789abcdef")


def send(root: Path, target: Target, *, dry_run: bool = False, check: bool = False) -> Outcome:
    outcome = Outcome()
    push(root, target, outcome, lambda step, share: None, dry_run=dry_run, check=check)
    return outcome


def bring(root: Path, target: Target, *, dry_run: bool = False) -> Outcome:
    outcome = Outcome()
    pull(root, target, outcome, lambda step, share: None, dry_run=dry_run)
    return outcome


def shared_files(root: Path) -> dict[str, bytes]:
    """All that a library shares, by path; what was another vehicle's lies with the rest."""
    folders = ("terrains", "orthophotos", "radar", "plans", "recordings", "vehicles")
    files = [path for name in folders for path in (root / name).rglob("*") if path.is_file()]
    return {path.relative_to(root).as_posix().replace("vehicles/2/", ""): path.read_bytes() for path in files}


class BreakingTarget(FolderTarget):
    """Fails at the call of this number, and from then on; ``torn``: half of what was to be written stands there."""

    def __init__(self, folder: Path, *, at: int, torn: bool = False) -> None:
        super().__init__(folder)
        self._left, self._torn = at, torn
        self._counting = threading.Lock()
        self.calls = 0

    def read(self, path: str, most_bytes: int) -> bytes:
        self._count()
        return super().read(path, most_bytes)

    def write(self, path: str, data: bytes) -> None:
        try:
            self._count()
        except TargetError:
            if self._torn:
                place = self._root / path
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(data[: len(data) // 2])
            raise
        super().write(path, data)

    def sizes(self, folder: str) -> dict[str, int]:
        if self._left < 0:
            raise TargetError("It was pulled out.", where=self.text)
        return super().sizes(folder)

    def _count(self) -> None:
        with self._counting:
            self.calls += 1
            self._left -= 1
            if self._left < 0:
                raise TargetError("It was pulled out.", where=self.text)
