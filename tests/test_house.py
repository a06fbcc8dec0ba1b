"""House rules that a machine can see: what may stand in the files of this project, and what the lock files hold."""

import importlib.metadata
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import planning

ROOT = Path(__file__).resolve().parent.parent
REQUIREMENTS = ("requirements.txt", "requirements-test.txt", "requirements-node.txt", "requirements-peers.txt")
# Put together here, so that this file does not break the rules it checks.
HOST_LABELS = (("registry", "npmjs", "org"), ("pypi", "org"), ("files", "pythonhosted", "org"), ("npmmirror", "com"))
REGISTRY_HOSTS = re.compile(b"|".join(re.escape(".".join(labels).encode()) for labels in HOST_LABELS))
PUT_OFF = re.compile(rb"\b(TO" + rb"DO|FIX" + rb"ME|XX" + rb"X)\b")


@pytest.fixture(scope="module")
def project_files() -> dict[Path, bytes]:
    """Every file that is, or could be, under version control, with its content."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("no git checkout: the project's files cannot be told from those that tools made")
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    paths = [ROOT / name for name in listing.split("\0") if name]
    return {path.relative_to(ROOT): path.read_bytes() for path in paths if path.is_file()}


def files_that_match(files: dict[Path, bytes], pattern: re.Pattern[bytes]) -> list[str]:
    return [str(path) for path, content in files.items() if b"\0" not in content and pattern.search(content)]


def test_no_file_names_a_package_registry(project_files: dict[Path, bytes]) -> None:
    assert files_that_match(project_files, REGISTRY_HOSTS) == []


def test_no_file_names_the_folder_it_was_written_in(project_files: dict[Path, bytes]) -> None:
    if len(ROOT.parts) < 3:
        pytest.skip(f"{ROOT} is too common a path to be looked for")
    here = re.compile(rb"(?<![\w./-])" + re.escape(str(ROOT).encode()) + rb"(?![\w-])")
    assert files_that_match(project_files, here) == []


def test_nothing_is_put_off(project_files: dict[Path, bytes]) -> None:
    sources = {path: text for path, text in project_files.items() if path.suffix in {".py", ".ts", ".tsx", ".toml"}}
    assert files_that_match(sources, PUT_OFF) == []


@pytest.mark.parametrize("name", REQUIREMENTS)
def test_every_requirement_is_pinned_and_hashed(name: str) -> None:
    text = (ROOT / name).read_text()
    entries = [entry for entry in re.split(r"\n(?=\S)", text) if not entry.startswith("#")]
    assert entries
    unlocked = [entry for entry in entries if not re.match(r"[\w.-]+==\S+.*\\\n +--hash=sha256:[0-9a-f]{64}", entry)]
    assert unlocked == []


@pytest.mark.parametrize("name", REQUIREMENTS)
def test_requirements_name_no_place_to_download_from(name: str) -> None:
    assert re.findall(r".*(?:://|--index-url|--find-links|--extra-index-url| @ ).*", (ROOT / name).read_text()) == []


def test_the_consoles_packages_are_hashed_and_name_no_place_to_download_from() -> None:
    text = (ROOT / "web" / "package-lock.json").read_text()
    assert '"resolved"' not in text
    packages = json.loads(text)["packages"]
    assert [name for name, entry in packages.items() if name and "integrity" not in entry] == []


def test_what_the_consoles_packages_ask_for_is_locked_for_every_machine() -> None:
    """Also what is built for other processors only: where it is missing, newer versions of npm refuse all."""
    packages = json.loads((ROOT / "web" / "package-lock.json").read_text())["packages"]
    locked = {name.rpartition("node_modules/")[2] for name in packages}
    asked = {
        name
        for entry in packages.values()
        for name in {**entry.get("dependencies", {}), **entry.get("optionalDependencies", {})}
    }
    assert sorted(asked - locked) == []


def test_the_installed_version_is_the_one_that_certificates_name() -> None:
    assert importlib.metadata.version("hedgehop") == planning.__version__
