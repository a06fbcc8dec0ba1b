"""How much memory a surface model may take: what the machine has free, and its container still allows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from planning.errors import RasterTooLargeError

BYTES_PER_PX = 14
"""Of a model read as a whole, with its spikes looked for: 10 were measured at 36 million pixels, and 4 are those of the
temporary file, whose folder may lie in memory too."""
BYTES_PER_SQUARE = 20
"""Where cells are brought to other squares, for each cell and each square: 15 were measured."""
RESERVE_BYTES = 512 * 2**20
"""Stays free for the vehicle's link, the recorder and the server while a file is read."""

Progress = Callable[[str, float], None]


def memory_at_hand_bytes(root: Path = Path("/")) -> int | None:
    """The least that system and control groups leave; None where neither says."""
    left = [*_of_system(root), *_of_groups(root)]
    return max(0, min(left)) if left else None


def check_memory(need_bytes: int, *, shape: tuple[int, int], where: str) -> None:
    """RasterTooLargeError when a model of (rows, columns) would take what others need."""
    at_hand = memory_at_hand_bytes()
    if at_hand is not None and need_bytes + RESERVE_BYTES > at_hand:
        rows, columns = shape
        raise RasterTooLargeError(
            f"{columns} x {rows} cells take about {_gib(need_bytes)} of memory. {_gib(at_hand)} are free, "
            f"of which {_gib(RESERVE_BYTES)} are kept for the vehicle's connection.",
            where=where,
            advice="Crop it to the area of the flight, export it at a coarser resolution, or close other programs.",
        )


def watched(progress: Progress | None, *, where: str) -> Progress:
    """Raises RasterTooLargeError from its progress when memory runs short while a file is read."""

    def step(stage: str, share: float) -> None:
        at_hand = memory_at_hand_bytes()
        if at_hand is not None and at_hand < RESERVE_BYTES / 2:
            raise RasterTooLargeError(
                f"Only {_gib(at_hand)} of memory are left: reading was stopped for the vehicle's connection.",
                where=where,
                advice="Close other programs and try again, or crop the file to the area of the flight.",
            )
        if progress is not None:
            progress(stage, share)

    return step


def _of_system(root: Path) -> Iterator[int]:
    for line in _lines(root / "proc/meminfo"):
        if line.startswith("MemAvailable:"):
            yield int(line.split()[1]) * 1024


def _of_groups(root: Path) -> Iterator[int]:
    """What the process's group and all groups around it leave, in both versions of control groups."""
    for line in _lines(root / "proc/self/cgroup"):
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            base, names = root / "sys/fs/cgroup", ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            base = root / "sys/fs/cgroup/memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        # In a container the path may be the host's: then the group is where the tree begins.
        group = base / path.lstrip("/")
        for folder in (group, *group.parents):
            if folder == base.parent:
                break
            yield from _left_in(folder, *names)


def _left_in(folder: Path, limit: str, used: str, given_back: str) -> Iterator[int]:
    most, now = _lines(folder / limit), _lines(folder / used)
    if most and now and most[0].isdigit():
        # Files that were read once are dropped before anything fails.
        files = [int(line.split()[1]) for line in _lines(folder / "memory.stat") if line.startswith(f"{given_back} ")]
        yield int(most[0]) - int(now[0]) + sum(files)


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="ascii").splitlines()
    except OSError:
        return []


def _gib(count: int) -> str:
    return f"{count / 2**30:.1f} GiB"
