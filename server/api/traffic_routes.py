"""Other aircraft: which are shown, and of which the pilot is warned."""

from __future__ import annotations

from fastapi import APIRouter

from server.api.access import DONE, ERROR_RESPONSES, Fly, InCharge
from server.schemas import TrafficSettingsBody

router = APIRouter(prefix="/api/traffic", tags=["traffic"], responses=ERROR_RESPONSES)


@router.put("/settings", **DONE)
async def change_settings(body: TrafficSettingsBody, operator: InCharge, flying: Fly) -> None:
    """Distances, heights, the look-ahead, and the vehicle's own numbers; what is left out stays."""
    del operator
    await flying.traffic_settings.change_settings(body)
