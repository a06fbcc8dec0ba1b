"""Flying: the vehicle, the link to it, what may be done with it, and by whom.

What the bus carries (``telemetry.topics.messages``, ``telemetry.topics.vehicle``) goes to the pages as it is; it is not
written down a second time here.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from server.schemas.checklist_docs import ChecklistDoc
from server.schemas.parameter_docs import ParameterName, WrittenDoc
from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Strict
from telemetry.topics.onboard_lists import Rounded
from telemetry.topics.parameters import MOST_CHANGES

Source = Literal["live", "replay"]
Address = Annotated[str, Field(min_length=3, max_length=200)]


class FollowDoc(Strict):
    """Where the vehicle is against the plan and the surface model; null where it cannot be told."""

    s_m: float | None
    """Distance flown along the planned line, at the place nearest to the vehicle."""
    cross_track_m: float | None
    """Horizontal distance to the planned line; positive to the right of it."""
    height_error_m: float | None
    """Above the planned line."""
    height_above_dsm_m: float | None
    """Above the cell below."""
    distance_to_dsm_m: float | None
    """3-D, to the nearest cell as a solid column."""
    alt_rel_home_m: float | None
    """As placed on the surface model: the same reference as the profile's."""
    progress: float | None
    """Share of the planned line that is flown, 0 to 1."""
    time_left_s: float | None
    """To the landing, by the plan's prediction."""
    behind_plan_s: float | None
    """Later (positive) or earlier than the plan's prediction."""
    home_distance_m: float | None
    home_bearing_deg: float | None
    required_distance_m: float | None = None
    """What the plan on board requires of the flight."""
    least_distance_m: float | None = None
    """The smallest ``distance_to_dsm_m`` of this flight along its line so far."""


class TrackDoc(Strict):
    """The flown path so far, thinned; the page goes on with what ``vehicle`` messages bring.

    Where no position came for ``LOST_S``, a row without place or height parts it.
    """

    source: Source
    s_m: list[float | None]
    alt_rel_home_m: list[float | None]
    cross_track_m: list[float | None]
    t_s: list[float]
    """Since the first of them."""


class CheckRow(Strict):
    """One line of the check before the start."""

    code: Literal[
        "mission", "clearance", "home", "gnss", "rtl_height", "battery", "ready", "avoidance", "fence", "others"
    ]
    state: Literal["good", "accept", "bad", "unknown"]
    """accept: may be flown once the operator accepts it; bad and unknown: not at all."""
    text: str
    mend: str = ""


CHECK_FRESH_S = 120.0
"""Long enough to read the check and to hold the button; the vehicle must not have moved meanwhile."""


class PreflightDoc(Strict):
    """The check before the start, on what was read back and where the vehicle really stands."""

    ok: bool
    """May be started, given what was accepted."""
    rows: list[CheckRow]
    home_shift_m: float | None = None
    """Surface model at the vehicle's home minus at the planned home."""
    rereferenced: bool = False
    """Heights were moved by ``home_shift_m``, certified and uploaded again."""
    min_distance_m: float | None = None
    """Of the mission that was read back."""
    checked_utc: str = ""


class OnboardDoc(Strict):
    """The mission on the vehicle, as far as known."""

    state: Literal["unknown", "none", "verified"]
    digest: str | None = None
    plan_name: str = ""
    """Of the plan that was uploaded; empty for a foreign mission."""
    is_open_plan: bool = False
    """It is the plan that is open, at its present revision."""
    items: int = 0
    rounded: list[Rounded] = Field(default_factory=list)
    rounded_note: str = ""
    """One sentence: what the vehicle rounded."""
    taken_up: bool = False
    """In flight: it begins in the air, and is no mission to start from the ground."""
    floor_rel_home_m: float | None = None
    """Of its plan's fence; parameters of the vehicle keep it, no list."""
    ceiling_rel_home_m: float | None = None


class HeightChangeDoc(Strict):
    """A parameter that keeps a fence's floor or ceiling, or has the vehicle act on them."""

    name: ParameterName
    before: Annotated[float, Field(allow_inf_nan=False)]
    """On the vehicle now."""
    after: Annotated[float, Field(allow_inf_nan=False)]
    unit: Literal["m", ""]


class FenceHeightsDoc(Strict):
    """What would change on the vehicle so that it keeps the floor and ceiling of the plan on board."""

    changes: list[HeightChangeDoc]
    """None: it keeps them already."""
    notes: list[str]


class SetFenceHeights(Strict):
    """As they were shown: 409 where they are others by now."""

    changes: Annotated[list[HeightChangeDoc], Field(min_length=1, max_length=MOST_CHANGES)]


