"""Access: who may ask, and for what.

In: the head of a request. Out: whether it is the owner's or a viewer's, or the status that it is refused with. The
token decides; Host and Origin are checked besides, so that no page of another site can ask in somebody's name.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from dataclasses import dataclass, field
from typing import Final

#: The paths that there are: the page, and its websocket.
PAGE, STREAM = "/", "/live"
#: What a gallery has besides: a picture of what it lists.
PICTURE: Final = "/picture"
_WILD: Final = ("0.0.0.0", "::", "")


def _token() -> str:
    return secrets.token_urlsafe(24)


@dataclass(frozen=True)
class Refused:
    """A status, and why."""

    status: int
    reason: str


@dataclass(frozen=True)
class Access:
    """Who may ask a server that listens at ``host`` and ``port``; with ``viewers`` there is a second token."""

    host: str
    port: int
    viewers: bool = False
    paths: tuple[str, ...] = (PAGE, STREAM)
    owner: str = field(default_factory=_token)
    viewer: str = field(default_factory=_token)

    def url(self, owner: bool = True) -> str:
        """Where the page can be opened."""
        host = "127.0.0.1" if self.host in _WILD else self.host
        return f"http://{_bracketed(host)}:{self.port}/?token={self.owner if owner else self.viewer}"

    def of(self, token: str | None) -> bool | None:
        """Whether a token is the owner's (True) or the viewers' (False); None for another."""
        given = (token or "").encode("utf-8", "replace")
        if hmac.compare_digest(given, self.owner.encode()):
            return True
        if self.viewers and hmac.compare_digest(given, self.viewer.encode()):
            return False
        return None

    def refusal(
        self, method: str, path: str, host: str | None, origin: str | None, token: str | None
    ) -> Refused | None:
        """Why a request is refused; None where it is not."""
        if host is None or not self._ours(host):
            return Refused(403, "the Host is not this server's")
        if origin is not None and origin != f"http://{host}":
            return Refused(403, "the Origin is not this server's")
        if self.of(token) is None:
            return Refused(403, "the token is missing or wrong: open the URL that 'neurovis live' has printed")
        if path not in self.paths:
            return Refused(404, "there is nothing at this path")
        if method != "GET":
            return Refused(405, "only GET is answered")
        return None

    def _ours(self, host: str) -> bool:
        name, port = _parted(host)
        if port != self.port:
            return False
        if name in ("localhost", "127.0.0.1", "::1", self.host.lower()):
            return True
        return self.host in _WILD and (_is_address(name) or name == socket.gethostname().lower())


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _parted(host: str) -> tuple[str, int | None]:
    """The name and the port of a Host; without one it is HTTP's."""
    name, colon, port = host.lower().rpartition(":")
    if not colon or "]" in port:
        name, port = host.lower(), "80"
    return name.removeprefix("[").removesuffix("]"), int(port) if port.isascii() and port.isdigit() else None
