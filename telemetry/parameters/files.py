"""Parameter files: Mission Planner's and MAVProxy's (NAME,VALUE or NAME VALUE) and QGroundControl's (five columns)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from planning.errors import FormatError
from planning.formats.safe_text import clean_name, decode_text
from telemetry.topics.parameters import NAME_PATTERN, NAME_RULE, REAL32, SINGLE, WHOLE_RANGES, Parameter

AUTOPILOT = 1
"""Component whose parameters are read of QGroundControl's files: cameras and gimbals have their own."""
MOST_LINES = 100_000
_QGC_COLUMNS = 5
_WRITTEN_EXACTLY_DIGITS = 6
"""MAVProxy cuts what it writes to so many decimals."""
_KINDS = range(1, 11)
_DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")


KEPT_BY_VEHICLES = (
    *("MIS_TOTAL", "FENCE_TOTAL", "RALLY_TOTAL", "FORMAT_VERSION", "SYSID_SW_MREV", "SYS_NUM_RESETS", "LOG_LASTFILE"),
    *("STAT_*", "BARO*_GND_PRESS", "GND_ABS_PRESS", "GND_TEMP", "LND_FLIGHT_T_*", "COM_FLIGHT_UUID", "_HASH_CHECK"),
)
"""What vehicles count and measure by themselves; a file's value would be a lie."""
OWN_OF_EACH = (
    *("SYSID_THISMAV", "MAV_SYSID", "MAV_SYS_ID", "BRD_SERIAL_NUM", "COMPASS_*", "INS_*", "AHRS_TRIM_*", "RC[0-9]*"),
    *("BATT*_MULT", "BATT*_OFFSET", "BATT*_PERVLT", "CAL_*", "SENS_BOARD_*", "SENS_DPRES_OFF", "BAT*_V_DIV"),
)
"""A vehicle's number and what its own sensors and sticks were calibrated to: wrong on any other."""


@dataclass(frozen=True, slots=True)
class FileParameter:
    """One line."""

    name: str
    value: float
    line: int
    kind: int | None = None
    """MAV_PARAM_TYPE, where the file says it."""
    rounding: float = 0.0
    """Half a unit of the last decimal, where the file's program cuts decimals."""


@dataclass(frozen=True, slots=True)
class ParameterFile:
    parameters: tuple[FileParameter, ...]
    """Each name once, in the file's order."""
    notes: tuple[str, ...] = ()
    """What was left out."""


def is_kept_by_vehicles(name: str) -> bool:
    return any(fnmatchcase(name.upper(), pattern) for pattern in KEPT_BY_VEHICLES)


def is_own_of_each(name: str) -> bool:
    return any(fnmatchcase(name.upper(), pattern) for pattern in OWN_OF_EACH)


def read_parameter_file(name: str, data: bytes) -> ParameterFile:
    """Which format it is shows in each line. Raises FormatError with the line's number."""
    file = clean_name(name)
    lines = decode_text(name, data).splitlines()
    if len(lines) > MOST_LINES:
        raise FormatError(
            f"The file has more than {MOST_LINES} lines.", where=file, advice="This is no parameter file."
        )
    found: dict[str, FileParameter] = {}
    others = 0
    for number, text in enumerate(lines, start=1):
        entry = _line(text, number, f"{file}, line {number}")
        if entry is None:
            continue
        if isinstance(entry, int):
            others += 1
            continue
        before = found.setdefault(entry.name, entry)
        if before.value != entry.value:
            what = f"{entry.name} stands here with {_short(entry.value)} and in line {before.line} with "
            advice = "Remove the line that is wrong."
            raise FormatError(f"{what}{_short(before.value)}.", where=f"{file}, line {number}", advice=advice)
    if not found:
        advice = "A parameter file has lines such as RTL_ALT,1500."
        raise FormatError("The file holds no parameters of an autopilot.", where=file, advice=advice)
    note = f"Lines of other components than the autopilot are left out of {file}: {others}."
    return ParameterFile(tuple(found.values()), (note,) if others else ())


