"""The import contracts of pyproject.toml hold, and each of them notices a breach."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FLOORS = ("mapping", "planning", "telemetry", "server")
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]


def named_by_contracts() -> set[str]:
    """Dotted names of all modules and packages of ours that a contract speaks of."""
    named = set[str]()
    for contract in CONTRACTS:
        named.update(contract.get("source_modules", ()))
        named.update(contract.get("forbidden_modules", ()))
        layers = [part.strip() for layer in contract.get("layers", ()) for part in layer.split("|")]
        named.update(f"{container}.{layer}" for container in contract.get("containers", ()) for layer in layers)
    return {name for name in named if name.split(".")[0] in FLOORS}


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the contracts of `folder`'s pyproject.toml on the packages in `folder`."""
    return subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache", "--no-logo"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


def put(house: Path, module: str, text: str = "") -> None:
    """A module, with the packages that it lies in."""
    path = house / module
    path.parent.mkdir(parents=True, exist_ok=True)
    for folder in path.relative_to(house).parents[:-1]:
        (house / folder / "__init__.py").touch()
    path.write_text(text)


@pytest.fixture
def small_house(tmp_path: Path) -> Path:
    """The same floors and contracts with nothing in them but the modules that the contracts name."""
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for floor in FLOORS:
        (tmp_path / floor).mkdir()
        (tmp_path / floor / "__init__.py").touch()
    for name in named_by_contracts():
        path = "/".join(name.split("."))
        put(tmp_path, f"{path}/__init__.py" if (ROOT / path).is_dir() else f"{path}.py")
    return tmp_path


def test_the_floors_keep_their_contracts() -> None:
    result = lint_imports(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_raster_module_may_open_rasters(small_house: Path) -> None:
    put(small_house, "planning/terrain/geotiff.py", "import rasterio\n")
    result = lint_imports(small_house)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("module", "statement", "contract"),
    [
        ("mapping/geometry/frames.py", "import planning", "Floors import downward only"),
        ("planning/terrain/dsm.py", "import rasterio.windows", "Only the raster modules open rasters"),
        ("telemetry/bus/bus.py", "from pydantic import BaseModel", "Only the server knows the web frameworks"),
        ("server/app.py", "import pymavlink.mavutil", "Only telemetry knows the wire protocols and the bus"),
        (
            "telemetry/link/link.py",
            "import zenoh",
            "Only the bus and the wires to ROS 2 and to other stations know Zenoh",
        ),
        (
            "planning/certificate/clearance.py",
            "import planning.safe_surface",
            "The certificate is independent of the planner",
        ),
        (
            "planning/certificate/nearest.py",
            "import planning.route",
            "The certificate is independent of the planner",
        ),
        (
            "telemetry/simulation/simulator/airframe/gnss.py",
            "import pymavlink.mavutil",
            "The simulated world and its dynamics know no MAVLink",
        ),
        (
            "telemetry/nodes/replay.py",
            "import telemetry.bus.link_client",
            "What plays recordings back cannot reach a vehicle",
        ),
    ],
)
def test_each_contract_notices_a_breach(small_house: Path, module: str, statement: str, contract: str) -> None:
    put(small_house, module, f"{statement}\n")
    result = lint_imports(small_house)
    assert result.returncode == 1, result.stdout + result.stderr
    assert f"{contract} BROKEN" in result.stdout
