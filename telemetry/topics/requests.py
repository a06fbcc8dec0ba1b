"""What may be asked of the link and of perception, and by whom. All are frozen dataclasses.

The link node refuses every request that changes anything on a vehicle when its operator's token is lower than the
highest one it has seen. What it answers stands behind the arrow; errors come back as DescribedError.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from telemetry.topics.fencing import Operator as Operator
from telemetry.topics.fencing import OperatorRequest
from telemetry.topics.fencing import highest_possible_token as highest_possible_token
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import AvoidBy
from telemetry.topics.onboard_lists import Item, PlaceList
from telemetry.topics.parameters import ParameterChange
from telemetry.topics.vehicle import HomePlace


@dataclass(frozen=True, slots=True)
class Connect(OperatorRequest):
    """Opens a connection and keeps it open. ``adopt``: take the first autopilot heard on it. -> None

    ``as_way``: whoever has the adopted vehicle's numbers on it and the same clock on board is that vehicle, reached
    another way.
    """

    address: str
    adopt: bool = False
    as_way: bool = False


@dataclass(frozen=True, slots=True)
class Disconnect(OperatorRequest):
    """-> None"""

    address: str


@dataclass(frozen=True, slots=True)
class Adopt(OperatorRequest):
    """Takes a candidate as the one vehicle that is commanded. -> None"""

    candidate: str


@dataclass(frozen=True, slots=True)
class Release(OperatorRequest):
    """Nothing is sent to the vehicle any more. -> None"""


@dataclass(frozen=True, slots=True)
class SetSigning(OperatorRequest):
    """Gives the vehicle a key over this link, on the ground, or takes it away again. -> None; SilentError"""

    enabled: bool


@dataclass(frozen=True, slots=True)
class Upload(OperatorRequest):
    """Replaces the mission on board and reads it back. Refused while a mission is being flown. -> UploadReport

    ``while_holding``: in flight as well, of a vehicle that holds still; ``TakeUp`` then makes it the one that is flown.
    """

    items: tuple[Item, ...]
    """Without home."""
    home_lat_deg: float
    home_lon_deg: float
    home_alt_amsl_m: float
    while_holding: bool = False


@dataclass(frozen=True, slots=True)
class Download(OperatorRequest):
    """-> OnboardMission"""


@dataclass(frozen=True, slots=True)
class UploadPlaces(OperatorRequest):
    """Replaces the fence or the rally points on board and reads them back; no items clear the list. Refused while a
    mission is being flown. -> UploadReport"""

    kind: PlaceList
    items: tuple[Item, ...]
    while_holding: bool = False
    """As of ``Upload``."""


@dataclass(frozen=True, slots=True)
class TakeUp(OperatorRequest):
    """Makes the mission on board, if its digest is this, the one that ``Resume`` flies, from its first item. -> None

    Refused unless the vehicle holds where the mission was certified to begin, as is ``Resume``; ``home``: a way's.
    """

    digest: str
    begins_lat_deg: float
    begins_lon_deg: float
    begins_alt_rel_home_m: float
    home: HomePlace | None = None


@dataclass(frozen=True, slots=True)
class DownloadPlaces(OperatorRequest):
    """-> tuple[Item, ...], of the fence or the rally points on board"""

    kind: PlaceList


@dataclass(frozen=True, slots=True)
class ReadParameters:
    """-> dict[str, float | None]; None for what the vehicle does not have"""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ListParameters:
    """-> ParameterList: all that the vehicle has; TransferError when some did not come"""


@dataclass(frozen=True, slots=True)
class ReadMetadata:
    """-> VehicleMetadata, without content where its CRC is among the known ones; RefusedError: the vehicle has none"""

    known_crcs: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class WriteParameters(OperatorRequest):
    """Writes one after the other and reads each back. -> tuple[ParameterWritten, ...], in their order

    At most ``MOST_CHANGES``, each name once. Refused while the vehicle is armed, or may be, unless ``even_armed``.
    """

    changes: tuple[ParameterChange, ...]
    even_armed: bool = False


@dataclass(frozen=True, slots=True)
class ListVehicleLogs(OperatorRequest):
    """-> tuple[VehicleLog, ...], the newest first. NotAllowedError while the vehicle is armed, or may be"""


@dataclass(frozen=True, slots=True)
class ReadVehicleLog(OperatorRequest):
    """-> bytes: so many from ``offset`` on, fewer only where the log ends. At most ``MOST_BYTES``, and ``offset`` a
    multiple of ``BLOCK_BYTES``. ``is_last``: nothing more is read then. NotAllowedError as for the list."""

    number: int
    offset: int
    size: int
    is_last: bool


@dataclass(frozen=True, slots=True)
class HighestToken:
    """Which one the link has seen: whoever issues them issues a higher one. -> int"""


@dataclass(frozen=True, slots=True)
class Arm(OperatorRequest):
    """-> None; RefusedError with the vehicle's words"""


