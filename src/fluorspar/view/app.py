"""The routes: which question gets which answer. The page and its parts are files of the package."""

from __future__ import annotations

import json
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp

from fluorspar.errors import FluorsparError
from fluorspar.version import __version__
from fluorspar.view.false_colour import MAPS, stops
from fluorspar.view.page import page_file
from fluorspar.view.pictures import components_of, picture_of
from fluorspar.view.plain import plain
from fluorspar.view.questions import Pinned, SpectrumAsked, View
from fluorspar.view.security import Gate, Guard
from fluorspar.view.spectra import regions_of, spectrum_of, table_of
from fluorspar.view.workspace import UnknownSource, Workspace

__all__ = ["make_app"]


def make_app(workspace: Workspace, guard: Guard) -> ASGIApp:
    """Make the server's application.

    Parameters
    ----------
    workspace : Workspace
    guard : Guard

    Returns
    -------
    ASGI application
    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.include_router(_routes(workspace))
    app.add_exception_handler(RequestValidationError, _malformed)
    app.add_exception_handler(FluorsparError, _refused)
    app.add_exception_handler(MemoryError, _refused)
    app.add_exception_handler(HTTPException, _no_route)
    return Gate(app, guard)


def _routes(workspace: Workspace) -> APIRouter:
    routes = APIRouter()

    @routes.get("/")
    def page() -> Response:
        return page_file("index.html")

    @routes.get("/static/{name:path}")
    def static(name: str) -> Response:
        return page_file(name)

    @routes.get("/api/about")
    def about() -> Response:
        maps = {mode: {"name": name, "stops": stops(mode)} for mode, name in MAPS.items()}
        return _json({"version": __version__, "sources": workspace.about(), "colour_maps": maps})

    @routes.get("/api/progress")
    def progress() -> Response:
        return _json(workspace.progress())

    @routes.post("/api/picture")
    async def picture(view: View, request: Request) -> Response:
        if await request.is_disconnected():  # the slider has moved on
            return Response(status_code=204)
        return await run_in_threadpool(_picture, workspace, view)

    @routes.post("/api/components")
    def components(view: View) -> Response:
        return _json(components_of(workspace.image(view), view, workspace.white(view)))

    @routes.post("/api/spectrum")
    def spectrum(asked: SpectrumAsked) -> Response:
        return _json(spectrum_of(workspace.image(asked), asked, workspace.white_of_lab(asked)))

    @routes.post("/api/csv")
    def table(asked: Pinned) -> Response:
        pins = {pin.name: pin.region for pin in asked.pins}
        spectra = regions_of(workspace.image(asked), asked, pins, workspace.source(asked.source).name)
        return _file(table_of(spectra), "text/csv; charset=utf-8", "spectra.csv")

    return routes


def _picture(workspace: Workspace, view: View) -> Response:
    kept = workspace.image(view)
    drawn = picture_of(kept, view, workspace.white(view))
    facts = drawn.facts | {"coarse": view.coarse, "generation": kept.generation}
    return Response(drawn.png, media_type="image/png", headers={"X-Fluorspar": json.dumps(plain(facts))})


def _json(content: Any) -> Response:
    return JSONResponse(plain(content))


def _file(content: bytes, kind: str, name: str) -> Response:
    return Response(
        content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


async def _malformed(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    faults = [
        f"{'.'.join(str(part) for part in fault['loc'] if part != 'body') or 'the body'}: {fault['msg']}"
        for fault in error.errors()[:5]
    ]
    return JSONResponse({"error": "the question cannot be understood\n  " + "\n  ".join(faults)}, 400)


async def _refused(request: Request, error: Exception) -> Response:
    if isinstance(error, MemoryError):
        return JSONResponse({"error": "the memory does not suffice"}, 400)
    return JSONResponse({"error": str(error)}, 404 if isinstance(error, UnknownSource) else 400)


async def _no_route(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return JSONResponse({"error": f"there is nothing here ({error.detail})"}, error.status_code)
