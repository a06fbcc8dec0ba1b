"""Checklists: a text for each vehicle profile, and the ticks of the vehicle that a request is about."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import Response

from server.api.access import ERROR_RESPONSES, All, Fly, InCharge, Who, answer
from server.flying.checklists import KeptChecklist
from server.schemas import ChecklistText, FlyState, TickBody, WriteChecklist
from telemetry.topics.checklist import SUGGESTED

router = APIRouter(tags=["checklist"], responses=ERROR_RESPONSES)


@router.get("/api/checklist", response_model=ChecklistText)
async def read(fleet: All, profile: Annotated[str, Query(min_length=1, max_length=80)]) -> Response:
    """The text for a vehicle profile, by its name; empty where nobody has written any."""
    return answer(_text(profile, fleet.checklists.of(profile)))


@router.put("/api/checklist", response_model=ChecklistText)
async def write(body: WriteChecklist, who: Who, fleet: All) -> Response:
    """Replaces it; 409 when somebody else has changed it meanwhile. What is ticked of the old one is open again."""
    kept = await asyncio.to_thread(
        fleet.checklists.write, body.profile, body.text, instead_of=body.instead_of, by=who.name
    )
    for flying in fleet.flights:
        flying.desk.refresh()
    return answer(_text(body.profile, kept))


@router.put("/api/flight/checklist", response_model=FlyState, tags=["flight"])
async def tick(body: TickBody, operator: InCharge, flying: Fly) -> Response:
    """Ticks a point, or takes that back; 409 when the list, the vehicle or the mission is another one by now."""
    return answer(await flying.desk.tick(operator, body))


def _text(profile: str, kept: KeptChecklist) -> ChecklistText:
    return ChecklistText(
        profile=profile,
        text=kept.text,
        revision=kept.revision,
        before=kept.before,
        changed_by=kept.changed_by,
        changed_utc=kept.changed_utc,
        suggested=SUGGESTED,
    )
