"""KML and KMZ by any program: placemarks, read without entities, external content or bombs."""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import iterparse

from planning.errors import FormatError
from planning.formats.safe_text import MAX_BYTES, MAX_DEPTH, check_count, check_lat_lon, clean_name, decode_text, finite

MAX_KMZ_ENTRIES = 1000
_UNPACKED_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_BROKEN_ARCHIVE = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, OSError, EOFError)
Coordinates = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Placemark:
    """One placemark: its first geometry and its untyped data."""

    name: str
    kind: str
    """Point, LineString or Polygon (the outer ring)."""
    coordinates: Coordinates
    """(lat_deg, lon_deg, altitude as written or NaN)"""
    data: dict[str, str] = field(default_factory=dict)
    altitude_mode: str = "clampToGround"


def read_placemarks(name: str, data: bytes) -> tuple[Placemark, ...]:
    """KML text or a KMZ archive -> its placemarks in document order, those without geometry left out.

    Raises FormatError for document type declarations, too deep or broken XML, bad coordinates.
    """
    file = clean_name(name)
    marks = [e for e in read_xml(name, data).iter() if tag(e) == "Placemark"]
    check_count(len(marks), "placemarks", file)
    found = (_placemark(mark, f"{file}, placemark {k}") for k, mark in enumerate(marks, start=1))
    return tuple(mark for mark in found if mark is not None)


def read_xml(name: str, data: bytes, *, prefer: str = ".kml") -> Element:
    """The root of KML text, or of the KML inside a KMZ: the first entry that ends in ``prefer``, or in .kml.

    Raises FormatError for document type declarations, too deep or broken XML and broken archives.
    """
    file = clean_name(name)
    return _parse(file, decode_text(name, _unpacked(file, data, prefer) if data.startswith(b"PK") else data))


def _unpacked(file: str, data: bytes, prefer: str) -> bytes:
    """The KML inside a KMZ; the unpacked size is limited while reading, headers are not believed."""
    advice = "Unpack it and choose the .kml inside."
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()[:MAX_KMZ_ENTRIES]
            found = (e for end in (prefer, ".kml") for e in entries if e.filename.lower().endswith(end))
            inner = next(found, None)
            if inner is None or inner.flag_bits & 1 or inner.compress_type not in _UNPACKED_METHODS:
                raise FormatError("The archive holds no readable .kml.", where=file, advice=advice)
            with archive.open(inner) as stream:
                text = stream.read(MAX_BYTES + 1)
    except _BROKEN_ARCHIVE:
        raise FormatError("The KMZ archive is corrupt or cut short.", where=file, advice=advice) from None
    if len(text) > MAX_BYTES:
        raise FormatError(f"The KML inside unpacks to more than {MAX_BYTES} bytes.", where=file, advice="Split it.")
    return text


def _parse(file: str, text: str) -> Element:
    depth, root = 0, None
    try:
        # The declaration may name another encoding than the one already decoded.
        body = text.partition("?>")[2] if text.lstrip().startswith("<?xml") else text
        for event, element in iterparse(io.BytesIO(body.strip().encode()), events=("start", "end"), forbid_dtd=True):
            root = element if root is None else root
            depth += 1 if event == "start" else -1
            if depth > MAX_DEPTH:
                raise FormatError(f"The XML is nested deeper than {MAX_DEPTH} levels.", where=file)
    except DefusedXmlException:
        raise FormatError(
            "The XML declares a document type or entities.", where=file, advice="Remove the DOCTYPE: it is not read."
        ) from None
    except (ParseError, UnicodeError) as error:
        raise FormatError(f"This is not valid XML: {error}.", where=file, advice="The file may be cut short.") from None
    if root is None:
        raise FormatError("The file is empty.", where=file, advice="Choose a KML file.")
    return root


def tag(element: Element) -> str:
    """Without its namespace."""
    return str(element.tag).rpartition("}")[2]


def first(element: Element, *tags: str) -> Element | None:
    """The first of these at any depth."""
    return next((e for e in element.iter() if tag(e) in tags), None)


def text_of(element: Element | None) -> str:
    """Empty where there is no element."""
    return (element.text or "") if element is not None else ""


def _placemark(mark: Element, where: str) -> Placemark | None:
    geometry = first(mark, "Point", "LineString", "Polygon")
    if geometry is None:
        return None
    shape = first(geometry, "outerBoundaryIs") if tag(geometry) == "Polygon" else geometry
    coordinates = _coordinates(text_of(first(geometry if shape is None else shape, "coordinates")), where)
    if not coordinates:
        raise FormatError("The placemark's coordinates are empty.", where=where)
    own_name = next((e for e in mark if tag(e) == "name"), None)
    mode = text_of(first(geometry, "altitudeMode")).strip() or "clampToGround"
    return Placemark(clean_name(text_of(own_name)), tag(geometry), coordinates, _data(mark), mode)


def _coordinates(text: str, where: str) -> Coordinates:
    tuples = text.split()
    check_count(len(tuples), "coordinates in one placemark", where)
    return tuple(_coordinate(t, f"{where}, coordinate {k}") for k, t in enumerate(tuples, start=1))


def _coordinate(text: str, where: str) -> tuple[float, float, float]:
    parts = text.split(",")
    if not 2 <= len(parts) <= 3:
        raise FormatError(f"A KML coordinate is lon,lat[,alt], got {clean_name(text)!r}.", where=where)
    lon, lat = finite(parts[0], "Longitude", where), finite(parts[1], "Latitude", where)
    alt = finite(parts[2], "Altitude", where) if len(parts) == 3 and parts[2] else math.nan
    return (*check_lat_lon(lat, lon, where), alt)


def _data(mark: Element) -> dict[str, str]:
    entries = (e for e in mark.iter() if tag(e) == "Data")
    return {clean_name(e.get("name", "")): text_of(first(e, "value")).strip() for e in entries}
