"""The documents name what there is."""

import re

from tests.conftest import ROOT

FLOORS = ("mapping", "planning", "telemetry", "server")
ARCHITECTURE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")


def test_architecture_can_be_read_in_ten_minutes():
    assert len(ARCHITECTURE.splitlines()) <= 200


def test_architecture_names_only_what_there_is():
    named = re.findall(rf"`((?:{'|'.join(FLOORS)}|web|tests)/[\w./-]*)`", ARCHITECTURE)
    assert len(named) > 40
    assert not [path for path in named if not (ROOT / path).exists()]
    modules = re.findall(rf"`((?:{'|'.join(FLOORS)})(?:\.\w+)+)`", ARCHITECTURE)
    places = [ROOT / name.replace(".", "/") for name in modules]
    assert not [str(place) for place in places if not (place.is_dir() or place.with_suffix(".py").is_file())]


def test_architecture_names_every_room_of_the_floors():
    folders = {
        f"{path.parent.parent.name}/{path.parent.name}/"
        for floor in FLOORS
        for path in ROOT.glob(f"{floor}/*/__init__.py")
    }
    assert len(folders) > 35
    assert not {folder for folder in folders if f"`{folder}`" not in ARCHITECTURE}
