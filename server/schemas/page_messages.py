"""What a page says on the ``/ws`` stream."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from server.schemas.flight_docs import Source
from server.schemas.station_docs import FIRST_VEHICLE
from server.schemas.strict_model import Strict
from server.schemas.view_docs import SelectionDoc, ViewDoc

Change = Annotated[int, Field(ge=0, le=2**53 - 1)]
"""The page's own count of what it has changed for all; `AnsweredMessage` gives it back."""


class HoverProfile(Strict):
    """The pointer is over the altitude profile at this distance; null: it left."""

    type: Literal["hover_profile"] = "hover_profile"
    s_m: float | None


class HoverView(Strict):
    """The pointer is over the 3D view, in shares of its width and height from the top left."""

    type: Literal["hover_view"] = "hover_view"
    x: Annotated[float, Field(ge=0, le=1)] | None
    y: Annotated[float, Field(ge=0, le=1)] | None


class SetView(Strict):
    type: Literal["set_view"] = "set_view"
    view: ViewDoc
    change: Change


class SetSelection(Strict):
    type: Literal["set_selection"] = "set_selection"
    selection: SelectionDoc
    change: Change


class FrameView(Strict):
    """Move this page's camera: to the whole terrain, the plan, from above, the worst point, or behind a vehicle.

    "chase" follows the vehicle until another target is asked for.
    """

    type: Literal["frame_view"] = "frame_view"
    target: Literal["terrain", "plan", "top", "worst", "poi", "chase"]
    source: Source = "live"
    vehicle: Annotated[int, Field(ge=1)] = FIRST_VEHICLE
    """Of the source "live"."""


class HoldCamera(Strict):
    """A hand is on this page's camera: what follows a vehicle waits."""

    type: Literal["hold_camera"] = "hold_camera"
    held: bool


class ChooseVehicle(Strict):
    """This page shows and commands another vehicle; who is in charge of which one stays as it is."""

    type: Literal["choose_vehicle"] = "choose_vehicle"
    vehicle: int


class Ping(Strict):
    """Every second: the answer tells the page that the server works, how far away it is, and what its clock says."""

    type: Literal["ping"] = "ping"
    page_ms: Annotated[float, Field(ge=0, le=1e15)]


ClientMessage = Annotated[
    HoverProfile | HoverView | SetView | SetSelection | FrameView | HoldCamera | ChooseVehicle | Ping,
    Field(discriminator="type"),
]
