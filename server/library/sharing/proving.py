"""Whether what was brought is what it is said to be, before the library takes it in.

Hashes prove that nothing was damaged on the way; here a manifest from elsewhere may name no other thing and no path.
"""

from __future__ import annotations

from pathlib import Path

from planning.errors import DescribedError
from server.errors import DamagedError
from server.library.orthophotos import OrthophotoManifest, load_orthophoto
from server.library.plans import load_plan
from server.library.radar_files import RadarFileManifest
from server.library.sharing.local_items import is_closed
from server.library.sharing.shared_items import WORDS, Item, suffix_of
from server.library.shelf import read_manifest
from server.library.terrains import TerrainManifest, load_terrain


def prove(item: Item, folder: Path) -> None:
    """Raises DamagedError for what the library could not read, or what calls itself another thing."""
    try:
        fault = _fault(item, folder)
    except DescribedError as error:
        fault = error.what.rstrip(".")
    except (ValueError, RuntimeError, KeyError, TypeError, RecursionError) as error:
        fault = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
    if fault:
        what = f"This is no {WORDS[item.kind]} that can be used: {fault}."
        raise DamagedError(what, where=item.title, advice="Look at it on the machine that pushed it.")


def _fault(item: Item, folder: Path) -> str:
    if item.kind == "terrain":
        load_terrain(folder)
        return _same(item, read_manifest(folder, TerrainManifest).doc.id)
    if item.kind == "orthophoto":
        load_orthophoto(folder)
        return _same(item, read_manifest(folder, OrthophotoManifest).doc.id)
    if item.kind == "radar":
        manifest = read_manifest(folder, RadarFileManifest)
        named = {manifest.samples, manifest.cfg, manifest.capture, manifest.tracks} - {""}
        lacking = sorted(named - {entry.name for entry in item.files})
        if lacking or not manifest.samples:
            return f"its file {', '.join(lacking) or 'of samples'} is missing"
        return _same(item, manifest.doc.id)
    if item.kind == "plan":
        load_plan(folder)
        return ""
    name = item.files[0].name
    if suffix_of(name) == ".mcap" and not is_closed(folder / name):
        return "it has no end"
    return ""


def _same(item: Item, told: str) -> str:
    return "" if told == item.name else f"it calls itself {told[:40]!r}"
