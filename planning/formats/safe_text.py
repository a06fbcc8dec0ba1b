"""The door every imported text passes: size, encoding, numbers, names and JSON, all distrusted."""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Sequence
from typing import NoReturn

from planning.errors import FormatError

MAX_BYTES = 20 * 1024 * 1024
MAX_ITEMS = 100_000
MAX_DEPTH = 64
MAX_NAME_LENGTH = 80

_BRACKETS_OUTSIDE_STRINGS = re.compile(r'"(?:[^"\\]|\\.)*+"?|[\[{]|[\]}]', re.DOTALL)
"""A string that is not closed ends with the text: its quotes are not tried again, each to the text's end."""


def decode_text(name: str, data: bytes | str) -> str:
    """Bytes of an imported file -> text: UTF-8 with or without byte order mark, otherwise Latin-1.

    Text that is text already passes as it is.

    Raises FormatError for too many bytes, UTF-16 and binary content.
    """
    where = clean_name(name)
    if len(data) > MAX_BYTES:
        raise FormatError(
            f"The file has {len(data)} bytes, more than the {MAX_BYTES} that are read.",
            where=where,
            advice="Split it into smaller files.",
        )
    if isinstance(data, str):
        return data.removeprefix("\ufeff")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FormatError("The text is encoded as UTF-16.", where=where, advice="Save it as UTF-8.")
    if b"\x00" in data:
        raise FormatError("The file is binary, not text.", where=where, advice="Choose a text file.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def clean_name(text: object) -> str:
    """A name from a file as harmless single-line text of at most 80 characters.

    Control, formatting (bidirectional overrides among them) and unassigned characters are dropped;
    markup is kept as text, whoever shows it escapes it.
    """
    kept = "".join(c if unicodedata.category(c)[0] != "C" else " " if c in "\t\n\r" else "" for c in str(text)[:4096])
    return " ".join(kept.split())[:MAX_NAME_LENGTH].rstrip()


def load_json(name: str, text: str) -> object:
    """Parse JSON without NaN, Infinity, duplicate surprises of depth or endless digits."""
    where = clean_name(name)
    _check_depth(where, text)
    try:
        return json.loads(text, parse_constant=lambda constant: _refuse_constant(where, constant))
    except json.JSONDecodeError as error:
        raise FormatError(
            f"This is not valid JSON: {error.msg} at line {error.lineno}, column {error.colno}.",
            where=where,
            advice="The file may be cut short: export it again.",
        ) from None
    except FormatError:
        raise
    except ValueError:
        raise FormatError("A number has too many digits.", where=where, advice="Export the file again.") from None


def _refuse_constant(where: str, constant: str) -> NoReturn:
    raise FormatError(f"{constant} is no JSON number.", where=where, advice="Write null for a missing value.")


def _check_depth(where: str, text: str) -> None:
    depth = 0
    for token in _BRACKETS_OUTSIDE_STRINGS.finditer(text):
        first = text[token.start()]
        depth += 1 if first in "[{" else -1 if first in "]}" else 0
        if depth > MAX_DEPTH:
            raise FormatError(f"The JSON is nested deeper than {MAX_DEPTH} levels.", where=where)


def finite(value: object, what: str, where: str, *, decimal_comma: bool = False) -> float:
    """One finite number from a text field or a JSON value; FormatError names the field and the value."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise FormatError(f"{what} should be a number, got {clean_name(value)!r}.", where=where)
    try:
        number = float(value.strip().replace(",", ".") if decimal_comma and isinstance(value, str) else value)
    except (ValueError, OverflowError):
        raise FormatError(
            f"{what} should be a number, got {clean_name(value)!r}.", where=where, advice="Correct the value."
        ) from None
    if not math.isfinite(number):
        raise FormatError(f"{what} should be finite, got {number}.", where=where, advice="Correct the value.")
    return number


def check_lat_lon(lat_deg: float, lon_deg: float, where: str) -> tuple[float, float]:
    """The same pair if it lies on Earth; the error suggests a swap where that would mend it."""
    if abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0:
        return lat_deg, lon_deg
    swapped = abs(lon_deg) <= 90.0 and abs(lat_deg) <= 180.0
    raise FormatError(
        f"Latitude {lat_deg:g}°, longitude {lon_deg:g}° is no place on Earth.",
        where=where,
        advice="Latitude and longitude look swapped: exchange them." if swapped else "Use degrees (WGS84).",
    )


def check_loiter(loiter_s: float, where: str) -> float:
    """The same time if it can be waited."""
    if loiter_s < 0:
        raise FormatError(f"The loiter time is negative: {loiter_s:g} s.", where=where, advice="Use 0 or more.")
    return loiter_s


def check_count(count: int, what: str, where: str) -> None:
    """Refuse more than ``MAX_ITEMS`` of anything."""
    if count > MAX_ITEMS:
        raise FormatError(f"The file holds more than {MAX_ITEMS} {what}.", where=where, advice="Split it.")


def said_once(warnings: Sequence[str]) -> tuple[str, ...]:
    """Each "place: sentence" once; of those with the same sentence the first place, and how many more there are."""
    places: dict[str, list[str]] = {}
    for warning in warnings:
        place, colon, sentence = warning.partition(": ")
        places.setdefault(sentence if colon else warning, []).append(place if colon else "")
    return tuple(
        f"{at[0]}{f' and {len(at) - 1} more' if len(at) > 1 else ''}: {sentence}" if at[0] else sentence
        for sentence, at in places.items()
    )