@dataclass(frozen=True, slots=True)
class Disarm(OperatorRequest):
    """Only on the ground. -> None"""


@dataclass(frozen=True, slots=True)
class TickPoint(OperatorRequest):
    """Writes down that a point of the checklist was ticked, or no longer is; the vehicle is told nothing. -> None"""

    number: int
    """1 is the first point."""
    of: int
    text: str
    profile: str
    ticked: bool = True
    by: str = ""
    """Who looked, where that is not the operator."""


@dataclass(frozen=True, slots=True)
class NoteChecklist(OperatorRequest):
    """Writes down which text of a profile's checklist is ticked from here on, or that it was changed. -> None"""

    profile: str
    points: int
    digest: str
    """SHA-256 of the text."""
    written_by: str
    written_utc: str
    """ISO 8601"""
    changed: bool = False
    """Nobody has ticked it yet, and there need be no vehicle."""


@dataclass(frozen=True, slots=True)
class StartAuto(OperatorRequest):
    """Arms if need be and flies the mission on board from ``from_item`` on. Only if its digest is this. -> None

    ``from_item`` 1 is the first item. Above 1 (after a battery swap) the vehicle first takes off to ``climb_to_m``
    above home and goes straight to that item at that height.
    """

    digest: str
    from_item: int = 1
    climb_to_m: float | None = None


@dataclass(frozen=True, slots=True)
class StartGuided(OperatorRequest):
    """Takes off, hands over the targets one at a time, then returns home (Melita 2020) or holds there. -> None

    ``begins_lat_deg`` and ``begins_lon_deg``: where a certified take-off begins; it is refused where the vehicle stands
    elsewhere. None: a check has looked at where it stands. ``spare_m``: of certified clearance beyond what is required,
    by which home's height may change under it; None: not known.
    """

    targets: tuple[GuidedTarget, ...]
    takeoff_alt_rel_home_m: float
    waypoint_radius_m: float = 0.5
    end: Literal["rtl", "land", "hold"] = "rtl"
    begins_lat_deg: float | None = None
    begins_lon_deg: float | None = None
    spare_m: float | None = None


@dataclass(frozen=True, slots=True)
class FlyWay(OperatorRequest):
    """Flies a certified way in GUIDED, from where the vehicle hovers; then it holds there or lands. -> None

    ``targets`` are no items of a mission: each is item 0. Refused when the vehicle moves, or is not where the way
    begins. ``most_m_s``: for no higher speed is it certified. ``spare_m`` as for ``StartGuided``. ``home``: from which
    its heights count, as it was certified; refused where the vehicle tells another one, or none. None: not known.
    """

    targets: tuple[GuidedTarget, ...]
    begins_lat_deg: float
    begins_lon_deg: float
    begins_alt_rel_home_m: float
    most_m_s: float
    waypoint_radius_m: float = 0.5
    end: Literal["land", "hold"] = "hold"
    spare_m: float | None = None
    home: HomePlace | None = None


