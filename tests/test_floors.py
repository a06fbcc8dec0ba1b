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
NAMED_BY_CONTRACTS = (
    *(f"planning/{name}" for name in ("clearance", "certificate", "surface", "dilation", "geotiff")),
    *(
        f"telemetry/simulator/{name}"
        for name in ("autopilot", "dynamics", "battery", "gnss", "scene", "sensors", "world")
    ),
    *(f"telemetry/{name}" for name in ("bus", "link_client", "recording/replay", "mavlink/link")),
    *(f"telemetry/nodes/{name}" for name in ("link", "replay")),
)


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


@pytest.fixture
def small_house(tmp_path: Path) -> Path:
    """The same floors and contracts with nothing in them but the modules that the contracts name."""
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for floor in FLOORS:
        (tmp_path / floor).mkdir()
        (tmp_path / floor / "__init__.py").touch()
    for module in NAMED_BY_CONTRACTS:
        path = tmp_path / f"{module}.py"
        path.parent.mkdir(exist_ok=True)
        (path.parent / "__init__.py").touch()
        path.touch()
    return tmp_path


def test_the_floors_keep_their_contracts() -> None:
    result = lint_imports(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_raster_module_may_open_rasters(small_house: Path) -> None:
    (small_house / "planning" / "geotiff.py").write_text("import rasterio\n")
    result = lint_imports(small_house)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("module", "statement", "contract"),
    [
        ("mapping/frames.py", "import planning", "Floors import downward only"),
        ("planning/dsm.py", "import rasterio.windows", "Only the raster modules open rasters"),
        ("telemetry/bus.py", "from pydantic import BaseModel", "Only the server knows the web frameworks"),
        ("server/app.py", "import pymavlink.mavutil", "Only telemetry knows the wire protocols and the bus"),
        ("planning/clearance.py", "import planning.surface", "The certificate is independent of the planner"),
        (
            "planning/certificate.py",
            "import planning.dilation",
            "The certificate is independent of the planner",
        ),
        (
            "telemetry/simulator/gnss.py",
            "import pymavlink.mavutil",
            "The simulated world and its dynamics know no MAVLink",
        ),
        (
            "telemetry/nodes/replay.py",
            "import telemetry.link_client",
            "What plays recordings back cannot reach a vehicle",
        ),
    ],
)
def test_each_contract_notices_a_breach(small_house: Path, module: str, statement: str, contract: str) -> None:
    (small_house / module).write_text(f"{statement}\n")
    result = lint_imports(small_house)
    assert result.returncode == 1, result.stdout + result.stderr
    assert f"{contract} BROKEN" in result.stdout
