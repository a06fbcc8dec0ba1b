"""Vehicle profiles: those shipped with Hedgehop and the user's own TOML files, which win where names meet."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from planning.errors import PlanningError
from planning.vehicle_profile import load_profile, shipped_profiles
from server.documents import doc_from_profile
from server.errors import error_doc
from server.library.files import storage_errors
from server.schemas import ErrorDoc, ProfileEntry


def read_profiles(folder: Path) -> tuple[list[ProfileEntry], list[ErrorDoc]]:
    """All profiles by name, and why some of the user's files could not be read."""
    with storage_errors(folder):
        folder.mkdir(mode=0o700, exist_ok=True)
        own = sorted(path for path in folder.glob("*.toml") if path.is_file())
    found = {name: ProfileEntry(id=name, profile=doc_from_profile(load_profile(name))) for name in shipped_profiles()}
    faults: list[ErrorDoc] = []
    for path in own:
        try:
            found[path.stem] = ProfileEntry(id=path.stem, profile=doc_from_profile(load_profile(path)))
        except (PlanningError, ValidationError) as error:
            faults.append(error_doc(error))
    return [found[name] for name in sorted(found)], faults
