"""What can be said of the image without an engine: who runs, what is reachable, and that nothing is left out."""

import re
import shlex
import stat
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
DOCKER = ROOT / "docker"


@pytest.fixture(scope="module")
def instructions() -> list[tuple[str, str]]:
    """Instructions of the Dockerfile, comments left out and continued lines joined."""
    text = (DOCKER / "Dockerfile").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    joined = "\n".join(lines).replace("\\\n", " ")
    return [(word, rest.strip()) for word, _, rest in (line.partition(" ") for line in joined.splitlines()) if word]


@pytest.fixture(scope="module")
def last_stage(instructions: list[tuple[str, str]]) -> list[tuple[str, str]]:
    start = max(index for index, (word, _) in enumerate(instructions) if word == "FROM")
    return instructions[start:]


@pytest.fixture(scope="module")
def compose() -> str:
    """The compose file without its comments."""
    lines = (DOCKER / "compose.yaml").read_text(encoding="utf-8").splitlines()
    return "\n".join(line for line in lines if not line.lstrip().startswith("#"))


def section(compose: str, name: str) -> str:
    """The lines that stand under `name:` of the service, at whatever depth."""
    found = re.search(rf"^( +){name}:\n((?:\1 +.*\n?)+)", compose, re.MULTILINE)
    assert found, f"no {name} in compose.yaml"
    return found[2]


def test_the_base_image_is_an_argument_and_all_stages_come_from_it(instructions: list[tuple[str, str]]) -> None:
    assert instructions[0][0] == "ARG"
    assert instructions[0][1].startswith("BASE_IMAGE=")
    sources = [rest for word, rest in instructions if word == "FROM"]
    assert sources == ["${BASE_IMAGE} AS python", "python AS build", "python"]


def test_the_server_runs_as_nobody_special(last_stage: list[tuple[str, str]]) -> None:
    users = [rest for word, rest in last_stage if word == "USER"]
    assert users == ["hedgehop"]
    after = [word for word, _ in last_stage[last_stage.index(("USER", "hedgehop")) :]]
    assert "RUN" not in after


def test_the_last_stage_brings_no_compiler_and_no_node(last_stage: list[tuple[str, str]]) -> None:
    text = " ".join(rest for _, rest in last_stage)
    for unwanted in ("build-essential", "gcc", "npm", "/opt/node", "python3-venv", "pip install"):
        assert unwanted not in text


def test_its_health_is_checked_at_the_servers_own_address(last_stage: list[tuple[str, str]]) -> None:
    (check,) = [rest for word, rest in last_stage if word == "HEALTHCHECK"]
    assert "/opt/healthy.py" in check
    assert "127.0.0.1:{os.environ['HEDGEHOP_PORT']}/api/health" in (DOCKER / "healthy.py").read_text(encoding="utf-8")
    sources = (ROOT / "server" / "api").rglob("*.py")
    assert any('@router.get("/api/health"' in path.read_text(encoding="utf-8") for path in sources)


def test_the_image_sets_settings_that_exist(last_stage: list[tuple[str, str]]) -> None:
    names = set(re.findall(r"HEDGEHOP_[A-Z_]+(?==)", " ".join(rest for word, rest in last_stage if word == "ENV")))
    documented = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")
    assert names == {"HEDGEHOP_HOST", "HEDGEHOP_PORT", "HEDGEHOP_DATA_DIR"}
    assert all(f"`{name}`" in documented for name in names)


def test_python_packages_are_locked(instructions: list[tuple[str, str]]) -> None:
    installs = [
        step for word, rest in instructions if word == "RUN" for step in rest.split("&&") if "pip install" in step
    ]
    assert len(installs) == 3
    assert all("--require-hashes" in step or "--no-deps" in step for step in installs)


def test_all_that_is_copied_exists_and_is_not_ignored(instructions: list[tuple[str, str]]) -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    for word, rest in instructions:
        if word == "COPY" and not rest.startswith("--from"):
            for source in shlex.split(rest)[:-1]:
                assert (ROOT / source).exists()
                assert source not in ignored


def test_packages_of_the_wheel_and_what_stands_at_the_start_are_not_ignored() -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = project["tool"]["hatch"]["build"]["targets"]["wheel"]["hooks"]["custom"]["packages"]
    assert not set(packages) & set(ignored)
    assert {".git", ".venv", "web/node_modules"} <= set(ignored)
    assert (DOCKER / "start.sh").stat().st_mode & stat.S_IXOTH


def test_the_console_is_published_on_loopback_only(compose: str) -> None:
    ports = re.findall(r'- "([^"]+)"', section(compose, "ports"))
    assert ports == ["127.0.0.1:8000:8000/tcp", "${HEDGEHOP_MAVLINK_ADDRESS:-127.0.0.1}:14550:14550/udp"]


def test_the_router_is_of_the_version_that_stations_speak_and_has_no_rights() -> None:
    """Its image's entry point parts arguments at spaces: none may hold one."""
    text = (DOCKER / "compose.fleet.yaml").read_text(encoding="utf-8")
    used = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#"))
    locked = re.search(r"^eclipse-zenoh==(\S+)", (ROOT / "requirements.txt").read_text(encoding="utf-8"), re.MULTILINE)
    assert locked
    assert f"HEDGEHOP_ROUTER_IMAGE:-eclipse/zenoh:{locked[1]}}}" in used
    assert 'command: ["--config", "/router.json5"]' in used
    assert section(used, "ports").split() == ["-", '"${HEDGEHOP_ROUTER_ADDRESS:-0.0.0.0}:7447:7447/tcp"']
    assert section(used, "cap_drop").split() == ["-", "ALL"]
    assert "target: /router.json5\n        read_only: true" in used
    assert "create_host_path: false" in used
    # What a station in a container is given: settings that exist.
    documented = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")
    given = re.findall(r"^#\s+(HEDGEHOP_STATIONS_[A-Z_]+):", text, re.MULTILINE)
    assert given == ["HEDGEHOP_STATIONS_ROUTER", "HEDGEHOP_STATIONS_FILE"]
    assert all(f"`{name}`" in documented for name in given)


def test_the_container_may_do_nothing_it_does_not_need(compose: str) -> None:
    assert "read_only: true" in compose
    assert section(compose, "cap_drop").split() == ["-", "ALL"]
    assert "no-new-privileges:true" in section(compose, "security_opt")
    assert "/tmp" in section(compose, "tmpfs")
    assert section(compose, "volumes").split() == ["-", "data:/data"]
    for unwanted in ("privileged: true", "network_mode", "cap_add", "devices:", "docker.sock"):
        assert unwanted not in compose
