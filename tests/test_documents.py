"""The documents name what there is."""

import re

from tests.conftest import ROOT


def test_architecture_names_every_module():
    tracked = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "mapping", "planning", "telemetry", "server"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    present = [path for path in tracked if (ROOT / path).is_file()]
    modules = [path for path in present if path.endswith(".py") and not path.endswith("__init__.py")]
    assert len(modules) > 50
    missing = [path for path in modules if f"`{path.rsplit('/', 1)[1]}`" not in text]
    assert not missing
    unnamed_folders = {path.rsplit("/", 1)[0] + "/" for path in modules if path.count("/") > 1} - {
        folder for folder in text.split("`") if folder.endswith("/")
    }
    assert not unnamed_folders
