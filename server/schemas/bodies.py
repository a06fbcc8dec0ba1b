"""Bodies of REST requests and their answers."""

from __future__ import annotations

from typing import Annotated

from pydantic import StringConstraints

from server.schemas.plan_docs import PlanDoc
from server.schemas.result_docs import PlanState
from server.schemas.strict_model import Name, Strict


class PlanEdit(Strict):
    base_revision: int
    label: Annotated[str, StringConstraints(max_length=60)]
    """For the undo button: "Move POI 3"."""
    document: PlanDoc
    coalesce: bool = False
    """Merge with the previous edit of the same label (a slider being dragged is one undo step)."""


class OpenPlan(Strict):
    plan_id: str


class SavePlanAs(Strict):
    name: Name


class SignIn(Strict):
    password: Annotated[str, StringConstraints(max_length=1024)]


class Imported(Strict):
    state: PlanState
    warnings: list[str]
