"""The page's server: static files, orders by POST, one binary websocket; every request is judged by `Access`.

It reads snapshots and leaves orders; nothing here waits for the bench.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Mapping
from importlib.resources import files
from typing import Any

from fastapi import FastAPI, Request, WebSocket, WebSocketDisconnect
from fastapi.responses import HTMLResponse, JSONResponse, Response
from fastapi.staticfiles import StaticFiles

from tubefoot.dashboard.access import Access
from tubefoot.dashboard.desk import Showing
from tubefoot.dashboard.feed import Cursor
from tubefoot.dashboard.wire import packed
from tubefoot.errors import TubefootError

LOOK_S = 0.015
"""How often a websocket looks for news [s]."""
MESSAGE_BYTES = 2_000_000
PAGE_NAME_CHARACTERS = 40
OPEN_PATHS = ("/static/", "/vendored/")
"""Code and style: the same for everybody, nothing of this bench in it."""
REFUSAL = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Tubefoot dashboard</title>
<body style="font: 1rem sans-serif; margin: 2rem"><h1>This page needs its token</h1>
<p>Open the address that <code>tubefoot dashboard</code> printed, with <code>?token=</code> in it.</p>"""

Next = Callable[[Request], Awaitable[Response]]


def dashboard_app(
    showing: Showing, access: Access, model: Mapping[str, Any], mode: str, stop_port: Callable[[], int]
) -> FastAPI:
    """The application.

    showing : the bench or a replay
    access : who may
    model : the finger for the 3D view
    mode : `live` or `replay`
    stop_port : of the emergency stop's own server, 0 where there is none
    """
    app = FastAPI(title="Tubefoot dashboard", docs_url=None, redoc_url=None, openapi_url=None)
    package = files("tubefoot")
    app.mount("/static", StaticFiles(directory=str(package / "dashboard" / "static")))
    app.mount("/vendored", StaticFiles(directory=str(package / "vendored")))

    @app.middleware("http")
    async def guard(request: Request, call_next: Next) -> Response:
        answer = _refusal(request, access) or await call_next(request)
        host = request.url.hostname
        stop = f" http://{host}:{stop_port()}" if stop_port() else ""
        answer.headers.update(
            {
                "Content-Security-Policy": (
                    f"default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
                    f"connect-src 'self' ws://{request.headers.get('host')}{stop}; "
                    f"form-action 'self'{stop}; frame-ancestors 'none'; base-uri 'none'; object-src 'none'"
                ),
                "Referrer-Policy": "strict-origin",
                "X-Content-Type-Options": "nosniff",
                "Cross-Origin-Resource-Policy": "same-origin",
                "Cache-Control": "no-store",
            }
        )
        return answer

    @app.get("/")
    async def page(request: Request) -> Response:
        text = (package / "dashboard" / "static" / "index.html").read_text(encoding="utf-8")
        host = request.url.hostname
        stop = f"http://{host}:{stop_port()}/stop" if stop_port() else "/stop"
        filled = {"%TOKEN%": access.token, "%STOP%": stop, "%MODE%": mode}
        for mark, value in filled.items():
            text = text.replace(mark, value)
        return HTMLResponse(text)

    @app.get("/api/finger")
    async def finger() -> Response:
        return JSONResponse(dict(model))

    @app.post("/api/do")
    async def do(request: Request) -> Response:
        body = await _body(request)
        if not isinstance(body, dict):
            return JSONResponse({"error": "send a JSON object of at most 2 MB"}, 400)
        try:
            name = _page_name(request.headers.get("x-tubefoot-page"))
            return JSONResponse(await asyncio.to_thread(showing.do, name, body))
        except TubefootError as error:
            return JSONResponse({"error": str(error)}, 409)

    @app.post("/api/beat")
    async def beat(request: Request) -> Response:
        showing.beat(_page_name(request.headers.get("x-tubefoot-page")))
        return JSONResponse({})

    @app.post("/stop")
    async def stop(request: Request) -> Response:
        said = await asyncio.to_thread(showing.trip, "emergency stop button")
        return JSONResponse({"said": said})

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        if access.fault_of_origin(dict(socket.headers)) or not access.knows(socket.query_params.get("token")):
            await socket.close(4403)  # before it is accepted: the handshake is refused with 403
            return
        name = _page_name(socket.query_params.get("page"))
        await socket.accept()
        await _serve(socket, showing, name)

    return app


async def _serve(socket: WebSocket, showing: Showing, name: str) -> None:
    """Send news and take heartbeats until either ends."""
    tasks = {asyncio.create_task(_send(socket, showing)), asyncio.create_task(_hear(socket, showing, name))}
    done, pending = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in pending:
        task.cancel()
    await asyncio.gather(*pending, return_exceptions=True)
    for task in done:
        error = task.exception()
        if error is not None and not isinstance(error, WebSocketDisconnect | RuntimeError):
            raise error


async def _send(socket: WebSocket, showing: Showing) -> None:
    """Everything new, as often as the browser takes it; a slow one misses pictures, not samples."""
    cursor = Cursor()
    while True:
        news = showing.feed.after(cursor)
        if news:
            await socket.send_bytes(packed(news))
        await asyncio.sleep(LOOK_S)


async def _hear(socket: WebSocket, showing: Showing, name: str) -> None:
    """A new socket and each message are heartbeats; raises WebSocketDisconnect at the end."""
    showing.beat(name)
    while True:
        await socket.receive_text()
        showing.beat(name)


def _refusal(request: Request, access: Access) -> Response | None:
    """The refusal of a request that may not pass, None for one that may."""
    fault = access.fault_of_origin(dict(request.headers))
    if fault:
        return JSONResponse({"error": fault}, 403)
    path = request.url.path
    if path.startswith(OPEN_PATHS):
        return None
    token = request.headers.get("x-tubefoot-token") or request.query_params.get("token")
    if access.knows(token):
        return None
    if path == "/":
        return HTMLResponse(REFUSAL, 403 if token else 401)
    return JSONResponse({"error": "wrong token" if token else "token missing"}, 403 if token else 401)


async def _body(request: Request) -> Any:
    """The JSON of a request, None where there is none or too much."""
    if int(request.headers.get("content-length") or 0) > MESSAGE_BYTES:
        return None
    try:
        return await request.json()
    except ValueError:
        return None


def _page_name(given: str | None) -> str:
    return (given or secrets.token_hex(8))[:PAGE_NAME_CHARACTERS]
