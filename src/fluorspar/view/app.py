"""The routes: which question gets which answer. The page and its parts are files of the package."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
from collections.abc import Callable, Sequence
from functools import partial
from shutil import rmtree
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse
from starlette.background import BackgroundTask
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp

from fluorspar.errors import FluorsparError, OptionError, message
from fluorspar.image.weighting import weighted
from fluorspar.version import __version__
from fluorspar.view.command_line import command_of
from fluorspar.view.curves import curve_of
from fluorspar.view.differences import difference_of
from fluorspar.view.false_colour import MAPS, stops
from fluorspar.view.page import page_file
from fluorspar.view.paths_source import NotTraced
from fluorspar.view.pictures import components_of, picture_of
from fluorspar.view.plain import plain
from fluorspar.view.questions import (
    Compared,
    CurveAsked,
    MatrixAsked,
    Pin,
    Pinned,
    Saved,
    SpectrumAsked,
    View,
    WhiteLight,
)
from fluorspar.view.saving import KINDS, file_name, written
from fluorspar.view.security import Gate, Guard
from fluorspar.view.spectra import regions_of, spectrum_of, table_of
from fluorspar.view.turns import Abandoned
from fluorspar.view.workspace import UnknownSource, Workspace

__all__ = ["make_app"]

_LOG = logging.getLogger(__name__)
_AGAIN = 0.05  # seconds
_STATUS = {UnknownSource: 404, NotTraced: 503}


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
    app.add_exception_handler(Abandoned, _nobody_waits)
    app.add_exception_handler(HTTPException, _no_route)
    app.add_exception_handler(Exception, _own_fault)
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
        facts = {"version": __version__, "sources": workspace.about(), "library": workspace.menus()}
        return _json(facts | {"colour_maps": maps})

    @routes.get("/api/progress")
    def progress() -> Response:
        return _json(workspace.progress())

    @routes.post("/api/picture")
    async def picture(view: View, request: Request) -> Response:
        return await _unless_abandoned(request, partial(_picture, workspace, view))

    @routes.post("/api/components")
    def components(view: View) -> Response:
        return _json(components_of(workspace.image(view), view, workspace.white(view)))

    @routes.post("/api/spectrum")
    def spectrum(asked: SpectrumAsked) -> Response:
        return _json(spectrum_of(workspace.image(asked), asked, workspace.white_of_lab(asked)))

    @routes.post("/api/csv")
    def table(asked: Pinned) -> Response:
        return _download(_spectra(workspace, asked, asked.pins), "csv", "spectra.csv")

    @routes.post("/api/compare")
    def difference(asked: Compared) -> Response:
        return _json(
            difference_of(*(weighted(workspace.image(v).image, v.weights) for v in (asked.a, asked.b)))
        )

    @routes.post("/api/upload")
    async def upload(request: Request, name: str, kind: str) -> Response:
        added = await run_in_threadpool(workspace.supplies.uploads.add, name, kind, await request.body())
        return _json(added.facts())

    @routes.post("/api/curve")
    def curve(asked: CurveAsked) -> Response:
        return _json(curve_of(workspace.light(asked.source, asked.id, asked.light)))

    @routes.post("/api/donaldson")
    def donaldson(asked: MatrixAsked) -> Response:
        return _json(workspace.matrix(asked))

    @routes.post("/api/save")
    def save(asked: Saved) -> Response:
        kept = workspace.image(asked)
        name = file_name(asked.name, workspace.source(asked.source).name, asked.format)
        if asked.format == "csv":
            return _download(_spectra(workspace, asked, asked.pins), "csv", name)
        if asked.format == "png":
            return _download(picture_of(kept, asked, workspace.white(asked)).png, "png", name)
        file = written(kept, asked.format)
        removed = BackgroundTask(rmtree, file.parent, ignore_errors=True)
        return FileResponse(file, media_type=KINDS[asked.format], filename=name, background=removed)

    @routes.post("/api/command")
    def command(view: View) -> Response:
        white = workspace.white(view) if isinstance(view.white, WhiteLight) else None
        if white is not None:  # a command line does not know it by the light's name
            view = view.model_copy(update={"white": tuple(white)})
        composed = command_of(workspace.source(view.source), view, workspace.supplies)
        words = {"command": "\n".join(composed.lines), "files": composed.files, "notes": composed.notes}
        return _json(words)

    return routes


async def _unless_abandoned(request: Request, answer: Callable[[threading.Event], Response]) -> Response:
    """Answer in a thread, which stops if nobody waits any more: the slider has moved on."""
    abandoned = threading.Event()

    async def watch() -> None:
        while not await request.is_disconnected():
            await asyncio.sleep(_AGAIN)
        abandoned.set()

    watching = asyncio.create_task(watch())
    try:
        return await run_in_threadpool(answer, abandoned)
    finally:
        watching.cancel()


def _picture(workspace: Workspace, view: View, abandoned: threading.Event) -> Response:
    if workspace.source(view.source).kind == "image":
        view = view.model_copy(update={"coarse": False})  # it is there in full
    kept = workspace.image(view, abandoned)
    drawn = picture_of(kept, view, workspace.white(view))
    facts = drawn.facts | {
        "coarse": view.coarse,
        "generation": kept.generation,
        "size": kept.whole.size,
    }
    return Response(drawn.png, media_type="image/png", headers={"X-Fluorspar": json.dumps(plain(facts))})


def _spectra(workspace: Workspace, view: View, pins: Sequence[Pin]) -> bytes:
    """The table of regions, of the whole image if there are none."""
    kept = workspace.image(view)
    width, height = kept.whole.size
    names = [pin.name for pin in pins]
    if twice := {name for name in names if names.count(name) > 1}:
        raise OptionError(message("two pins have the same name", got=", ".join(sorted(twice))))
    regions = {pin.name: pin.region for pin in pins} or {"all": (0, 0, width - 1, height - 1)}
    return table_of(regions_of(kept, view, regions, workspace.source(view.source).name))


def _json(content: Any) -> Response:
    return JSONResponse(plain(content))


def _download(content: bytes, kind: str, name: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=KINDS[kind], headers=headers)


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
    status = next((code for kind, code in _STATUS.items() if isinstance(error, kind)), 400)
    return JSONResponse({"error": str(error)}, status)


async def _nobody_waits(request: Request, error: Exception) -> Response:
    return Response(status_code=204)


async def _no_route(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    text = "there is nothing here" if error.status_code == 404 else error.detail
    return JSONResponse({"error": text}, error.status_code)


async def _own_fault(request: Request, error: Exception) -> Response:
    _LOG.error("a fault of Fluorspar itself; please report it", exc_info=error)
    return JSONResponse({"error": f"a fault of Fluorspar itself ({error!r}); please report it"}, 500)
