"""What the container is given, as far as files tell: no engine is needed here."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from server.door.tls import Tls
from server.errors import StartError
from server.settings import Settings, load_settings
from tests.server.running import running

DOCKER = Path(__file__).resolve().parents[1] / "docker"


@pytest.fixture(scope="module")
def service() -> dict[str, Any]:
    return yaml.safe_load((DOCKER / "compose.yaml").read_text(encoding="utf-8"))["services"]["hedgehop"]


def test_its_bounds(service: dict[str, Any]) -> None:
    assert service["mem_limit"] == "4g"
    assert (service["read_only"], service["cap_drop"], service["pids_limit"]) == (True, ["ALL"], 512)
    addresses = [port.rpartition(":")[0].rpartition(":")[0] for port in service["ports"]]
    assert addresses == ["127.0.0.1", "${HEDGEHOP_MAVLINK_ADDRESS:-127.0.0.1}"]


def test_its_base_is_one_digest_in_both_files(service: dict[str, Any]) -> None:
    arguments = re.findall(r"^ARG BASE_IMAGE=(\S+)$", (DOCKER / "Dockerfile").read_text(encoding="utf-8"), re.M)
    assert [service["build"]["args"]["BASE_IMAGE"]] == ["${HEDGEHOP_BASE_IMAGE:-" + base + "}" for base in arguments]
    assert re.fullmatch(r"debian:bookworm-slim@sha256:[0-9a-f]{64}", *arguments)


def test_its_settings_are_known_and_hold_no_secret(service: dict[str, Any]) -> None:
    given = {name.removeprefix("HEDGEHOP_").lower(): value for name, value in service["environment"].items()}
    assert given.keys() <= Settings.model_fields.keys()
    assert "password" not in given
    assert Tls.of(Settings(host="0.0.0.0", **given)) is None


def test_the_image_alone_does_not_speak_plain_http_to_a_network(tmp_path: Path) -> None:
    lines = (DOCKER / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    assert any("HEDGEHOP_HOST=0.0.0.0" in line for line in lines)
    assert not any("HEDGEHOP_BEHIND_PROXY" in line for line in lines)
    with pytest.raises(StartError, match="plain HTTP"):
        Tls.of(Settings(host="0.0.0.0", data_dir=tmp_path))


def test_the_password_comes_from_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    secret = tmp_path / "secret"
    secret.write_text("hunter2hunter2\n")
    monkeypatch.setenv("HEDGEHOP_PASSWORD_FILE", str(secret))
    password = load_settings().password
    assert password is not None
    assert password.get_secret_value() == "hunter2hunter2"
    for content, fault in (("short", "at least 8 characters"), (None, "cannot be read")):
        secret.write_text(content) if content else secret.unlink()
        with pytest.raises(StartError, match=fault):
            load_settings()


def test_the_health_check_tells_a_server_from_none(tmp_path: Path) -> None:
    def healthy(port: int) -> int:
        command = [sys.executable, str(DOCKER / "healthy.py")]
        return subprocess.run(command, env={"HEDGEHOP_PORT": str(port)}, capture_output=True, check=False).returncode

    with running(tmp_path) as server:
        # It waits for 2 s: a busy machine may answer later, once.
        assert any(healthy(server.settings.port) == 0 for _ in range(10))
    assert healthy(server.settings.port) != 0
