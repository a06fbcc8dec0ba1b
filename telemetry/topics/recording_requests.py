"""What may be asked of the nodes that record and replay flights. What they answer stands behind the arrow."""

from __future__ import annotations

from dataclasses import dataclass

# To the recorder node.


@dataclass(frozen=True, slots=True)
class StartRecording:
    """-> str, the file's name"""

    name: str = ""


@dataclass(frozen=True, slots=True)
class StopRecording:
    """-> None"""


RecorderRequest = StartRecording | StopRecording


# To the replay node.


@dataclass(frozen=True, slots=True)
class OpenRecording:
    """-> None; RecordingError"""

    path: str


@dataclass(frozen=True, slots=True)
class CloseRecording:
    """-> None"""


@dataclass(frozen=True, slots=True)
class Play:
    """Playing or not, from ``at_utc_s`` on if given, at ``speed`` times the recorded speed. -> None"""

    playing: bool
    at_utc_s: float | None = None
    speed: float | None = None


ReplayRequest = OpenRecording | CloseRecording | Play
