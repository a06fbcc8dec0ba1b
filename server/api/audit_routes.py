"""The log of commands: its verdict and newest entries for everybody who is in, and all of it as a file."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from server.api.access import ERROR_RESPONSES, answer, parts_of
from server.schemas import AuditDoc

router = APIRouter(prefix="/api/audit", tags=["audit"], responses=ERROR_RESPONSES)


@router.get("", response_model=AuditDoc)
async def audit(request: Request) -> Response:
    """As it was last looked through."""
    return answer(await parts_of(request).audit.doc())


@router.post("/verify", response_model=AuditDoc)
async def verify(request: Request) -> Response:
    """Looks through it now."""
    watch = parts_of(request).audit
    await watch.verify()
    return answer(await watch.doc())


@router.get("/export", response_class=Response)
async def export(request: Request) -> Response:
    """The table of commands and the verdict of now, as a zip."""
    headers = {"content-disposition": 'attachment; filename="hedgehop-audit.zip"'}
    return Response(await parts_of(request).audit.export(), media_type="application/zip", headers=headers)