@dataclass(frozen=True, slots=True)
class SetSpeed(OperatorRequest):
    """On the rest of the way that is flown in GUIDED, up to the speed for which it is certified. -> None"""

    speed_m_s: float


@dataclass(frozen=True, slots=True)
class StopMotors(OperatorRequest):
    """At once, also in the air: the vehicle falls. -> None"""


@dataclass(frozen=True, slots=True)
class Pause(OperatorRequest):
    """The vehicle holds its position. -> None"""


@dataclass(frozen=True, slots=True)
class Resume(OperatorRequest):
    """Goes on with the paused mission or script. -> None"""


@dataclass(frozen=True, slots=True)
class ReturnHome(OperatorRequest):
    """-> None"""


@dataclass(frozen=True, slots=True)
class Land(OperatorRequest):
    """Here and now. -> None"""


@dataclass(frozen=True, slots=True)
class SetHome(OperatorRequest):
    """Where the vehicle returns to and its heights begin. -> None, once the vehicle tells that home; SilentError

    In the air only where it holds; on the ground only where it stands.
    """

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    """By the vehicle's own heights above the sea."""


@dataclass(frozen=True, slots=True)
class SetAvoidance(OperatorRequest):
    """Switches avoiding obstacles by itself on or off, and says how.

    ``consent``: of the operator, for a vehicle that is no simulation.

    -> None; NotAllowedError without consent, or for an autopilot for which it is not built
    """

    enabled: bool
    consent: bool = False
    by: AvoidBy = "climb"


@dataclass(frozen=True, slots=True)
class FlyManoeuvre(OperatorRequest):
    """Flies a prepared way over or around an obstacle in GUIDED, then goes on. -> None

    ``targets`` begin ahead of the vehicle and end on the mission ahead (or above it); ``rejoin_item`` is the item flown
    to after them, in GUIDED and ``height_offset_m`` higher than planned; None: hold at the last target.
    """

    kind: Literal["over", "around", "sidestep"]
    targets: tuple[GuidedTarget, ...]
    rejoin_item: int | None
    height_offset_m: float = 0.0


@dataclass(frozen=True, slots=True)
class MayFlyManoeuvre:
    """Whether a FlyManoeuvre like this would be refused now, by the same rule; nothing moves.

    -> str: why it would be; empty if it would not
    """

    kind: Literal["over", "around", "sidestep"]
    targets: tuple[GuidedTarget, ...]
    rejoin_item: int | None
    height_offset_m: float = 0.0


@dataclass(frozen=True, slots=True)
class FlyRest(OperatorRequest):
    """The rest of a flight that goes on higher, planned again past what was seen and certified, is flown instead.

    ``targets`` begin where the vehicle was when it was planned. -> None; NotAllowedError when it does not go on higher
    """

    targets: tuple[GuidedTarget, ...]


Looks = ReadParameters | ListParameters | ReadMetadata | HighestToken | MayFlyManoeuvre
"""Requests to the link that change nothing: anybody may ask them."""
LinkRequest = (
    Connect
    | Disconnect
    | Adopt
    | Release
    | SetSigning
    | Upload
    | Download
    | UploadPlaces
    | TakeUp
    | DownloadPlaces
    | ReadParameters
    | ListParameters
    | ReadMetadata
    | WriteParameters
    | ListVehicleLogs
    | ReadVehicleLog
    | HighestToken
    | Arm
    | Disarm
    | TickPoint
    | NoteChecklist
    | StartAuto
    | StartGuided
    | FlyWay
    | SetSpeed
    | StopMotors
    | Pause
    | Resume
    | ReturnHome
    | Land
    | SetHome
    | SetAvoidance
    | FlyManoeuvre
    | MayFlyManoeuvre
    | FlyRest
)


# To a perception node: "radar", "vision" or "ranges".


@dataclass(frozen=True, slots=True)
class WholeMap:
    """Publishes the whole map once more, for those who came late. -> None"""


PerceptionRequest = WholeMap
