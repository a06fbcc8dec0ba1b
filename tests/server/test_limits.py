"""A number that an operator sets has one limit and one default: the console, the API and the command line share it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import get_args

import pytest
import typer
import typer.main
from pydantic import BaseModel, ValidationError
from typer.core import TyperGroup

from planning.errors import ParameterError
from planning.planner.request import PlanRequest, check_request
from server.cli import app
from server.library.documents import request_from_doc
from server.schemas import plan_docs, study_docs, traversability_docs
from server.schemas.obstacle_docs import SectionAsked
from server.schemas.plan_docs import ClearanceDoc, MissionDoc, PathDoc, PlanDoc, ProfileDoc, SurfaceDoc, SurveyDoc
from server.schemas.strict_model import Asked
from server.schemas.traversability_docs import LandingSitesBody
from tests.conftest import ROOT

WEB = ROOT / "web" / "src"
OF_OTHER_NUMBERS = {"review/Transport.tsx", "studies/RadarCentre.tsx", "ui/fields.tsx", "messages.ts"}
"""Sliders through what is there: a flight's time, a file's frames."""


def models() -> list[type[BaseModel]]:
    modules = (plan_docs, study_docs, traversability_docs)
    found = [m for module in modules for m in vars(module).values() if isinstance(m, type) and issubclass(m, BaseModel)]
    return [*found, SectionAsked]


def asked() -> Iterator[tuple[type[BaseModel], str, float]]:
    """Every end and every first number that the console offers."""
    for model in models():
        for name, field in model.model_fields.items():
            inner = [note for part in get_args(field.annotation) for note in getattr(part, "__metadata__", ())]
            for note in (*field.metadata, *inner):
                if isinstance(note, Asked):
                    for value in (note.min, note.max, note.initial):
                        if value is not None:
                            yield model, name, value


def refused_fields(model: type[BaseModel], values: dict[str, float]) -> set[object]:
    try:
        model.model_validate(values)
    except ValidationError as error:
        return {fault["loc"][0] for fault in error.errors()}
    return set()


def refusal(request: PlanRequest) -> str:
    try:
        check_request(request)
    except ParameterError as error:
        return error.what
    return ""


ASKED = list(dict.fromkeys(asked()))


@pytest.mark.parametrize(("model", "name", "value"), ASKED, ids=lambda v: getattr(v, "__name__", str(v)))
def test_the_server_takes_what_the_console_asks_for(model: type[BaseModel], name: str, value: float) -> None:
    assert name not in refused_fields(model, {name: value})


PLAN = {"profile": ProfileDoc, "surface": SurfaceDoc, "path": PathDoc, "mission": MissionDoc, "clearance": ClearanceDoc}


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [(part, name, value) for part, of in PLAN.items() for model, name, value in ASKED if model is of],
)
def test_planning_takes_what_the_console_asks_for(part: str, name: str, value: float) -> None:
    """But for speeds and steps that others contradict."""
    base = PlanDoc()
    changed = getattr(base, part).model_copy(update={name: value})
    request = request_from_doc(base.model_copy(update={part: changed}), dsm=None)  # type: ignore[arg-type]
    assert re.search("^$|contradict each other|larger than radius R", refusal(request))


@pytest.mark.parametrize(
    ("command", "docs"),
    [
        ("plan", (SurfaceDoc, PathDoc, MissionDoc)),
        ("survey", (SurveyDoc, PathDoc, MissionDoc)),
        ("traversability", (LandingSitesBody,)),
    ],
)
def test_the_command_line_has_the_documents_defaults(command: str, docs: tuple[type[BaseModel], ...]) -> None:
    group = typer.main.get_command(app)
    assert isinstance(group, TyperGroup)
    found = group.get_command(typer.Context(group), command)
    assert found is not None
    options = {option.name: option.default for option in found.params if option.default is not None}
    fields = {name: field for doc in docs for name, field in doc.model_fields.items()}
    shared = {name for name in options if name in fields and fields[name].default is not None}
    assert shared
    assert {name: options[name] for name in shared} == {name: fields[name].default for name in shared}


def test_the_console_has_no_limits_of_its_own() -> None:
    own = {
        page.name: found
        for page in WEB.rglob("*.ts*")
        if page.relative_to(WEB).as_posix() not in OF_OTHER_NUMBERS
        and (found := re.findall(r"\b(?:min|max|initial)(?:=\{|: )-?\d[^\n]*", page.read_text(encoding="utf-8")))
    }
    assert own == {}, "take them from LIMITS: server/schemas says what may be asked for"
