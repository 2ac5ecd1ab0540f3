"""The emergency stop's own server: a thread and a port of its own, nothing shared with the page's server.

It answers one thing, a form sent to `/stop` with the token, and calls the line in the same thread. It works
while the page's server hangs, while the bench's thread hangs, and without any JavaScript in the browser.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from html import escape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs

from tubefoot.dashboard.access import Access
from tubefoot.errors import ConfigError, TubefootError

FORM_BYTES = 4096
PATIENCE_S = 5.0
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Emergency stop</title>
<meta name="viewport" content="width=device-width"><body style="font: 1.3rem sans-serif; margin: 2rem">
<h1>Emergency stop</h1><p>{said}</p><p>Look at the pump. If it still runs, pull its plug.</p></body></html>"""


class StopServer:
    """Listens until it is closed."""

    def __init__(self, host: str, port: int, access: Access, stop: Callable[[str], str]):
        """Listen.

        host : of the loopback
        port : 0 takes a free one
        access : who may
        stop : told who asked; returns what came of it
        """
        self.page_port: int | None = None
        try:
            self._server = ThreadingHTTPServer((host, port), self._handler(access, stop))
        except OSError as error:
            raise ConfigError(
                f"--http-port: the emergency stop's port {port} cannot be used: {error.strerror}; "
                "choose another"
            ) from error
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, name="emergency stop", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._server.server_address[1])

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def _handler(self, access: Access, stop: Callable[[str], str]) -> type[BaseHTTPRequestHandler]:
        server = self

        class Handler(BaseHTTPRequestHandler):
            """One request."""

            timeout = PATIENCE_S

            def do_POST(self) -> None:
                """Stop the pump."""
                headers = {key.lower(): value for key, value in self.headers.items()}
                if fault := access.fault_of_origin(headers, server.page_port):
                    self._answer(403, fault)
                    return
                length = min(int(headers.get("content-length") or 0), FORM_BYTES)
                form = parse_qs(self.rfile.read(length).decode(errors="replace"))
                token = form.get("token", [""])[0]
                if not access.knows(token):
                    self._answer(403 if token else 401, "wrong or missing token")
                    return
                try:
                    said = f"The stop was {stop('emergency stop button')}."
                except TubefootError as error:
                    said = str(error)
                self._answer(200, said)

            def _answer(self, status: int, said: str) -> None:
                plain = "application/json" in (self.headers.get("Accept") or "")
                text = json.dumps({"said": said}) if plain else PAGE.format(said=escape(said))
                data = text.encode()
                self.send_response(status)
                self.send_header("Content-Type", "application/json" if plain else "text/html; charset=utf-8")
                self.send_header("Content-Length", str(len(data)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(data)

            def log_message(self, format: str, *args: object) -> None:
                """Stay silent."""

        return Handler
