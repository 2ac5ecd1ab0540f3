"""Everything up at once: the bench or replay, the emergency stop's server, the page's server."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from typing import Any

import uvicorn

from tubefoot.dashboard.access import Access
from tubefoot.dashboard.desk import Showing
from tubefoot.dashboard.server import dashboard_app
from tubefoot.dashboard.stop_server import StopServer
from tubefoot.errors import ConfigError

PING_S = 5.0
GRACE_S = 2


class Dashboard:
    """A dashboard that listens from its making on; `serve` blocks until `stop`, or Ctrl-C.

    address : of the page, with the token
    """

    def __init__(
        self, showing: Showing, access: Access, model: Mapping[str, Any], mode: str, host: str, port: int
    ):
        """Take the ports.

        showing : what is shown
        access : who may
        model : the finger for the 3D view
        mode : `live` or `replay`
        host : of the loopback
        port : of the page, 0 for any; the emergency stop takes the next one
        """
        self.showing = showing
        self._socket = _listening(host, port)
        own = int(self._socket.getsockname()[1])
        self.stop_server = StopServer(host, own + 1 if port else 0, access, showing.trip)
        self.stop_server.page_port = own
        shown = f"[{host}]" if ":" in host else host
        self.origin = f"http://{shown}:{own}"
        self.address = f"{self.origin}/?token={access.token}"
        app = dashboard_app(showing, access, model, mode, lambda: self.stop_server.port)
        config = uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            ws="websockets-sansio",
            ws_max_size=4096,
            ws_ping_interval=PING_S,
            ws_ping_timeout=PING_S,
            timeout_graceful_shutdown=GRACE_S,
            lifespan="off",
        )
        self._server = uvicorn.Server(config)

    def serve(self) -> None:
        """Show it until it is stopped."""
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self.close()

    def stop(self) -> None:
        """Have `serve` end; from another thread."""
        self._server.should_exit = True

    def close(self) -> None:
        """End everything; the pump stands."""
        self.showing.close()
        self.stop_server.close()
        self._socket.close()


def _listening(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family, socket.SOCK_STREAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((host, port))
        made.listen()  # a page may knock before the server is up
    except OSError as error:
        made.close()
        raise ConfigError(
            f"--http-port {port}: the port cannot be used: {error.strerror}; choose another"
        ) from error
    return made
