"""Points of interest as CSV, forgiving about header, order, separator and decimal comma."""

from __future__ import annotations

import csv

from planning.basics.plan_model import Poi
from planning.errors import FormatError
from planning.formats.safe_text import check_count, check_lat_lon, check_loiter, clean_name, decode_text, finite

COLUMNS = ("lat_deg", "lon_deg", "name", "loiter_s")
ALIASES = {
    "lat_deg": "lat_deg", "lat": "lat_deg", "latitude": "lat_deg", "latitude_deg": "lat_deg", "y": "lat_deg",
    "lon_deg": "lon_deg", "lon": "lon_deg", "lng": "lon_deg", "long": "lon_deg", "longitude": "lon_deg",
    "longitude_deg": "lon_deg", "x": "lon_deg",
    "name": "name", "label": "name", "title": "name",
    "loiter_s": "loiter_s", "loiter": "loiter_s", "hold": "loiter_s", "hold_s": "loiter_s",
}  # fmt: skip
_EXPECTED = "Use lat_deg,lon_deg[,name][,loiter_s]."


def read_pois_csv(name: str, data: bytes | str) -> tuple[Poi, ...]:
    """CSV text -> POIs. Raises FormatError with file and row number.

    The header is optional and may name the columns in any order; commas, semicolons or tabs separate;
    with the latter two a comma may be the decimal sign.
    """
    file = clean_name(name)
    lines = [
        (number, line)
        for number, line in enumerate(decode_text(name, data).splitlines(), start=1)
        if line.strip() and not line.startswith("#")
    ]
    check_count(len(lines), "rows", file)
    if not lines:
        raise FormatError("The file holds no rows.", where=file, advice=_EXPECTED)
    separator = _separator(lines[0][1])
    rows = [(number, _split(line, separator, f"{file}, row {number}")) for number, line in lines]
    columns, rows = _columns(rows, file)
    return tuple(_poi(fields, columns, separator != ",", f"{file}, row {number}") for number, fields in rows)


def _separator(line: str) -> str:
    return next((s for s in ("\t", ";") if s in line), ",")


def _split(line: str, separator: str, where: str) -> list[str]:
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=separator, strict=True))]
    except csv.Error as error:
        raise FormatError(f"The row cannot be split: {error}.", where=where, advice="Check its quotes.") from None


def _columns(rows: list[tuple[int, list[str]]], file: str) -> tuple[dict[str, int], list[tuple[int, list[str]]]]:
    """Column positions, and the rows without the header."""
    first = [field.lower() for field in rows[0][1]]
    known = {ALIASES[field]: k for k, field in reversed(list(enumerate(first))) if field in ALIASES}
    if not known:
        return {column: k for k, column in enumerate(COLUMNS)}, rows
    for column in ("lat_deg", "lon_deg"):
        if column not in known:
            raise FormatError(
                f"The header has no column {column}.", where=f"{file}, row {rows[0][0]}", advice=_EXPECTED
            )
    if len(rows) == 1:
        raise FormatError("There is a header but no rows.", where=file, advice=_EXPECTED)
    return known, rows[1:]


def _poi(fields: list[str], columns: dict[str, int], decimal_comma: bool, where: str) -> Poi:
    def field(column: str) -> str:
        k = columns.get(column, len(fields))
        return fields[k] if k < len(fields) else ""

    lat, lon = (finite(field(c), c, where, decimal_comma=decimal_comma) for c in ("lat_deg", "lon_deg"))
    loiter = field("loiter_s")
    loiter_s = finite(loiter, "loiter_s", where, decimal_comma=decimal_comma) if loiter else 0.0
    return Poi(*check_lat_lon(lat, lon, where), clean_name(field("name")), check_loiter(loiter_s, where))
