"""The track, points of interest and home as KML, and the reader of our own track."""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from mapping.geometry.arrays import F64
from mapping.version import __version__
from planning.basics.plan_model import Home, Mission, Poi, SampledPath
from planning.errors import FormatError
from planning.formats.commands import home_altitude_note
from planning.formats.kml_reader import Placemark, read_placemarks
from planning.formats.safe_text import check_loiter, clean_name, finite
from planning.terrain.dsm import Dsm
from planning.terrain.vertical_datum import is_amsl

_STYLES = """<Style id="track"><LineStyle><color>ffdc7a1e</color><width>3</width></LineStyle>\
<PolyStyle><color>40dc7a1e</color></PolyStyle></Style>"""


@dataclass(frozen=True, slots=True)
class KmlTrack:
    """What our own KML holds."""

    home: Home
    pois: tuple[Poi, ...]
    lat_lon_deg: F64
    """(N, 2) WGS84"""
    alt_rel_home_m: F64
    """(N,)"""
    altitude_mode: str
    """absolute or clampToGround"""


def write_kml(path: SampledPath, mission: Mission, dsm: Dsm, *, title: str = "Hedgehop") -> str:
    """KML text with the track, the POIs and home.

    KML knows only heights above sea level or ground; the track is `absolute` when the datum of ``dsm`` is
    above mean sea level, otherwise it lies on the ground and its heights stand in ExtendedData.
    """
    home, absolute = mission.home, is_amsl(dsm.vertical_datum)
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document>',
        f"<name>{escape(clean_name(title))}</name>",
        f"<description>{escape(_why(home, absolute))}</description>",
        _STYLES,
        _track(path, home, dsm, absolute),
        *(_poi(poi, number) for number, poi in enumerate(mission.pois, start=1)),
        _home(home, absolute),
        "</Document></kml>",
    ]
    return "\n".join(parts) + "\n"


def _why(home: Home, absolute: bool) -> str:
    head = f"Planned with Hedgehop {__version__}; {home_altitude_note(home)}."
    if absolute:
        return f"{head} Altitudes are above mean sea level."
    return (
        f"{head} The track lies on the ground because its altitudes are not known above mean sea level; "
        "see alt_rel_home_m."
    )


def _track(path: SampledPath, home: Home, dsm: Dsm, absolute: bool) -> str:
    lat_lon = dsm.lat_lon_from_xy(path.xy_m)
    if absolute:
        places = (f"{lon:.9f},{lat:.9f},{z:.3f}" for (lat, lon), z in zip(lat_lon, path.alt_dsm_m, strict=True))
    else:
        places = (f"{lon:.9f},{lat:.9f}" for lat, lon in lat_lon)
    heights = " ".join(f"{z:.3f}" for z in path.alt_dsm_m - home.alt_dsm_m)
    return (
        f"<Placemark><name>track</name><styleUrl>#track</styleUrl>{_extended({'alt_rel_home_m': heights})}"
        f"<LineString><extrude>{int(absolute)}</extrude><tessellate>1</tessellate>{_mode(absolute)}"
        f"<coordinates>{' '.join(places)}</coordinates></LineString></Placemark>"
    )


def _poi(poi: Poi, number: int) -> str:
    name = clean_name(poi.name) or f"POI {number}"
    data = _extended({"role": "poi", "name": clean_name(poi.name), "loiter_s": f"{poi.loiter_s:g}"})
    return _point(name, data, f"{poi.lon_deg:.9f},{poi.lat_deg:.9f}", absolute=False)


def _home(home: Home, absolute: bool) -> str:
    alt = f"{home.alt_dsm_m:.4f}" if math.isfinite(home.alt_dsm_m) else "unknown"
    datum = clean_name(home.vertical_datum or "unknown")
    data = _extended({"role": "home", "home_alt_dsm_m": alt, "vertical_datum": datum, "version": __version__})
    place = f"{home.lon_deg:.9f},{home.lat_deg:.9f}"
    with_height = absolute and math.isfinite(home.alt_dsm_m)
    return _point("home", data, f"{place},{alt}" if with_height else place, absolute=with_height)


def _point(name: str, data: str, place: str, *, absolute: bool) -> str:
    return (
        f"<Placemark><name>{escape(name)}</name>{data}"
        f"<Point>{_mode(absolute)}<coordinates>{place}</coordinates></Point></Placemark>"
    )


def _mode(absolute: bool) -> str:
    return f"<altitudeMode>{'absolute' if absolute else 'clampToGround'}</altitudeMode>"


def _extended(data: dict[str, str]) -> str:
    entries = "".join(f"<Data name={quoteattr(k)}><value>{escape(v)}</value></Data>" for k, v in data.items())
    return f"<ExtendedData>{entries}</ExtendedData>"


def read_kml_track(data: bytes, name: str = "trajectory.kml") -> KmlTrack:
    """The KML that `write_kml` wrote. Raises FormatError when track or home are missing."""
    file = clean_name(name)
    marks = read_placemarks(name, data)
    track = next((m for m in marks if m.kind == "LineString" and "alt_rel_home_m" in m.data), None)
    home = next((m for m in marks if m.data.get("role") == "home"), None)
    if track is None or home is None:
        raise FormatError("The KML has no Hedgehop track and home.", where=file, advice="Export it again.")
    heights = np.array([finite(z, "alt_rel_home_m", file) for z in track.data["alt_rel_home_m"].split()])
    if len(heights) != len(track.coordinates):
        raise FormatError(f"{len(heights)} heights for {len(track.coordinates)} places.", where=file)
    pois = tuple(poi_from_placemark(m, file) for m in marks if m.data.get("role") == "poi")
    lat_lon = np.array(track.coordinates)[:, :2]
    return KmlTrack(_home_from(home, file), pois, lat_lon, heights, track.altitude_mode)


def poi_from_placemark(mark: Placemark, where: str) -> Poi:
    """A point placemark as POI; our own ExtendedData gives name and loiter time."""
    lat, lon, _ = mark.coordinates[0]
    loiter_s = check_loiter(finite(mark.data.get("loiter_s", "0"), "loiter_s", where), where)
    return Poi(lat, lon, clean_name(mark.data.get("name", mark.name)), loiter_s)


def _home_from(mark: Placemark, file: str) -> Home:
    lat, lon, _ = mark.coordinates[0]
    alt, datum = mark.data.get("home_alt_dsm_m", "unknown"), mark.data.get("vertical_datum", "unknown")
    alt_m = math.nan if alt == "unknown" else finite(alt, "home_alt_dsm_m", file)
    return Home(lat, lon, alt_m, None if datum == "unknown" else clean_name(datum))
