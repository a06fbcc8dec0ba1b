"""What `planning` and `mapping` hand on to those who build on them."""

import ast
import importlib
import inspect
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import mapping
import planning
from planning.ground.demo_hillside import demo_dsm
from planning.terrain.geotiff import write_dsm
from tests.conftest import ROOT
from tests.mapping.radar.echoes import Echo, frame

PACKAGES = pytest.mark.parametrize("package", [mapping, planning], ids=lambda package: package.__name__)


def shown(package: ModuleType) -> str:
    """The code that stands in a package's docstring."""
    lines = inspect.cleandoc(package.__doc__ or "").splitlines()
    return textwrap.dedent("\n".join(line for line in lines if line.startswith("    ") or not line))


def seen_by_type_checkers(package: ModuleType) -> dict[str, str]:
    """Name -> module, of what is imported for them alone."""
    tree = ast.parse(inspect.getsource(package))
    branch = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in branch.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}


@PACKAGES
def test_every_name_is_there_and_said_to_be(package: ModuleType) -> None:
    names = [name for name in package.__all__ if not name.startswith("__")]
    modules = seen_by_type_checkers(package)
    assert sorted(modules) == sorted(names)
    for name in names:
        assert getattr(package, name) is getattr(importlib.import_module(modules[name]), name)


@PACKAGES
def test_another_name_is_not_there(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match=f"module '{package.__name__}' has no attribute 'nothing'"):
        _ = package.nothing


@PACKAGES
def test_every_name_stands_in_the_document(package: ModuleType) -> None:
    text = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    assert [name for name in package.__all__ if f"`{name}`" not in text] == []


@PACKAGES
def test_every_class_and_function_says_what_it_is(package: ModuleType) -> None:
    things = [getattr(package, name) for name in package.__all__]
    functions = [thing for thing in things if callable(thing)]
    assert len(functions) > 10
    assert [thing.__name__ for thing in functions if len(inspect.getdoc(thing) or "") < 20] == []


def test_nothing_heavy_is_imported_before_it_is_asked_for() -> None:
    heavy = "numpy", "numba", "scipy", "pyproj", "rasterio"
    code = f"import sys, mapping, planning; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout == "[]\n"


def test_ten_lines_plan_and_certify(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_dsm("hillside.tif", demo_dsm())
    code = shown(planning)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    exec(code, {})
    assert re.fullmatch(r"True \d+\.\d+ m\n", capsys.readouterr().out)
    assert {path.name for path in tmp_path.iterdir()} == {"hillside.tif", *planning.FILES}


def test_what_mapping_shows_runs() -> None:
    cube = frame(mapping.AWR1843, Echo(30.0))
    points_enu = np.array([[0.0, 20.0, 12.0]])
    names = {"cube": cube, "points_enu": points_enu}
    exec(shown(mapping), names)
    assert names["found"].range_m == pytest.approx([30.0], abs=0.3)
    assert len(names["objects"]) == 1
    assert names["voxels"].occupied_count == 1
