"""The application: page, its files, its content, and what a running machine has done since."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route

from twin.page.front import SCRIPTS, STYLES, served_page, text
from twin.serve.finished_run import FinishedRun
from twin.serve.guard import Guard
from twin.serve.live_state import LiveState

KINDS = {".js": "text/javascript", ".css": "text/css"}
Lifespan = Callable[[Starlette], AbstractAsyncContextManager[None]]


def application(
    shown: FinishedRun | LiveState, token: str | None, names: tuple[str, ...] = (), lifespan: Lifespan | None = None
) -> Starlette:
    """Everything behind the guard; answers are made anew for a running machine and once for a finished one."""
    routes = [Route("/", _text(served_page(), "text/html"))]
    routes += [Route(f"/{name}", _text(text(name), KINDS[Path(name).suffix])) for name in (*STYLES, *SCRIPTS)]
    routes.append(Route("/content.json", _made(shown) if isinstance(shown, LiveState) else _kept(shown)))
    if isinstance(shown, LiveState):
        routes += [Route("/now.json", _now(shown)), Route("/frame/{step:int}.json", _frame(shown))]
    else:
        routes += [Route(f"/{name}", _file(shown.folder / name)) for name in shown.content()["files"]]
    return Starlette(
        routes=routes,
        middleware=[
            Middleware(Guard, token=token, names=names),
            Middleware(GZipMiddleware, minimum_size=2000, compresslevel=5),
        ],
        lifespan=lifespan,
    )


Endpoint = Callable[[Request], Any]


def _text(body: str, kind: str) -> Endpoint:
    async def endpoint(_: Request) -> Response:
        return Response(body, media_type=kind)

    return endpoint


def _kept(shown: FinishedRun) -> Endpoint:
    body = _json(shown.content()).body

    async def endpoint(_: Request) -> Response:
        return Response(body, media_type="application/json")

    return endpoint


def _made(shown: LiveState) -> Endpoint:
    async def endpoint(_: Request) -> Response:
        return _json(await run_in_threadpool(shown.content))

    return endpoint


def _now(shown: LiveState) -> Endpoint:
    async def endpoint(request: Request) -> Response:
        try:
            after = int(request.query_params.get("after", "-1"))
        except ValueError:
            return PlainTextResponse("`after` is the number of a step.\n", 400)
        return _json(shown.told(after))

    return endpoint


def _frame(shown: LiveState) -> Endpoint:
    async def endpoint(request: Request) -> Response:
        found = await run_in_threadpool(shown.frame, request.path_params["step"])
        return PlainTextResponse("No such step is kept.\n", 404) if found is None else _json(found)

    return endpoint


def _file(path: Path) -> Endpoint:
    async def endpoint(_: Request) -> Response:
        return FileResponse(path) if path.is_file() else PlainTextResponse("The file is gone.\n", 404)

    return endpoint


def _json(told: dict[str, Any]) -> Response:
    return Response(json.dumps(told, separators=(",", ":"), allow_nan=False), media_type="application/json")
