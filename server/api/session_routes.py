"""Signing in and out, and the few pages that are not the console: everything put into them is escaped."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import re
from functools import lru_cache
from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from server.api.access import Need, Who, address_of, answer, cookie_name, identity_of, needs, parts_of
from server.api.sessions_ended import end_sessions
from server.errors import SignInError, status_of
from server.schemas import MeDoc, SignIn

router = APIRouter(tags=["session"])

_TEMPLATES = Path(__file__).resolve().parent.parent / "templates"


@router.get("/login", include_in_schema=False)
@needs(Need.NOTHING)
async def login(request: Request, token: str = "") -> Response:
    """The one-time link. Opened again by who is in already, it simply leads to the console."""
    auth = parts_of(request).auth
    try:
        identity_of(request)
        return RedirectResponse("/", 303)
    except SignInError:
        pass
    try:
        session_id = await asyncio.to_thread(auth.redeem, token, address_of(request))
    except SignInError as error:
        return sign_in_page(request, str(error), status_of(error))
    return _with_cookie(request, RedirectResponse("/", 303), session_id)


_ENDED = "Your session has ended. Sign in again: the plan is saved."


@router.get("/signin", include_in_schema=False)
@needs(Need.NOTHING)
async def sign_in_form(request: Request, ended: bool = False) -> Response:
    return sign_in_page(request, _ENDED if ended else "", 200)


@router.get("/api/session", response_model=MeDoc)
async def me(who: Who) -> Response:
    """Who this session is, and what it may."""
    return answer(MeDoc(name=who.name, role=who.role, owner=who.is_owner))


@router.post("/api/session", status_code=204)
@needs(Need.NOTHING)
async def sign_in(body: SignIn, request: Request) -> Response:
    """Signs in with the password; after five wrong ones from an address each further one waits."""
    session_id = await parts_of(request).auth.sign_in(body.name, body.password, address_of(request))
    return _with_cookie(request, Response(status_code=204), session_id)


@router.delete("/api/session", status_code=204)
@needs(Need.OBSERVER)
async def sign_out(who: Who, request: Request) -> Response:
    """Ends the session and closes all its pages."""
    await end_sessions(parts_of(request), [who.session_key])
    response = Response(status_code=204)
    response.delete_cookie(cookie_name(request))
    return response


def sign_in_page(request: Request, message: str, status_code: int) -> Response:
    parts = parts_of(request)
    trust_page = None if parts.trust_port is None else f"http://{_host(request)}:{parts.trust_port}/"
    page = render("signin.html", message=message, has_password=parts.auth.has_password, trust_page=trust_page)
    return HTMLResponse(page, status_code, {"content-security-policy": inline_policy(page)})


def _host(request: Request) -> str:
    """Under which the page was found: there the other one is found, too."""
    host = request.url.hostname or ""
    return f"[{host}]" if ":" in host else host


@lru_cache(maxsize=1)
def _environment() -> Environment:
    return Environment(loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined)


def render(template: str, **values: object) -> str:
    return _environment().get_template(template).render(**values)


def inline_policy(page: str) -> str:
    """Lets exactly the page's own script and style run, nothing else."""
    return (
        f"default-src 'none'; script-src {_hashes(page, 'script')}; style-src {_hashes(page, 'style')}; "
        "img-src data:; connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )


def _hashes(page: str, tag: str) -> str:
    texts = re.findall(rf"<{tag}>(.*?)</{tag}>", page, flags=re.DOTALL)
    digests = (base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts)
    return " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"


def _with_cookie(request: Request, response: Response, session_id: str) -> Response:
    response.set_cookie(
        cookie_name(request),
        session_id,
        max_age=int(parts_of(request).auth.lifetime_s),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
    return response
