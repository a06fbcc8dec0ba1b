"""Which mission format a file holds, told by its content."""

from __future__ import annotations

from planning.errors import FormatError
from planning.formats.qgc_plan import read_plan
from planning.formats.safe_text import clean_name, decode_text
from planning.formats.wpl import read_wpl
from planning.model import Mission


def read_mission(name: str, data: bytes) -> Mission:
    """A `.waypoints`, `.txt` or `.plan` mission by any ground station.

    ``name`` is only shown in messages. Raises FormatError: what is wrong, where in the file, what to do.
    """
    text = decode_text(name, data).lstrip()
    if text.startswith("{"):
        return read_plan(data, name)
    if text.upper().startswith("QGC WPL"):
        return read_wpl(data.lstrip(), name)
    raise FormatError(
        _guess(text), where=clean_name(name), advice="Choose a .waypoints (QGC WPL 110) or .plan mission."
    )


def _guess(text: str) -> str:
    if not text:
        return "The file is empty."
    if text.startswith("<"):
        return "This is XML, not a mission; KML files can be read as points of interest."
    first_line = text.splitlines()[0]
    return f"This is no mission: it starts with {clean_name(first_line)!r}."
