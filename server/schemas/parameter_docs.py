"""A vehicle's parameters: what it holds, what its makers say of them, what they do on the plan, how writing went."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from server.schemas.strict_model import Strict
from telemetry.topics.parameters import MOST_CHANGES, NAME_PATTERN

ParameterName = Annotated[str, StringConstraints(pattern=rf"^{NAME_PATTERN}$")]


class ParameterDoc(Strict):
    name: str
    value: float | None
    """Null: what the vehicle sent is no number."""
    text: str
    """The value as it is written."""
    whole: bool
    title: str = ""
    help: str = ""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    default: float | None = None
    meaning: str = ""
    """Of this value."""
    reboot: bool = False
    changed: bool = False
    """It differs from the default, as far as that is known."""


class FindingDoc(Strict):
    """What one setting will do on a low flight."""

    state: Literal["bad", "look", "good"]
    parameter: str
    text: str
    value: float | None
    better: float | None
    better_text: str = ""


class ParametersDoc(Strict):
    vehicle: str
    read_utc_s: float
    described: bool
    """The makers' descriptions are known."""
    parameters: list[ParameterDoc]
    findings: list[FindingDoc]
    """Worst first."""
    plan_name: str
    """Of the mission on board that they are about; empty: they are about any low flight."""
    not_judged: str = ""
    """Why there are no findings."""


class ParameterChangeDoc(Strict):
    name: ParameterName
    value: Annotated[float, Field(allow_inf_nan=False)]


class WriteParametersBody(Strict):
    changes: Annotated[list[ParameterChangeDoc], Field(min_length=1, max_length=MOST_CHANGES)]


class WrittenDoc(Strict):
    name: str
    asked: float
    before: float | None
    after: float | None
    outcome: Literal["set", "same", "adjusted", "kept", "refused", "unknown", "not sent"]
    took: bool
    words: str


class WrittenAnswer(Strict):
    written: list[WrittenDoc]
    now: ParametersDoc


class DifferenceDoc(Strict):
    name: str
    here: float | None
    """On the vehicle; null: it lists no such parameter."""
    there: float | None
    """In the file, or on the other vehicle; null: it is not in there."""
    own: bool = False
    """Of one vehicle alone, such as its calibrations: not to be taken from another."""


class ComparedDoc(Strict):
    file: str
    """Its name, or what people call the other vehicle."""
    is_vehicle: bool = False
    same: int
    differences: list[DifferenceDoc]
    notes: list[str]
