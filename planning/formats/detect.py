"""Which mission format a file holds, told by its content."""

from __future__ import annotations

from planning.basics.plan_model import Mission
from planning.errors import FormatError
from planning.formats.kml_mission import read_kml_mission
from planning.formats.qgc_plan import read_plan
from planning.formats.safe_text import clean_name, decode_text
from planning.formats.wpl import read_wpl


def read_mission(name: str, data: bytes) -> Mission:
    """A `.waypoints`, `.txt` or `.plan` mission by any ground station: what a vehicle takes.

    ``name`` is only shown in messages. Raises FormatError: what is wrong, where in the file, what to do.
    """
    if is_kml(data):
        raise FormatError(
            "This is KML, not a mission that a vehicle takes.",
            where=clean_name(name),
            advice="`hedgehop certify` judges its line, `hedgehop plan` plans over its points.",
        )
    text = decode_text(name, data).lstrip()
    if text.startswith("{"):
        return read_plan(data, name)
    if text.upper().startswith("QGC WPL"):
        return read_wpl(data.lstrip(), name)
    raise FormatError(
        _guess(text), where=clean_name(name), advice="Choose a .waypoints (QGC WPL 110), .plan, .kml or .kmz mission."
    )


def read_flight(name: str, data: bytes) -> Mission:
    """Whatever describes a flight well enough to be judged: missions, and KML, KMZ or DJI's waylines."""
    return read_kml_mission(name, data) if is_kml(data) else read_mission(name, data)


def is_kml(data: bytes) -> bool:
    """Whether the bytes are a KMZ archive or XML."""
    return data.startswith(b"PK") or data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")


def _guess(text: str) -> str:
    if not text:
        return "The file is empty."
    first_line = text.splitlines()[0]
    return f"This is no mission: it starts with {clean_name(first_line)!r}."
