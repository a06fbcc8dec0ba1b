"""Bags of ROS that are brought into Review: what is in them, and what is asked to be made of one."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from server.schemas.flight_docs import RecordingDoc
from server.schemas.strict_model import Asked, Latitude, Longitude, Strict

BagRole = Literal["points", "poses", "transforms", "fix", "other"]
FrameName = Annotated[str, Field(min_length=1, max_length=256)]


class BagTopicDoc(Strict):
    name: str
    type: str
    """As ROS 2 writes it."""
    role: BagRole
    messages: int
    """That can be read."""
    said: int
    """As the bag's own index counts them."""
    first_utc: str | None
    """When the first was recorded; null: there is none, or by a clock that does not tell the date."""
    span_s: float | None


class BagDoc(Strict):
    """An uploaded bag; it is kept until it is put away, newer ones come, or the server ends."""

    id: str
    name: str
    kind: Literal["ros1", "folder", "mcap", "db3"]
    bytes: int
    topics: list[BagTopicDoc]
    """What a recording can be made of first."""
    missing: list[str]
    """What it lacks, and what that means, a sentence each."""


class BagRecordingBody(Strict):
    """As the options of ``hedgehop bag``."""

    points: FrameName
    """Of PointCloud2, LaserScan, Range or Livox's CustomMsg."""
    pose: FrameName | None = None
    """Null: the only topic of poses, else the transforms."""
    frame: FrameName | None = None
    """The robot's; null: as its poses say, else base_link."""
    sensor: Literal["radar", "vision", "ranges"] = "radar"
    max_gap_s: Annotated[float, Field(gt=0, le=60, allow_inf_nan=False), Asked(min=0.01)] = 0.5
    home_lat_deg: Latitude | None = None
    home_lon_deg: Longitude | None = None
    """Of the first pose; null: by a NavSatFix of the bag."""
    home_alt_amsl_m: Annotated[float, Field(ge=-500, le=9000, allow_inf_nan=False)]
    """Of the first pose, above sea level."""


class BagRecordedDoc(Strict):
    recording: RecordingDoc
    notes: list[str]
    """What was assumed and left out, a sentence each."""