class FenceHeightsSet(Strict):
    written: list[WrittenDoc]
    took: bool
    """The vehicle holds all of them."""


class TakenUpDoc(Strict):
    """A plan that was taken up in flight: it is on board, verified and certified, and flown by ``resume``."""

    item: int
    """Of the plan, counted from 1: the first that is flown to after the way there."""
    way_m: float
    """Length of the way from where the vehicle holds to where the plan's line is joined."""
    seconds: float
    """Of that way."""
    left_out: int
    """Waypoints of the plan that lie before that and are not flown."""
    clearance_m: float
    required_m: float
    notes: list[str]
    battery: CheckRow
    others: CheckRow | None = None
    """Whether it meets another vehicle if it is resumed now; null where the station has no other."""


class FlyState(Strict):
    """What is on board, whether it may be flown, and what is being done about it."""

    onboard: OnboardDoc
    preflight: PreflightDoc | None = None
    checklist: ChecklistDoc | None = None
    """The crew's own, of the mission on board; null where none of a plan is."""
    resume_from_item: int | None = None
    """After a flight that broke off: where it can go on."""
    at_fence: str = ""
    """What the vehicle does when it crosses its fence, as read at the last check; empty: not known."""
    taken_up: TakenUpDoc | None = None
    """Until it is flown."""
    busy: str = ""
    """What is being done right now: "Uploading", "Checking the start" ..."""
    can_cancel: bool = False
    """It computes, for a plan that is taken up: that can be cancelled."""


class NodeDoc(Strict):
    name: str
    state: Literal["starting", "running", "silent", "restarting", "stopped"]
    restarts: int = 0
    text: str = ""


class RecordingDoc(Strict):
    id: str
    name: str
    kind: Literal["hedgehop", "tlog", "dataflash", "ulog"]
    started_utc: str
    duration_s: float | None
    bytes: int
    vehicle: str = ""
    plan_name: str = ""
    terrain_id: str | None = None
    """A surface model in the library that it was flown over."""
    fault: str = ""
    """Why it can only be opened in part, or not at all."""
    station: str = ""
    """The other one from which it was fetched; empty: it was recorded or brought in here."""


class VehicleLogDoc(Strict):
    """A log that lies on the vehicle."""

    number: int
    bytes: int
    begun_utc: str | None


class LogDownloadDoc(Strict):
    """A log that is being read, or was last."""

    number: int
    bytes: int
    read_bytes: int
    state: Literal["reading", "done", "failed", "cancelled"]
    recording_id: str | None = None
    """Once it is done: what it is in the library."""
    error: ErrorDoc | None = None


class VehicleLogsDoc(Strict):
    logs: list[VehicleLogDoc] | None
    """The newest first; null: this vehicle was not asked."""
    download: LogDownloadDoc | None


# Bodies of requests


class ConnectLink(Strict):
    """``as_way``: who has the adopted vehicle's number on it, and the same clock, is it. ``also``: further ways."""

    address: Address
    adopt: bool = True
    as_way: bool = False
    also: Annotated[list[Address], Field(max_length=7)] = Field(default_factory=list)


class DisconnectLink(Strict):
    address: Address


class AdoptVehicle(Strict):
    candidate: Annotated[str, Field(max_length=300)]


class SetVehicleSigning(Strict):
    enabled: bool


class UploadPlan(Strict):
    """Uploads the open plan, which must be at this revision."""

    revision: int


class TakeUpPlan(Strict):
    """Takes up the open plan, which must be at this revision, from where the vehicle is."""

    revision: int
    accept: list[Literal["battery"]] = Field(default_factory=list)
    """That it may not suffice for the reserve, or is not told."""


class StartFlight(Strict):
    way: Literal["auto", "guided"] = "auto"
    digest: str
    accept: list[Literal["gnss", "battery", "rtl_height", "avoidance", "fence", "others"]] = Field(default_factory=list)
    from_item: Annotated[int, Field(ge=1)] = 1


class ResumeFlight(Strict):
    """``accept``: what is said of the station's other vehicles, where a plan was taken up in flight."""

    accept: list[Literal["others"]] = Field(default_factory=list)


class OpenReview(Strict):
    recording_id: str
    terrain_id: str | None = None
    """Null: the one it was flown over."""
    use_open_plan: bool = False
    """Judge it against the plan that is open instead of the one in the recording."""


class PlayReview(Strict):
    playing: bool
    at_s: float | None = None
    """Since the recording's start."""
    speed: Annotated[float, Field(ge=0.1, le=50)] | None = None
