"""Live view: the newest annotated frame as a motion-JPEG stream for a browser or the dashboard."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError

BOUNDARY = "tubefoot-frame"


class LiveView:
    """A small web server on this machine; `show` never waits for those who watch."""

    def __init__(self, port: int):
        """Listen.

        port : of 127.0.0.1; 0 takes a free one
        """
        self._condition = threading.Condition()
        self._packed = b""
        self._number = 0
        self._closed = False
        try:
            self._server = ThreadingHTTPServer(("127.0.0.1", port), self._handler())
        except OSError as error:
            raise ConfigError(
                f"--live {port}: the port cannot be used: {error.strerror}; choose another"
            ) from error
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """Where to look at it."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/"

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Replace the frame that is shown.

        picture : grey or colour
        """
        _, packed = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 80])
        with self._condition:
            self._packed = packed.tobytes()
            self._number += 1
            self._condition.notify_all()

    def close(self) -> None:
        """Stop serving."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def _after(self, number: int) -> tuple[int, bytes]:
        """The first frame newer than a number; empty when the view was closed."""
        with self._condition:
            self._condition.wait_for(lambda: self._closed or self._number > number)
            return self._number, b"" if self._closed else self._packed

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        view = self

        class Handler(BaseHTTPRequestHandler):
            """Streams frames until the watcher leaves or the view closes."""

            def do_GET(self) -> None:
                """Answer any path with the stream."""
                self.send_response(200)
                self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={BOUNDARY}")
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                number = 0
                try:
                    while True:
                        number, packed = view._after(number)
                        if not packed:
                            return
                        self.wfile.write(_part(packed))
                except (BrokenPipeError, ConnectionResetError):
                    return

            def log_message(self, format: str, *args: object) -> None:
                """Stay silent."""

        return Handler


def _part(packed: bytes) -> bytes:
    """One frame of the stream with its headers."""
    head = f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(packed)}\r\n\r\n"
    return head.encode() + packed + b"\r\n"
