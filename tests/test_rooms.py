"""What is told of circles, crowded folders, long files and shared names, on this house and on a small one."""

from pathlib import Path

import pytest

from tests import rooms


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """Two folders of a floor; the files of both import downward."""
    for module, text in {
        "server/high/desk.py": "from server.low.shelf import Shelf\n",
        "server/high/table.py": "from server.high import desk\n",
        "server/low/shelf.py": "class Shelf: ...\n",
        "server/low/board.py": "import mapping.frames\n",
        "mapping/frames.py": "",
    }.items():
        path = tmp_path / module
        path.parent.mkdir(parents=True, exist_ok=True)
        (path.parent / "__init__.py").touch()
        path.write_text(text)
    return tmp_path


def test_this_house_has_no_fault():
    assert list(rooms.faults(rooms.ROOT)) == []


def test_a_house_whose_imports_go_down_has_no_fault(house: Path):
    assert list(rooms.faults(house)) == []


def test_a_circle_of_files_is_told_even_where_an_import_is_for_types_alone(house: Path):
    (house / "server/high/desk.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from server.high.table import Table\n"
    )
    told = list(rooms.faults(house))
    assert told[0].startswith("circle of files: ")
    assert all(name in told[0] for name in ("server/high/desk.py", "server/high/table.py"))


def test_folders_that_import_each_other_are_told_though_no_file_does(house: Path):
    (house / "server/low/board.py").write_text("def late():\n    from server.high import table\n")
    assert list(rooms.faults(house)) in (
        ["circle of rooms of server: high -> low -> high"],
        ["circle of rooms of server: low -> high -> low"],
    )


def test_what_a_package_hands_on_is_no_room(house: Path):
    (house / "server/low/__init__.py").write_text("from server.high.desk import Shelf\n")
    assert list(rooms.faults(house)) == []


def test_a_crowded_folder_is_told(house: Path):
    for number in range(rooms.MOST_ROOMS):
        (house / f"server/low/box_{number}.py").touch()
    assert list(rooms.faults(house)) == [f"server/low: {rooms.MOST_ROOMS + 2} rooms, more than {rooms.MOST_ROOMS}"]


@pytest.mark.parametrize("path", ["server/low/shelf.py", "tests/server/test_shelf.py"])
def test_a_file_that_nobody_reads_in_a_sitting_is_told(house: Path, path: str):
    (house / path).parent.mkdir(parents=True, exist_ok=True)
    (house / path).write_text("\n" * rooms.MOST_LINES)
    assert list(rooms.faults(house)) == []
    (house / path).write_text("\n" * (rooms.MOST_LINES + 1))
    assert list(rooms.faults(house)) == [f"{path}: 401 lines, more than 400"]


def fill(house: Path, modules: list[str], lines: int) -> None:
    for number, name in enumerate(modules):
        path = house / f"mapping/box_{number // 20}/{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n" * lines)


def test_too_many_short_files_are_told(house: Path):
    most = rooms.MOST_SMALL_ONES - 5
    fill(house, [f"name_{number}" for number in range(most)], 39)
    assert list(rooms.faults(house)) == []
    fill(house, [f"name_{number}" for number in range(most + 1)], 39)
    assert list(rooms.faults(house)) == ["31 modules of under 40 lines, more than 30: join some"]


def test_too_many_names_of_several_files_are_told(house: Path):
    names = [f"name_{number}" for number in range(rooms.MOST_SHARED_NAMES + 1)]
    fill(house, names[:-1] * 2, 40)
    assert list(rooms.faults(house)) == []
    fill(house, [*names[:-1], *names], 40)
    (house / "server/low/name_25.py").write_text("\n" * 40)
    (told,) = rooms.faults(house)
    assert told.startswith("26 names of several files, more than 25: name_0, ")
