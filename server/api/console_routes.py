"""The console's files, the documentation of the API, and the sign of life."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import FileResponse, HTMLResponse, JSONResponse, RedirectResponse, Response

from planning import __version__
from planning.terrain.rasters.confinement import what_holds
from server.api.access import Need, identity_of, needs, parts_of
from server.api.session_routes import inline_policy, render
from server.errors import NotFoundError, SignInError
from server.schemas.station_docs import HealthDoc, LoopDoc

router = APIRouter(include_in_schema=False)

_FOR_EVER = "public, max-age=31536000, immutable"


@router.get("/api/health", include_in_schema=True, response_model_exclude_none=True, tags=["health"])
@needs(Need.NOTHING)
async def health(request: Request) -> HealthDoc:
    """Answers without a session; who has one learns how the station is."""
    try:
        identity_of(request)
    except SignInError:
        return HealthDoc(version=__version__)
    lag = parts_of(request).loop_lag.lag
    loop = LoopDoc(
        p99_ms=1000 * lag.p99_s,
        longest_ms=1000 * lag.longest_s,
        longest_utc=lag.longest_utc,
        since_utc=lag.since_utc,
        longest_work_ms=1000 * lag.longest_work_s,
    )
    return HealthDoc(version=__version__, loop=loop, confinement=str(what_holds()))


@router.get("/")
@needs(Need.NOTHING)
async def console(request: Request) -> Response:
    try:
        identity_of(request)
    except SignInError:
        return _to_sign_in(request)
    index = parts_of(request).settings.console_dir / "index.html"
    if not index.is_file():
        page = render("no_console.html")
        return HTMLResponse(page, 503, {"content-security-policy": inline_policy(page)})
    return FileResponse(index, media_type="text/html", headers={"cache-control": "no-cache"})


@router.get("/assets/{path:path}")
async def asset(path: str, request: Request) -> Response:
    """Built files carry a digest in their names, so browsers may keep them."""
    return FileResponse(
        _file_below(parts_of(request).settings.console_dir / "assets", path), headers={"cache-control": _FOR_EVER}
    )


@router.get("/help")
@router.get("/help/")
@needs(Need.NOTHING)
async def help_contents() -> Response:
    return RedirectResponse("/help/index.html")


@router.get("/help/{path:path}")
@needs(Need.NOTHING)
async def help_page(path: str, request: Request) -> Response:
    """The documents, as they were when the console was built."""
    try:
        identity_of(request)
    except SignInError:
        return _to_sign_in(request)
    file = _file_below(parts_of(request).settings.console_dir / "help", path)
    return FileResponse(file, headers={"cache-control": "no-cache"})


@router.get("/favicon.svg")
@needs(Need.NOTHING)
async def favicon(request: Request) -> Response:
    return FileResponse(
        _file_below(parts_of(request).settings.console_dir, "favicon.svg"), headers={"cache-control": "no-cache"}
    )


@router.get("/api/openapi.json")
async def openapi(request: Request) -> Response:
    return JSONResponse(request.app.openapi())


@router.get("/api/docs")
async def docs(request: Request) -> Response:
    """The operations on one page, without anyone else's scripts."""
    page = render("api.html", title=request.app.title, version=__version__, operations=_operations(request.app))
    return HTMLResponse(page, headers={"content-security-policy": inline_policy(page)})


def _to_sign_in(request: Request) -> Response:
    # Whoever follows a link from another site arrives without the strict cookie; a step of our own brings it along.
    if request.headers.get("sec-fetch-site") == "cross-site":
        return HTMLResponse('<!doctype html><meta http-equiv="refresh" content="0;url=/"><title>Hedgehop</title>')
    return RedirectResponse("/signin", 303)


def _file_below(folder: Path, path: str) -> Path:
    root = folder.resolve()
    file = (root / path).resolve() if "\0" not in path else root
    if not file.is_relative_to(root) or not file.is_file():
        raise NotFoundError("There is no such file.")
    return file


def _operations(app: Any) -> list[dict[str, str]]:
    return [
        {"method": method.upper(), "path": path, "text": operation.get("description") or operation["summary"]}
        for path, methods in app.openapi()["paths"].items()
        for method, operation in methods.items()
    ]
