"""Builds the wheel: the floors and the built console become parts of one package of Hedgehop's own name.

In the repository they lie side by side and import each other as ``planning`` or ``server``. In an environment of
others such names would collide, so each lies in ``hedgehop`` there, and imports of each other say so; nothing else of
a source changes. Editable installs are not touched: they point at the repository.
"""

from __future__ import annotations

import ast
import shutil
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TOP = "hedgehop"
_INIT = '"""Hedgehop: ground control station for drones that hug the terrain."""\n\n__version__ = "{version}"\n'


class OnePackage(BuildHookInterface):
    """Its settings: ``packages``, folders of sources, and ``data``, folders that are shipped as they are."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        self._staging = tempfile.TemporaryDirectory(prefix="hedgehop-wheel-")
        top = Path(self._staging.name, TOP)
        self._stage(top)
        build_data["force_include"][str(top)] = TOP
        scripts = self.metadata.core.scripts
        scripts.update({name: f"{TOP}.{target}" for name, target in scripts.items()})

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        del build_data, artifact_path
        if version != "editable":
            self._staging.cleanup()

    def _stage(self, top: Path) -> None:
        root, packages = Path(self.root), self.config["packages"]
        for name in packages:
            shutil.copytree(root / name, top / name, ignore=shutil.ignore_patterns("__pycache__", ".*"))
        for source in top.rglob("*.py"):
            source.write_bytes(moved_imports(source.read_bytes(), packages, where=source.relative_to(top)))
        for name in self.config["data"]:
            if (root / name).is_dir():
                shutil.copytree(root / name, top / name)
            else:
                self.app.display_warning(f"{name} is missing and will not be in the wheel: make wheel builds it first.")
        (top / "__init__.py").write_text(_INIT.format(version=self.metadata.version))
        (top / "py.typed").touch()


def moved_imports(source: bytes, packages: Collection[str], *, where: object = "source") -> bytes:
    """The source with its absolute imports of these packages led through ``hedgehop``."""
    lines = source.splitlines(keepends=True)
    for number, column, text in sorted(_insertions(ast.parse(source), packages, where), reverse=True):
        line = lines[number - 1]
        lines[number - 1] = line[:column] + text.encode() + line[column:]
    return b"".join(lines)


def _insertions(tree: ast.AST, packages: Collection[str], where: object) -> Iterator[tuple[int, int, str]]:
    """Line, column in bytes, and what to put there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level == 0 and _first(node.module or "") in packages:
            yield node.lineno, node.col_offset + len("from "), f"{TOP}."
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if _first(alias.name) in packages:
                    yield alias.lineno, alias.col_offset, f"{TOP}."
                    if alias.asname is None:
                        yield _end(alias, where), alias.end_col_offset or 0, f" as {alias.name}"


def _end(alias: ast.alias, where: object) -> int:
    if "." in alias.name:
        raise ValueError(
            f"{where}, line {alias.lineno}: write `from {_first(alias.name)} import ...`, not this import."
        )
    return alias.end_lineno or alias.lineno


def _first(name: str) -> str:
    return name.partition(".")[0]
