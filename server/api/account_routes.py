"""Accounts and sessions: who may sign in, who is in, and who has to go."""

from __future__ import annotations

import asyncio
import time

from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import TypeAdapter

from server.api.access import DONE, ERROR_RESPONSES, Need, Who, answer, needs, parts_of
from server.api.sessions_ended import close_ended, end_sessions
from server.door.accounts import INVITED_S
from server.errors import ConflictError, NotFoundError
from server.schemas import AccountDoc, ChangePassword, InvitationDoc, NewAccount, SessionDoc

router = APIRouter(prefix="/api", tags=["accounts"], responses=ERROR_RESPONSES)

_ID_LENGTH = 16
_ACCOUNTS, _SESSIONS = TypeAdapter(list[AccountDoc]), TypeAdapter(list[SessionDoc])


@router.get("/accounts", response_model=list[AccountDoc])
@needs(Need.OPERATOR)
async def accounts(request: Request) -> Response:
    known = parts_of(request).auth.accounts
    found = [
        AccountDoc(
            name=account.name,
            role=account.role,
            has_password=bool(account.password),
            invited_until_utc_s=known.invited_until_utc_s(account.name),
        )
        for account in known.all
    ]
    return Response(_ACCOUNTS.dump_json(found), media_type="application/json")


@router.post("/accounts", response_model=InvitationDoc, status_code=201)
async def add(body: NewAccount, request: Request) -> Response:
    """Makes an account, and the one-time link by which whoever it is for comes in."""
    account = await asyncio.to_thread(parts_of(request).auth.accounts.add, body.name, body.role)
    return await _invited(request, account.name, 201)


@router.post("/accounts/{name}/invitation", response_model=InvitationDoc)
async def invite(name: str, request: Request) -> Response:
    """A further one-time link."""
    return await _invited(request, name, 200)


@router.delete("/accounts/{name}", **DONE)
async def remove(name: str, request: Request) -> None:
    """Its sessions end at once."""
    parts = parts_of(request)
    await asyncio.to_thread(parts.auth.accounts.remove, name)
    await close_ended(parts)


@router.put("/session/password", **DONE)
@needs(Need.OBSERVER)
async def change_password(body: ChangePassword, who: Who, request: Request) -> None:
    """Of one's own account; its other sessions end at once."""
    if who.is_owner:
        raise ConflictError(
            "The owner's password stands in the settings.", advice="Set HEDGEHOP_PASSWORD and start again."
        )
    parts = parts_of(request)
    made = await parts.auth.hashed(body.password)
    await asyncio.to_thread(parts.auth.change_password, who.name, made, stays=who.session_key)
    await close_ended(parts)


@router.get("/sessions", response_model=list[SessionDoc])
@needs(Need.OPERATOR)
async def sessions(who: Who, request: Request) -> Response:
    """Who is in: newest first."""
    parts = parts_of(request)
    in_charge = parts.fleet.holders
    found = [
        SessionDoc(
            id=key[:_ID_LENGTH],
            name=session.name or f"Owner {key[:4]}",
            role=role,
            since_utc_s=session.since_utc_s,
            seen_utc_s=session.seen_utc_s,
            address=session.address,
            mine=key == who.session_key,
            in_charge=key in in_charge,
        )
        for key, (session, role) in parts.auth.sessions.items()
    ]
    found.sort(key=lambda session: session.seen_utc_s, reverse=True)
    return Response(_SESSIONS.dump_json(found), media_type="application/json")


@router.delete("/sessions/{session_id}", **DONE)
async def end_session(session_id: str, request: Request) -> None:
    """Signs one out, wherever it is."""
    parts = parts_of(request)
    keys = [key for key in parts.auth.sessions if key[:_ID_LENGTH] == session_id]
    if not keys:
        raise NotFoundError("There is no such session.", advice="It may have ended: look at the list again.")
    await end_sessions(parts, keys)


@router.delete("/sessions", **DONE)
async def end_other_sessions(who: Who, request: Request) -> None:
    """Signs out everywhere but here."""
    parts = parts_of(request)
    await end_sessions(parts, [key for key in parts.auth.sessions if key != who.session_key])


async def _invited(request: Request, name: str, status_code: int) -> Response:
    expires_utc_s = time.time() + INVITED_S
    token = await asyncio.to_thread(parts_of(request).auth.accounts.invite, name)
    made = InvitationDoc(link=f"{request.base_url}login?token={token}", expires_utc_s=expires_utc_s)
    return answer(made, status_code)
