"""What may be asked of the link, perception, recorder and replay nodes, and by whom. All are frozen dataclasses.

``Operator.token`` is the fencing token of the server's lease: the link node refuses every request that changes
anything on a vehicle when its token is lower than the highest one it has seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from telemetry.topics.messages import GuidedTarget, Item
from telemetry.topics.obstacles import AvoidBy


@dataclass(frozen=True, slots=True)
class Operator:
    name: str
    token: int


# To the link node. What it answers stands behind the arrow; errors come back as DescribedError.


@dataclass(frozen=True, slots=True)
class Connect:
    """Opens a connection and keeps it open. ``adopt``: take the first autopilot heard on it. -> None"""

    operator: Operator
    address: str
    adopt: bool = False


@dataclass(frozen=True, slots=True)
class Disconnect:
    """-> None"""

    operator: Operator
    address: str


@dataclass(frozen=True, slots=True)
class Adopt:
    """Takes a candidate as the one vehicle that is commanded. -> None"""

    operator: Operator
    candidate: str


@dataclass(frozen=True, slots=True)
class Release:
    """Nothing is sent to the vehicle any more. -> None"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class Upload:
    """Replaces the mission on board and reads it back. Refused while a mission is being flown. -> UploadReport"""

    operator: Operator
    items: tuple[Item, ...]
    """Without home."""
    home_lat_deg: float
    home_lon_deg: float
    home_alt_amsl_m: float


@dataclass(frozen=True, slots=True)
class Download:
    """-> OnboardMission"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class ReadParameters:
    """-> dict[str, float | None]; None for what the vehicle does not have"""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Arm:
    """-> None; RefusedError with the vehicle's words"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class Disarm:
    """Only on the ground. -> None"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class StartAuto:
    """Arms if need be and flies the mission on board from ``from_item`` on. Only if its digest is this. -> None

    ``from_item`` 1 is the first item. Above 1 (after a battery swap) the vehicle first takes off to ``climb_to_m``
    above home and goes straight to that item at that height.
    """

    operator: Operator
    digest: str
    from_item: int = 1
    climb_to_m: float | None = None


@dataclass(frozen=True, slots=True)
class StartGuided:
    """Takes off, hands over the targets one at a time, then returns home (Melita 2020). -> None"""

    operator: Operator
    targets: tuple[GuidedTarget, ...]
    takeoff_alt_rel_home_m: float
    waypoint_radius_m: float = 0.5
    end: Literal["rtl", "land"] = "rtl"


@dataclass(frozen=True, slots=True)
class Pause:
    """The vehicle holds its position. -> None"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class Resume:
    """Goes on with the paused mission or script. -> None"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class ReturnHome:
    """-> None"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class Land:
    """Here and now. -> None"""

    operator: Operator


@dataclass(frozen=True, slots=True)
class SetAvoidance:
    """Switches avoiding obstacles by itself on or off, and says how.

    ``consent``: of the operator, for a vehicle that is no simulation.

    -> None; NotAllowedError without consent, or for an autopilot for which it is not built
    """

    operator: Operator
    enabled: bool
    consent: bool = False
    by: AvoidBy = "climb"


@dataclass(frozen=True, slots=True)
class FlyManoeuvre:
    """Flies a prepared way over or around an obstacle in GUIDED, then goes on. -> None

    ``targets`` begin ahead of the vehicle and end on the mission ahead (or above it); ``rejoin_item`` is the item flown
    to after them, in GUIDED and ``height_offset_m`` higher than planned; None: hold at the last target.
    """

    operator: Operator
    kind: Literal["over", "around", "sidestep"]
    targets: tuple[GuidedTarget, ...]
    rejoin_item: int | None
    height_offset_m: float = 0.0


@dataclass(frozen=True, slots=True)
class FlyRest:
    """The rest of a flight that goes on higher, planned again past what was seen and certified, is flown instead.

    ``targets`` begin where the vehicle was when it was planned. -> None; NotAllowedError when it does not go on higher
    """

    operator: Operator
    targets: tuple[GuidedTarget, ...]


LinkRequest = (
    Connect
    | Disconnect
    | Adopt
    | Release
    | Upload
    | Download
    | ReadParameters
    | Arm
    | Disarm
    | StartAuto
    | StartGuided
    | Pause
    | Resume
    | ReturnHome
    | Land
    | SetAvoidance
    | FlyManoeuvre
    | FlyRest
)


# To a perception node: "radar", "vision" or "ranges".


@dataclass(frozen=True, slots=True)
class WholeMap:
    """Publishes the whole map once more, for those who came late. -> None"""


PerceptionRequest = WholeMap


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