def _line(text: str, number: int, where: str) -> FileParameter | int | None:
    """None for a line without a parameter, a component's number for one of another component."""
    body = text.partition("#")[0].strip()
    if not body:
        return None
    columns = body.split("\t")
    if len(columns) == _QGC_COLUMNS:
        return _qgc(columns, number, where)
    words = [word for word in re.split(r"[,\s]+", body) if word]
    if len(words) == 3 and words[2].startswith("@"):
        words.pop()  # @READONLY, as ArduPilot's files of defaults have it
    if len(words) != 2:
        advice = "Write NAME,VALUE, or QGroundControl's five columns with tabs between them."
        raise FormatError(f"{len(words)} words stand here.", where=where, advice=advice)
    name, value = words
    return FileParameter(_name(name, where), _number(value, where), number, rounding=_rounding(value))


def _qgc(columns: list[str], number: int, where: str) -> FileParameter | int:
    """Vehicle, component, name, value, MAV_PARAM_TYPE."""
    try:
        component, kind = int(columns[1]), int(columns[4])
        int(columns[0])
    except ValueError:
        what = "Vehicle, component or type is no whole number."
        raise FormatError(what, where=where, advice="The columns are: vehicle, component, name, value, type.") from None
    if component != AUTOPILOT:
        return component
    if kind not in _KINDS:
        raise FormatError(f"There is no type {kind}.", where=where, advice="Types are 1 to 10; 9 is a fraction.")
    name, value = _name(columns[2].strip(), where), _number(columns[3].strip(), where)
    if kind in WHOLE_RANGES and not (value == round(value) and _in_range(value, kind)):
        low, high = WHOLE_RANGES[kind]
        raise FormatError(f"{columns[3]} is no whole number of {low} to {high}.", where=where, advice="Correct it.")
    return FileParameter(name, value, number, kind, 0.0 if kind in WHOLE_RANGES else _rounding(columns[3].strip()))


def _in_range(value: float, kind: int) -> bool:
    low, high = WHOLE_RANGES[kind]
    return low <= value <= high


def _name(text: str, where: str) -> str:
    if not re.fullmatch(NAME_PATTERN, text):
        raise FormatError(f"{text!r} is no parameter's name.", where=where, advice=NAME_RULE)
    return text


def _number(text: str, where: str) -> float:
    if re.fullmatch(r"0[xX][0-9a-fA-F]{1,16}", text):
        return float(int(text, 16))
    if not _DECIMAL.fullmatch(text):
        raise FormatError(f"{text!r} is no number.", where=where, advice="Write 12.5, with a point.")
    value = float(text)
    if not math.isfinite(value):
        raise FormatError(f"{text} is no finite number.", where=where, advice="Correct it, or remove the line.")
    return value


def _rounding(text: str) -> float:
    _, point, decimals = text.partition(".")
    if not point or not decimals.isdigit() or len(decimals) < _WRITTEN_EXACTLY_DIGITS:
        return 0.0
    return 0.5 * 10.0 ** -len(decimals)


def write_mission_planner(parameters: tuple[Parameter, ...], heading: str = "") -> str:
    """NAME,VALUE in the order of names, as Mission Planner writes them; MAVProxy reads it, too."""
    lines = [f"{p.name},{value_text(p.value, p.kind)}" for p in _numbers(parameters)]
    return "\n".join([*_comments(heading), *lines, ""])


def write_qgc(parameters: tuple[Parameter, ...], *, system_id: int, heading: str = "") -> str:
    """QGroundControl's five columns."""
    columns = "# Vehicle-Id\tComponent-Id\tName\tValue\tType"
    lines = [
        f"{system_id}\t{AUTOPILOT}\t{p.name}\t{value_text(p.value, p.kind)}\t{p.kind}" for p in _numbers(parameters)
    ]
    return "\n".join([*_comments(heading), columns, *lines, ""])


def _numbers(parameters: tuple[Parameter, ...]) -> list[Parameter]:
    return sorted((p for p in parameters if p.value is not None), key=lambda p: p.name)


def _comments(heading: str) -> list[str]:
    return [f"# {line}" for line in heading.splitlines()]


def value_text(value: float | None, kind: int | None = REAL32) -> str:
    """The shortest that is read back as the same number; whole numbers without a point."""
    if value is None:
        return "no number"
    if kind in WHOLE_RANGES or (value == round(value) and abs(value) < 2**24):
        return str(int(value))
    return _short(value)


def _short(value: float) -> str:
    if abs(value) > float(np.finfo(np.float32).max):
        return repr(value)
    single = np.float32(value)
    text = str(single) if math.isclose(float(single), value, rel_tol=SINGLE) else repr(value)
    return text.removesuffix(".0")
