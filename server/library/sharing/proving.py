"""Whether what was brought is what it is said to be, before the library takes it in; and what is sent, before it is.

Hashes prove that nothing was damaged on the way; here a manifest from elsewhere may name no other thing and no path.
"""

from __future__ import annotations

from pathlib import Path

from planning.errors import DescribedError
from server.errors import DamagedError
from server.library.orthophotos import OrthophotoManifest, load_orthophoto
from server.library.plans import load_plan
from server.library.radar_files import RadarFileManifest
from server.library.sharing.local_items import LocalItem, is_closed
from server.library.sharing.shared_items import WORDS, Item, suffix_of
from server.library.shelf import read_manifest
from server.library.terrains import TerrainManifest, load_terrain


def prove(item: Item, folder: Path) -> None:
    """Raises DamagedError for what the library could not read, or what calls itself another thing."""
    if fault := _told(item, folder):
        what = f"This is no {WORDS[item.kind]} that can be used: {fault}."
        raise DamagedError(what, where=item.title, advice="Look at it on the machine that pushed it.")


def prove_own(local: LocalItem) -> None:
    """Before it is sent: a damaged thing that comes first would keep the whole one out. Raises DamagedError."""
    if fault := _told(local, local.files[0][1].parent):
        what = f"This is no {WORDS[local.kind]} that can be used: {fault}."
        advice = "Delete it here; a pull from a target that has it whole brings it again."
        raise DamagedError(what, where=local.title, advice=advice)


def _told(item: Item | LocalItem, folder: Path) -> str:
    """What is wrong with it; empty: nothing is."""
    try:
        return _fault(item, folder)
    except DescribedError as error:
        return error.what.rstrip(".")
    except Exception as error:  # what reads foreign files raises errors of any kind; none may stop the others
        return str(error).splitlines()[0][:200] if str(error).strip() else type(error).__name__


def _fault(item: Item | LocalItem, folder: Path) -> str:
    if item.kind == "terrain":
        load_terrain(folder)
        return _same(item, read_manifest(folder, TerrainManifest).doc.id)
    if item.kind == "orthophoto":
        load_orthophoto(folder)
        return _same(item, read_manifest(folder, OrthophotoManifest).doc.id)
    if item.kind == "radar":
        manifest = read_manifest(folder, RadarFileManifest)
        named = {manifest.samples, manifest.cfg, manifest.capture, manifest.tracks} - {""}
        lacking = sorted(named - item.file_names())
        if lacking or not manifest.samples:
            return f"its file {', '.join(lacking) or 'of samples'} is missing"
        return _same(item, manifest.doc.id)
    if item.kind == "plan":
        load_plan(folder)
        return ""
    (name,) = item.file_names()
    return "it has no end" if suffix_of(name) == ".mcap" and not is_closed(folder / name) else ""


def _same(item: Item | LocalItem, told: str) -> str:
    return "" if told == item.name else f"it calls itself {told[:40]!r}"
