"""Parameter files of both formats, written and read, beside pymavlink's own reader; comparing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavparm

from planning.errors import FormatError
from telemetry.parameters.comparing import compare, of_vehicle
from telemetry.parameters.files import (
    FileParameter,
    read_parameter_file,
    value_text,
    write_mission_planner,
    write_qgc,
)
from telemetry.topics.parameters import Parameter

HELD = (
    Parameter("WP_SPD", float(np.float32(3.3)), 9),
    Parameter("RTL_ALT", 1900.0, 6),
    Parameter("BIG", 2_000_000_001.0, 6),
    Parameter("TINY", float(np.float32(1.25e-7)), 9),
    Parameter("NOTHING", None, 9),
    Parameter("NEGATIVE", -8.0, 2),
)


def read(text: str) -> dict[str, float]:
    return {p.name: p.value for p in read_parameter_file("a.param", text.encode()).parameters}


@pytest.mark.parametrize("text", [write_mission_planner(HELD, "Vehicle 1\n4.7"), write_qgc(HELD, system_id=7)])
def test_what_is_written_is_read_back_equal(text: str) -> None:
    there = read_parameter_file("a.params", text.encode()).parameters
    assert compare(of_vehicle(HELD), there).is_equal
    assert len(there) == 5
    assert "NOTHING" not in text


def test_mission_planners_format() -> None:
    assert write_mission_planner(HELD, "Vehicle 1").splitlines() == [
        "# Vehicle 1", "BIG,2000000001", "NEGATIVE,-8", "RTL_ALT,1900", "TINY,1.25e-07", "WP_SPD,3.3",
    ]  # fmt: skip


def test_qgroundcontrols_format() -> None:
    lines = write_qgc(HELD, system_id=7).splitlines()
    assert lines[0] == "# Vehicle-Id\tComponent-Id\tName\tValue\tType"
    assert "7\t1\tWP_SPD\t3.3\t9" in lines
    assert "7\t1\tRTL_ALT\t1900\t6" in lines


def test_pymavlink_reads_what_is_written_and_the_other_way_round(tmp_path: Path) -> None:
    ours, theirs = tmp_path / "ours.param", tmp_path / "theirs.parm"
    ours.write_text(write_mission_planner(HELD, "Vehicle 1"))
    judge = mavparm.MAVParmDict()
    assert judge.load(str(ours))
    assert {name: np.float32(value) for name, value in judge.items()} == {
        p.name: np.float32(p.value) for p in HELD if p.value is not None
    }
    judge.save(str(theirs))
    found = read_parameter_file("theirs.parm", theirs.read_bytes()).parameters
    assert compare(of_vehicle(HELD), found).is_equal, "MAVProxy cuts to six decimals"


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_every_single_precision_number_is_written_so_that_it_is_read_back(value: float) -> None:
    assert np.float32(float(value_text(value, 9))) == np.float32(value)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("RTL_ALT,1500\nWP_SPD,5.5\n", {"RTL_ALT": 1500, "WP_SPD": 5.5}),
        ("RTL_ALT          1500.000000\n", {"RTL_ALT": 1500}),
        ("#NOTE: a vehicle\r\nRTL_ALT\t1500 # the return\r\n\r\n", {"RTL_ALT": 1500}),
        ("MASK,0x1F\nF,1e-3 @READONLY", {"MASK": 31, "F": 0.001}),
        ("RTL_ALT,1500\nRTL_ALT,1500.0", {"RTL_ALT": 1500}),
        ("\ufeff# Onboard\n1\t1\tRTL_ALT\t1500\t6\n", {"RTL_ALT": 1500}),
    ],
)
def test_what_programs_write_is_read(text: str, found: dict[str, float]) -> None:
    assert read(text) == found


def test_other_components_are_left_out_and_it_is_said() -> None:
    file = read_parameter_file("x.params", b"1\t1\tA\t1\t9\n1\t154\tB\t1\t9\n")
    assert [p.name for p in file.parameters] == ["A"]
    assert file.notes == ("Lines of other components than the autopilot are left out of x.params: 1.",)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("A,1\nB", 2, "1 words"),
        ("A,1,5", 1, "3 words"),
        ("A,one", 1, "no number"),
        ("A,1_000", 1, "no number"),
        ("A,nan", 1, "no number"),
        ("A,1e999", 1, "no finite number"),
        ("A-B,1", 1, "no parameter's name"),
        ("AAAAAAAAAAAAAAAAA,1", 1, "at most 16"),
        ("A,1\n\nA,2", 3, "line 1 with 1"),
        ("1\t1\tA\t1.5\t6", 1, "no whole number"),
        ("1\t1\tA\t300\t1", 1, "0 to 255"),
        ("1\t1\tA\t1\t99", 1, "no type 99"),
        ("1\tx\tA\t1\t9", 1, "no whole number"),
    ],
)
def test_a_wrong_line_is_named(text: str, line: int, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(text)
    assert f"line {line}" in caught.value.where
    assert words in f"{caught.value.what} {caught.value.advice}"


@pytest.mark.parametrize("data", [b"", b"# nothing\n", b"1\t154\tB\t1\t9\n", b"\x00\x01", b"A,1\n" * 100_001])
def test_what_is_no_parameter_file(data: bytes) -> None:
    with pytest.raises(FormatError):
        read_parameter_file("x.param", data)


def test_comparing() -> None:
    here = [FileParameter("A", 1.0, 1), FileParameter("B", 2.0, 2), FileParameter("C", 0.1, 3, 9)]
    there = [FileParameter("B", 3.0, 1), FileParameter("C", float(np.float32(0.1)), 2, 9), FileParameter("D", 4.0, 3)]
    made = compare(here, there)
    assert [p.name for p in made.only_here] == ["A"]
    assert [p.name for p in made.only_there] == ["D"]
    assert [(d.name, d.here, d.there) for d in made.different] == [("B", 2.0, 3.0)]
    assert made.same == 1
    assert not made.is_equal


def test_whole_numbers_differ_by_one_and_few_decimals_are_meant() -> None:
    big = [FileParameter("A", 5_000_001.0, 1, 6)]
    assert compare(big, [FileParameter("A", 5_000_000.0, 1)]).different
    assert compare([FileParameter("A", 1.5, 1)], [FileParameter("A", 1.54, 1)]).different
    cut = read_parameter_file("a", b"A 0.000001").parameters
    assert not compare(cut, [FileParameter("A", 1.4e-6, 1, 9)]).different
    assert compare(cut, [FileParameter("A", 1.6e-6, 1, 9)]).different
