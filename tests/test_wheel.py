"""The wheel: one package of Hedgehop's own name, with all that it needs inside, works where no checkout is."""

import ast
import json
import os
import re
import subprocess
import sys
import sysconfig
import time
import tomllib
import zipfile
from pathlib import Path

import httpx
import numpy as np
import pytest

from hatch_build import moved_imports
from planning.basics.plan_model import Poi
from planning.ground.demo_hillside import small_hill
from planning.terrain.geotiff import write_dsm
from server.settings import default_console_dir
from telemetry.bus.node_lock import running_nodes
from tests.e2e.stations import Station
from tests.planning.format_examples import write_pois_csv
from tests.server.station import PATIENCE_S

# One worker builds and installs for all of them.
pytestmark = pytest.mark.xdist_group("wheel")

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["hooks"]["custom"]["packages"]
# Kernels run uncompiled: compiling them anew in each new environment takes longer than all else.
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "HEDGEHOP_"))} | {
    "NUMBA_DISABLE_JIT": "1"
}
IMPORT_ALL = """
import importlib, pkgutil, sys, hedgehop
for module in pkgutil.walk_packages(hedgehop.__path__, "hedgehop."):
    importlib.import_module(module.name)
from hedgehop.mapping import *
from hedgehop.planning import *
print(*sys.modules)
"""


@pytest.mark.parametrize(
    ("source", "moved"),
    [
        ("from planning.x import y\n", "from hedgehop.planning.x import y\n"),
        ("from planning import x, y as z\n", "from hedgehop.planning import x, y as z\n"),
        ("import planning\n", "import hedgehop.planning as planning\n"),
        ("import planning.x as x\n", "import hedgehop.planning.x as x\n"),
        ("import os, planning, server as s\n", "import os, hedgehop.planning as planning, hedgehop.server as s\n"),
        ("if 'µ': from server import x  # from server\n", "if 'µ': from hedgehop.server import x  # from server\n"),
        (
            "def f():\n    from server import (\n        x,\n    )\n",
            "def f():\n    from hedgehop.server import (\n        x,\n    )\n",
        ),
    ],
)
def test_imports_of_the_floors_are_moved(source: str, moved: str) -> None:
    assert moved_imports(source.encode(), PACKAGES).decode() == moved


@pytest.mark.parametrize(
    "source",
    ["from . import planning\n", "from .planning import x\n", "import planningtool\n", "x = 'import server'\n"],
)
def test_nothing_else_is_moved(source: str) -> None:
    assert moved_imports(source.encode(), PACKAGES).decode() == source


def test_an_import_that_cannot_be_moved_ends_the_build() -> None:
    with pytest.raises(ValueError, match=r"a\.py, line 2: write `from planning import"):
        moved_imports(b"import os\nimport planning.dsm\n", PACKAGES, where="a.py")


def test_no_string_names_a_module() -> None:
    """It would not be found where the floors lie in one package: names are made of ``__name__`` or ``__package__``."""
    floors = "|".join(PACKAGES)
    named = re.compile(rf"^(?:{floors})\.\w|\b(?:from|import) (?:{floors})\b(?!/)")
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}: {node.value}"
        for floor in PACKAGES
        for path in (ROOT / floor).rglob("*.py")
        for node in strings(ast.parse(path.read_bytes()))
        if named.search(str(node.value))
    ]
    assert found == []


def strings(tree: ast.AST) -> list[ast.Constant]:
    """All but docstrings."""
    told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in told]
    return [node for node in nodes if isinstance(node.value, str)]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, ROOT)
    (built,) = folder.iterdir()
    return built


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with the wheel and, of this one, all packages, but not the checkout that it points at."""
    folder = tmp_path_factory.mktemp("environment")
    run([sys.executable, "-m", "venv", "--without-pip", folder])
    pip("--python", folder / "bin" / "python", "install", "--no-deps", "--no-index", wheel)
    site_packages(folder).joinpath("others.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    return folder


def pip(*arguments: str | Path) -> None:
    run([sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", *arguments])


def site_packages(environment: Path) -> Path:
    return next(environment.glob("lib/python*/site-packages"))


def run(command: list[str | Path], folder: Path | None = None) -> str:
    """Its output; away from the checkout, if a folder is given."""
    done = subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_wheel_holds_what_the_repository_holds(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        metadata = archive.read(next(name for name in names if name.endswith("METADATA"))).decode()
    shipped = [
        p for floor in PACKAGES for p in (ROOT / floor).rglob("*") if p.is_file() and "__pycache__" not in p.parts
    ]
    assert {f"hedgehop/{path.relative_to(ROOT)}" for path in shipped} | {"hedgehop/py.typed"} <= names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    needed = re.findall(r"^Requires-Dist: ([\w-]+)(?!.*extra ==)", metadata, re.MULTILINE)
    assert sorted(needed) == sorted(
        re.split(r"[<>=]", dependency)[0] for dependency in PROJECT["project"]["dependencies"]
    )


@pytest.mark.slow
def test_one_name_lands_in_the_environment_and_every_module_loads(environment: Path, tmp_path: Path) -> None:
    landed = [path.name for path in site_packages(environment).iterdir() if path.suffix not in {".dist-info", ".pth"}]
    assert landed == ["hedgehop"]
    loaded = run([environment / "bin" / "python", "-c", IMPORT_ALL], tmp_path).split()
    assert {f"hedgehop.{name}" for name in PACKAGES} <= set(loaded)
    assert not set(PACKAGES) & {name.partition(".")[0] for name in loaded}


@pytest.mark.slow
def test_the_command_plans_and_certifies(environment: Path, tmp_path: Path) -> None:
    """It reads the surface model in a worker process."""
    hill = small_hill()
    west, south, _, _ = hill.bounds_m
    places = hill.lat_lon_from_xy(np.array([(west + 50, south + 50), (west + 60, south + 60)]))
    write_dsm(tmp_path / "hill.tif", hill)
    (tmp_path / "pois.csv").write_text(write_pois_csv([Poi(lat, lon) for lat, lon in places.tolist()]))
    command = environment / "bin" / "hedgehop"
    assert "Plan drone flights" in run([command, "--help"], tmp_path)
    summary = json.loads(run([command, "plan", "hill.tif", "pois.csv", "--out", "flight", "--json"], tmp_path))
    assert summary["certified"] is True
    assert (tmp_path / "flight" / "report.html").is_file()


@pytest.mark.slow
def test_the_demo_is_served_with_console_and_nodes(environment: Path, tmp_path: Path) -> None:
    if not (default_console_dir() / "index.html").is_file():
        pytest.skip("the console is not built: make setup")
    data = tmp_path / "data"
    station = Station(data, "--demo", program=[environment / "bin" / "hedgehop"], environment=ENVIRONMENT)
    try:
        page = station.http.get(httpx.URL(station.link).raw_path.decode(), follow_redirects=True)
        assert page.text == (default_console_dir() / "index.html").read_text()
        end_s = time.monotonic() + PATIENCE_S
        while not any(facts.name == "link" for facts in running_nodes(data / "run")):
            assert time.monotonic() < end_s, "no link node started"
            time.sleep(0.1)
    finally:
        station.stop()
