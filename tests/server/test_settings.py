"""Defaults, file, environment and options, in this order; wrong ones are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from server.errors import StartError
from server.settings import Settings, load_settings, settings_document, settings_table


@pytest.fixture(autouse=True)
def _own_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.delenv("HEDGEHOP_SETTINGS_FILE", raising=False)


def _write(tmp_path: Path, text: str) -> None:
    (tmp_path / "config" / "hedgehop").mkdir(parents=True)
    (tmp_path / "config" / "hedgehop" / "settings.toml").write_text(text)


def test_defaults_are_private(tmp_path: Path) -> None:
    settings = load_settings()
    assert (settings.host, settings.port, settings.password) == ("127.0.0.1", 8000, None)
    assert settings.data_dir == tmp_path / "data" / "hedgehop"


def test_options_beat_the_environment_which_beats_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _write(tmp_path, 'port = 1001\nhost = "0.0.0.0"\nsession_days = 3\nallowed_hosts = ["a:1", "b:2"]\n')
    monkeypatch.setenv("HEDGEHOP_PORT", "1002")
    monkeypatch.setenv("HEDGEHOP_HOST", "::1")
    monkeypatch.setenv("HEDGEHOP_ALLOWED_ORIGINS", "https://a, https://b")
    settings = load_settings(port=1003, host=None)
    assert (settings.port, settings.host, settings.session_days) == (1003, "::1", 3)
    assert settings.allowed_hosts == ("a:1", "b:2")
    assert settings.allowed_origins == ("https://a", "https://b")


def test_the_password_is_shown_nowhere() -> None:
    settings = load_settings(password="correct horse")
    assert settings.password is not None
    assert settings.password.get_secret_value() == "correct horse"
    assert "correct" not in repr(settings) + str(settings.model_dump())


@pytest.mark.parametrize(
    ("name", "value"),
    [("port", "0"), ("port", "x"), ("log_level", "loud"), ("upload_limit_bytes", "-1"), ("password", "short")],
)
def test_a_wrong_setting_is_named(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"HEDGEHOP_{name.upper()}", value)
    with pytest.raises(StartError) as refused:
        load_settings()
    assert refused.value.where == f"setting {name}"
    assert f"HEDGEHOP_{name.upper()}" in refused.value.advice
    assert "short" not in str(refused.value)


@pytest.mark.parametrize("text", ["port = ", "prot = 8000", "\x00"])
def test_a_wrong_file_is_a_clear_error(tmp_path: Path, text: str) -> None:
    _write(tmp_path, text)
    with pytest.raises(StartError):
        load_settings()


def test_a_named_file_must_exist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HEDGEHOP_SETTINGS_FILE", str(tmp_path / "missing.toml"))
    with pytest.raises(StartError, match="no settings file"):
        load_settings()


def test_the_table_lists_every_setting() -> None:
    table = settings_table()
    assert all(f"HEDGEHOP_{name.upper()}" in table for name in Settings.model_fields)
    assert "None |\n" not in table


def test_the_documentation_is_the_present_one() -> None:
    document = Path(__file__).resolve().parents[2] / "docs" / "settings.md"
    assert document.read_text(encoding="utf-8") == settings_document(), (
        "run: python -c \"from server.settings import settings_document as d; print(d(), end='')\" > docs/settings.md"
    )
    for name in Settings.model_fields:
        assert f"`HEDGEHOP_{name.upper()}`" in settings_document()


def test_the_documented_example_is_accepted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    example = settings_document().partition("```toml\n")[2].partition("```")[0]
    (tmp_path / "settings.toml").write_text(example)
    monkeypatch.setenv("HEDGEHOP_SETTINGS_FILE", str(tmp_path / "settings.toml"))
    assert load_settings().allowed_origins == ("https://gcs.example",)


def test_the_demo_has_autopilots_of_its_vehicles_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HEDGEHOP_DEMO_AUTOPILOTS", "ardupilot, px4")
    settings = load_settings()
    assert [settings.demo_autopilot(index) for index in range(3)] == ["ardupilot", "px4", "ardupilot"]
    with pytest.raises(StartError, match="demo_autopilots"):
        load_settings(demo_autopilots="px5")
