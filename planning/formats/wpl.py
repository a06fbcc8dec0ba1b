"""QGC WPL 110, the `.waypoints` text of Mission Planner, MAVProxy and ArduPilot."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator

from mapping.version import __version__
from planning.basics.mav_cmd import FENCES, MavCmd, MavFrame
from planning.basics.plan_model import Home, Mission, MissionItem, PlannedFor
from planning.errors import FormatError
from planning.formats.commands import POSITIONED, home_altitude_note, home_or_first_place, millimetres_up, plain_frame
from planning.formats.other_surface import surface_digest
from planning.formats.planned_for import planned_for_line, read_planned_for
from planning.formats.safe_text import check_count, check_lat_lon, clean_name, decode_text, finite
from planning.formats.swapped import swapped_against_home

HEADER = "QGC WPL 110"
_NOTE = re.compile(r"#\s*([a-z_]+):\s*(.*)")


def write_wpl(mission: Mission, *, comments: bool = True) -> str:
    """A mission as WPL text: row 0 is home, then the items from sequence 1 on.

    Altitudes are rounded up to centimetres. ArduPilot reads a missing parameter as 0, so NaN becomes 0
    there and stays for PX4. ``comments=False`` leaves out the `#` lines with home altitude and datum,
    for readers that take none (QGroundControl; its own format is the `.plan`).
    """
    home = mission.home
    lat, lon, alt = (v if math.isfinite(v) else 0.0 for v in (home.lat_deg, home.lon_deg, home.alt_dsm_m))
    rows = [f"0\t1\t0\t16\t0\t0\t0\t0\t{lat:.9f}\t{lon:.9f}\t{alt:.2f}\t1"]
    rows += [_row(i, item, mission.firmware) for i, item in enumerate(mission.items, start=1)]
    return "\n".join([HEADER, *(_notes(mission) if comments else []), *rows]) + "\n"


def _notes(mission: Mission) -> list[str]:
    home = mission.home
    alt = f"{home.alt_dsm_m:.4f}" if math.isfinite(home.alt_dsm_m) else "unknown"
    speed = mission.cruise_speed_m_s
    return [
        f"# product: Hedgehop {__version__}",
        f"# home_alt_dsm_m: {alt}",
        f"# vertical_datum: {clean_name(home.vertical_datum or 'unknown')}",
        f"# firmware: {mission.firmware}",
        *([f"# cruise_speed_m_s: {speed:g}"] if speed is not None else []),
        *([f"# planned_for: {planned_for_line(planned)}"] if (planned := mission.planned_for) is not None else []),
        *([f"# surface_model: {mission.surface_sha256}"] if mission.surface_sha256 else []),
        *([f"# surface_name: {clean_name(mission.surface_name)}"] if mission.surface_name else []),
        f"# note: row 0 is home, {home_altitude_note(home)}",
    ]


def _row(index: int, item: MissionItem, firmware: str) -> str:
    missing = "0" if firmware == "ardupilot" else "NaN"
    params = "\t".join(f"{p:.10g}" if math.isfinite(p) else missing for p in item.params)
    place = f"{item.lat_deg:.9f}\t{item.lon_deg:.9f}\t{millimetres_up(item.alt_m):.3f}"
    return f"{index}\t0\t{item.frame}\t{item.command}\t{params}\t{place}\t{int(item.autocontinue)}"


def read_wpl(data: bytes | str, name: str = "mission.waypoints") -> Mission:
    """WPL text -> mission. Row 0 is home when it is a waypoint; comments, blank lines and CRLF are fine.

    The home altitude keeps the datum of our own comment lines; other tools write AMSL by convention but
    do not say which, so their datum is None.
    """
    lines = decode_text(name, data).splitlines()
    notes, home, items, warnings = _notes_of(lines), None, [], []
    for number, item in _rows(lines, clean_name(name)):
        if items or home or not _is_home(number, item):
            _refuse_fence(item, clean_name(name))
            items.append(item)
        else:
            home = _home(item, notes, warnings)
    home = home if home and (home.lat_deg or home.lon_deg) else None
    warnings += swapped_against_home(home, items)
    home = home_or_first_place(home, items, warnings)
    firmware = "px4" if notes.get("firmware") == "px4" else "ardupilot"
    planned = _planned_for(lines, warnings)
    return Mission(
        home,
        tuple(items),
        firmware,
        (),
        _speed(notes),
        tuple(warnings),
        planned,
        surface_digest(notes.get("surface_model")),
        clean_name(notes.get("surface_name", "")),
    )


def read_lists(data: bytes | str, name: str) -> tuple[tuple[MissionItem, ...], dict[str, str]]:
    """Rows of a fence or of rally points, without the home row that some programs write, and what comments say."""
    lines = decode_text(name, data).splitlines()
    rows = list(_rows(lines, clean_name(name)))
    first = 1 if rows and _is_home(*rows[0]) else 0
    return tuple(item for _, item in rows[first:]), _notes_of(lines)


def write_lists(items: Iterable[MissionItem], notes: Iterable[str] = ()) -> str:
    """Rows of a fence or of rally points as ground stations load them: from sequence 0 on, without home."""
    rows = [_row(index, item, "ardupilot") for index, item in enumerate(items)]
    return "\n".join([HEADER, f"# product: Hedgehop {__version__}", *notes, *rows]) + "\n"


def _rows(lines: list[str], file: str) -> Iterator[tuple[str, MissionItem]]:
    """Sequence number as written, and item, of each row. Raises FormatError for another header."""
    _check_header(file, lines[0] if lines else "")
    count = 0
    for number, line in enumerate(lines[1:], start=2):
        if line.strip() and not line.lstrip().startswith("#"):
            check_count(count, "mission items", file)
            count += 1
            yield line.split()[0], _item(line.split(), f"{file}, line {number}")


def _is_home(number: str, item: MissionItem) -> bool:
    return number == "0" and item.command == MavCmd.NAV_WAYPOINT


def _refuse_fence(item: MissionItem, file: str) -> None:
    if item.command in FENCES or item.command == MavCmd.NAV_RALLY_POINT:
        raise FormatError(
            "This is a fence or a list of rally points, not a mission.",
            where=file,
            advice="Give it with --fence, beside the mission.",
        )


def _check_header(where: str, line: str) -> None:
    header = line.split()
    if header == HEADER.split():
        return
    if header[:2] == ["QGC", "WPL"]:
        what = f"WPL version {clean_name(' '.join(header[2:]))!r} is not read, only 110."
        raise FormatError(what, where=where, advice="Export the mission again as QGC WPL 110 or .plan.")
    raise FormatError(
        f"The first line should be {HEADER!r}, got {clean_name(line)!r}.", where=where, advice="Choose a mission file."
    )


def _notes_of(lines: list[str]) -> dict[str, str]:
    found = (_NOTE.match(line.strip()) for line in lines if line.startswith("#"))
    return {match[1]: clean_name(match[2]) for match in found if match}


def _planned_for(lines: list[str], warnings: list[str]) -> PlannedFor | None:
    texts = (match[2] for line in lines if (match := _NOTE.match(line.strip())) and match[1] == "planned_for")
    text = next(texts, None)
    return None if text is None else read_planned_for(text, "comment planned_for", warnings)


def _item(fields: list[str], where: str) -> MissionItem:
    if len(fields) != 12:
        raise FormatError(
            f"A mission row has 12 fields, this one {len(fields)}.",
            where=where,
            advice="The file may be cut short: export it again.",
        )
    command, frame = _whole(fields[3], "The command", where), _whole(fields[2], "The frame", where)
    p1, p2, p3, p4 = (_param(field, f"Parameter {k}", where) for k, field in enumerate(fields[4:8], start=1))
    lat, lon, alt = (
        finite(f, what, where) for f, what in zip(fields[8:11], ("Latitude", "Longitude", "Altitude"), strict=True)
    )
    if command in POSITIONED:
        check_lat_lon(lat, lon, where)
    return MissionItem(command, plain_frame(frame), (p1, p2, p3, p4), lat, lon, alt, fields[11] not in ("0", "0.0"))


def _whole(field: str, what: str, where: str) -> int:
    value = finite(field, what, where)
    if value != int(value) or not 0 <= value <= 65535:
        raise FormatError(f"{what} should be a whole number up to 65535, got {clean_name(field)!r}.", where=where)
    return int(value)


def _param(field: str, what: str, where: str) -> float:
    return math.nan if field.lower() in ("nan", "-nan") else finite(field, what, where)


def _home(row: MissionItem, notes: dict[str, str], warnings: list[str]) -> Home:
    if "home_alt_dsm_m" in notes:
        text = notes["home_alt_dsm_m"]
        alt_m = math.nan if text == "unknown" else finite(text, "The home altitude", "comment home_alt_dsm_m")
        datum = notes.get("vertical_datum", "unknown")
        return Home(row.lat_deg, row.lon_deg, alt_m, None if datum == "unknown" else datum)
    if row.frame != MavFrame.GLOBAL:
        warnings.append(f"Row 0 was taken as home, as ground stations do, although its frame is {row.frame}.")
        return Home(row.lat_deg, row.lon_deg, math.nan)
    return Home(row.lat_deg, row.lon_deg, row.alt_m)


def _speed(notes: dict[str, str]) -> float | None:
    text = notes.get("cruise_speed_m_s")
    return None if text is None else finite(text, "The cruise speed", "comment cruise_speed_m_s")
