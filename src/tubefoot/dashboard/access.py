"""Who may talk to the dashboard: this computer's browsers, on pages of the dashboard itself, with the token.

The server listens on the loopback only. Two dangers remain: other programs and users of this computer, which
do not know the token, and pages of other origins in the same browser, which can send requests here but are
given away by the Origin header, or by the Host header where a foreign name was made to point here (DNS
rebinding). There are no cookies, so a browser never adds the right to a request by itself.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import secrets
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import urlsplit

from tubefoot.errors import ConfigError

LOOPBACK_NAMES = ("localhost",)
TOKEN_FILE = "token"
TOKEN_BYTES = 24


def loopback(host: str) -> str:
    """The host, if it is this computer's loopback; else ConfigError.

    host : name or address
    """
    if not _is_loopback(host):
        raise ConfigError(
            f"--host {host}: the dashboard drives a pump and listens on this computer only; use 127.0.0.1, "
            "and from elsewhere an SSH tunnel: ssh -L 8321:127.0.0.1:8321 -L 8322:127.0.0.1:8322 LAB-COMPUTER"
        )
    return host


def kept_token(directory: Path) -> str:
    """The token of a directory, drawn at random the first time; a page that knows it survives a restart.

    directory : holds it, in a file that only its owner may read
    """
    path = directory / TOKEN_FILE
    try:
        token = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        token = ""
    if len(token) >= TOKEN_BYTES:
        return token
    token = secrets.token_urlsafe(TOKEN_BYTES)
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(token)
    return token


class Access:
    """The rules, the same for the server, its websocket and the emergency stop's own server."""

    def __init__(self, token: str):
        """Take the secret.

        token : that a request must bear
        """
        self.token = token

    def fault_of_origin(self, headers: Mapping[str, str], page_port: int | None = None) -> str:
        """Why a request must be refused whatever token it bears; empty when it need not be.

        headers : of the request, names in lower case
        page_port : None where the origin must be the very host that is asked; else the port of the page,
            where the request goes to another one
        """
        host = urlsplit(f"//{headers.get('host', '')}")
        if not _is_loopback(host.hostname or ""):
            return f"host {headers.get('host', '')!r} is not this computer"
        origin = headers.get("origin")
        if origin is None:
            return ""
        from_page = urlsplit(origin)
        known = from_page.scheme == "http" and _is_loopback(from_page.hostname or "")
        if page_port is None:
            known = known and from_page.netloc == headers.get("host")
        else:
            known = known and from_page.port == page_port
        return "" if known else f"origin {origin!r} is not the dashboard's page"

    def knows(self, token: str | None) -> bool:
        """Whether a token is the right one.

        token : as it came
        """
        return hmac.compare_digest((token or "").encode(), self.token.encode())


def _is_loopback(host: str) -> bool:
    if host in LOOPBACK_NAMES:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
