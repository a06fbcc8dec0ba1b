"""A vehicle's own files about itself, as MAVLink's component metadata has them: where that of its parameters lies, and
whether a file is the one that was announced.

Only files on the vehicle are read (mftp://). Addresses on the internet are never followed.
"""

from __future__ import annotations

import re
import zlib
from typing import Any, cast

from planning.errors import FormatError
from planning.formats.safe_text import decode_text, load_json
from telemetry.parameters.described import unpacked

MOST_FILE_BYTES = 1 << 20
PARAMETERS = 1
"""COMP_METADATA_TYPE"""
_ALL_ONES = 0xFFFFFFFF
_MFTP = re.compile(r"mftp://(?:\[;comp=1\])?(/?[^?#\[\]]+)")
_GENERAL = "the vehicle's general.json"
ADVICE = "Give the makers' file with Units and help."


def path_of(uri: str) -> str:
    """On the autopilot. Raises FormatError for every other address."""
    if uri.startswith(("http://", "https://")):
        what = "The vehicle's description lies on the internet, where Hedgehop never looks for it."
        raise FormatError(what, where=uri[:120], advice=ADVICE)
    found = _MFTP.fullmatch(uri)
    if found is None or ".." in found[1].split("/"):
        raise FormatError("This is no address of a file on the vehicle.", where=uri[:120], advice=ADVICE)
    return f"/{found[1].lstrip('/')}"


def parameter_file(general: bytes) -> tuple[str, int | None]:
    """URI and CRC-32 of the file of parameters. Raises FormatError."""
    content = load_json(_GENERAL, decode_text(_GENERAL, unpacked(_GENERAL, general)))
    entries = cast(dict[str, Any], content).get("metadataTypes") if isinstance(content, dict) else None
    for entry in cast(list[Any], entries) if isinstance(entries, list) else ():
        if not isinstance(entry, dict) or cast(dict[str, Any], entry).get("type") != PARAMETERS:
            continue
        uri, crc = (cast(dict[str, Any], entry).get(key) for key in ("uri", "fileCrc"))
        if isinstance(uri, str):
            return uri, crc if isinstance(crc, int) else None
    raise FormatError("The vehicle describes no parameters.", where=_GENERAL, advice=ADVICE)


def check_crc(name: str, content: bytes, announced: int | None) -> None:
    """Raises FormatError. Firmware counts over the file as it lies there or as it is unpacked, as MAVLink's CRC-32
    begins (with 0) or as zip's; a file that was damaged on its way fits none of them."""
    forms = (content, unpacked(name, content))
    if announced is None or announced in {crc for form in forms for crc in (mavlink_crc32(form), zlib.crc32(form))}:
        return
    what = f"The file is not the one that the vehicle announced (CRC-32 {announced:08x})."
    raise FormatError(what, where=name, advice="Read the parameters again.")


def mavlink_crc32(content: bytes) -> int:
    """Begins with 0 and is not inverted at the end, as MAVLink FTP has it."""
    return zlib.crc32(content, _ALL_ONES) ^ _ALL_ONES
