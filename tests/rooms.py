"""The house as folders: no circle of files or folders anywhere, and no more rooms, pages and names than one takes in.

``python -m tests.rooms`` is part of ``make check``: import-linter knows layers of modules that are named to it, and
would not see two folders deep inside a floor that import each other. A room of a folder is a module or folder
directly inside it; what ``__init__.py`` hands on belongs to no room.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parent.parent
FLOORS = ("mapping", "planning", "telemetry", "server")
MOST_ROOMS = 22
MOST_LINES = 400
"""What one reads in a sitting: of a file of the product or its tests."""
LINES_OF_A_SMALL_ONE = 40
MOST_SMALL_ONES = 30
MOST_SHARED_NAMES = 25
"""Files of the product that are named alike make a reader look twice."""
Graph = dict[str, set[str]]


def main() -> int:
    found = list(faults(ROOT))
    print(*found, sep="\n")
    print(f"Rooms and circles: {len(found)} faults." if found else "Rooms and circles: no fault.")
    return 1 if found else 0


def faults(root: Path) -> Iterator[str]:
    """One line for each circle and each folder with too many rooms."""
    imports = file_imports(root)
    yield from circle_in(imports, "files")
    rooms, arrows = folders(imports)
    for folder, inside in sorted(rooms.items()):
        if len(inside) > MOST_ROOMS:
            yield f"{folder}: {len(inside)} rooms, more than {MOST_ROOMS}"
        yield from circle_in({room: arrows[folder][room] for room in sorted(inside)}, f"rooms of {folder}")
    yield from _sizes(root)


def _sizes(root: Path) -> Iterator[str]:
    """Files that are too long, and too many that are short or named alike."""
    product = {path: _lines(path) for floor in FLOORS for path in sorted((root / floor).rglob("*.py"))}
    for path, lines in {**product, **{path: _lines(path) for path in sorted((root / "tests").rglob("*.py"))}}.items():
        if lines > MOST_LINES:
            yield f"{path.relative_to(root)}: {lines} lines, more than {MOST_LINES}"
    modules = {path: lines for path, lines in product.items() if path.name != "__init__.py"}
    small = sum(lines < LINES_OF_A_SMALL_ONE for lines in modules.values())
    if small > MOST_SMALL_ONES:
        yield f"{small} modules of under {LINES_OF_A_SMALL_ONE} lines, more than {MOST_SMALL_ONES}: join some"
    names = Counter(path.stem for path in modules)
    shared = sorted(name for name, files in names.items() if files > 1)
    if len(shared) > MOST_SHARED_NAMES:
        yield f"{len(shared)} names of several files, more than {MOST_SHARED_NAMES}: {', '.join(shared)}"


def _lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def circle_in(graph: Mapping[str, set[str]], what: str) -> Iterator[str]:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        # Its predecessors are what is imported: read backwards, each imports the next.
        yield f"circle of {what}: {' -> '.join(reversed(error.args[1]))}"


def file_imports(root: Path) -> Graph:
    """Each module's path below ``root``, and the modules that it imports anywhere in it, for types as well."""
    paths = {path.relative_to(root).as_posix() for floor in FLOORS for path in (root / floor).rglob("*.py")}
    modules = {path.removesuffix(".py").removesuffix("/__init__").replace("/", "."): path for path in paths}
    return {
        path: {modules[name] for name in _imported(root / path, modules) if modules[name] != path}
        for path in sorted(paths)
        if not path.endswith("/__init__.py")
    }


def _imported(path: Path, modules: Mapping[str, str]) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found = {name if name in modules else node.module for name in names}
        elif isinstance(node, ast.Import):
            found = {alias.name for alias in node.names}
        else:
            continue
        yield from (name for name in found if name in modules and not modules[name].endswith("/__init__.py"))


def folders(imports: Graph) -> tuple[dict[str, set[str]], dict[str, Graph]]:
    """Of each folder its rooms, and which of them imports which."""
    rooms: dict[str, set[str]] = defaultdict(set)
    arrows: dict[str, Graph] = defaultdict(lambda: defaultdict(set))
    for path, imported in imports.items():
        parts = PurePosixPath(path).parts
        for depth in range(1, len(parts)):
            rooms["/".join(parts[:depth])].add(parts[depth])
        for other in imported:
            others = PurePosixPath(other).parts
            depth = next(n for n, (a, b) in enumerate(zip(parts, others, strict=False)) if a != b)
            if depth:
                arrows["/".join(parts[:depth])][parts[depth]].add(others[depth])
    return rooms, arrows


if __name__ == "__main__":
    sys.exit(main())
