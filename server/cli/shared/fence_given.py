"""The fence and the rally points that a plan is held against: those of --fence, or of the mission's own file."""

from __future__ import annotations

from pathlib import Path

from planning.basics.plan_model import Mission
from planning.fence.fence_model import Fence, RallyPoint, fence_words
from planning.formats.fence_files import read_fence
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import say_notes


def fence_given(path: Path | None, mission: Mission | None) -> tuple[Fence, tuple[RallyPoint, ...]]:
    """``mission``: of the file with the points or the flight. Raises FormatError."""
    own = (Fence(), ()) if mission is None else (mission.fence, mission.rally)
    if path is None:
        if mission is not None and (mission.fence or mission.rally):
            say_notes(f"{fence_words(*own)} of the mission's own file.")
        return own
    found = read_fence(path.name, read_small(path))
    if own[0] or own[1]:
        say_notes("--fence is taken instead of the fence and the rally points in the mission's own file.")
    say_notes(*found.warnings)
    return found.fence, found.rally


def fence_stays(mission: Mission) -> str | None:
    """What is to be known of a mission whose file holds more than its items; None: it does not."""
    if not (mission.fence or mission.rally):
        return None
    return (
        "the file's fence and rally points are not sent with the mission: hedgehop fence and hedgehop rally send them."
    )
