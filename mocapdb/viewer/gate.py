"""Who may talk to the viewer's server: nobody but whoever was given its address.

A page of any site can send requests to a server on this machine, also under a name of its own that
leads here (DNS rebinding). So a request is let in only where it names this server (Host), comes
from one of our own pages or from none (Origin), and carries the token of the address that was
printed, which the browser keeps as a cookie from then on.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import secrets
import socket
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

__all__ = ["Gate", "guarding"]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
PICTURES_KEPT_S = 7 * 86400  # by a browser: another picture has another name
EVERYWHERE = ("0.0.0.0", "::", "")  # they mean all addresses of the machine

Asked = Callable[[str], Future[str | None] | None]


class Gate:
    """The check of every request.

    Parameters
    ----------
    host : str
        Address that the server listens at.
    port : int
    token : str, optional
        What a visitor has to show; made up by default.

    Attributes
    ----------
    is_shut : bool
        Whether the server asks this gate: set by `guarding`.

    Examples
    --------
    >>> gate = Gate("127.0.0.1", 8080, token="secret")
    >>> gate.refusal("/?token=secret", {"Host": "127.0.0.1:8080"}) is None
    True
    >>> gate.refusal("/?token=secret", {"Host": "evil.example:8080"})
    'This is not the address of the viewer.'
    """

    def __init__(self, host: str, port: int, token: str | None = None) -> None:
        self.host, self.port = host, port
        self.token = token or secrets.token_urlsafe(16)
        self.cookie = f"mocapdb-{port}"  # a browser sends cookies to every port of a host
        self.is_shut = False

    def refusal(self, path: str, headers: Mapping[str, str]) -> str | None:
        """Return why a request is refused, or None where it is let in.

        Parameters
        ----------
        path : str
            With its query.
        headers : mapping of str to str
            Of which Host, Origin and Cookie count.
        """
        headers = {name.lower(): value for name, value in headers.items()}
        if not self._is_ours(f"http://{headers.get('host', '')}"):
            return "This is not the address of the viewer."
        origin = headers.get("origin")
        if origin is not None and not self._is_ours(origin):
            return "Pages of other sites may not use the viewer."
        if not any(hmac.compare_digest(shown, self.token) for shown in self._shown(path, headers)):
            return "Open the whole address that mocapdb printed, with its token."
        return None

    def carries_token(self, path: str) -> bool:
        """Return whether an address has the token, which is then kept as a cookie."""
        return self.token in parse_qs(urlsplit(path).query).get("token", [])

    @property
    def cookie_header(self) -> str:
        """The header that makes a browser keep the token, for our own pages alone."""
        return f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def _is_ours(self, address: str) -> bool:
        """Return whether an address with scheme, host and port leads to this server by its name."""
        try:
            parts = urlsplit(address)
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        return parts.scheme == "http" and port == self.port and self._is_our_name(name)

    def _is_our_name(self, name: str) -> bool:
        if self.host not in EVERYWHERE:
            return name in (LOOPBACK if self.host in LOOPBACK else (self.host,))
        try:
            ipaddress.ip_address(name)
        except ValueError:  # only this machine's own names: another site's may point here
            return name in ("localhost", socket.gethostname().lower())
        return True

    def _shown(self, path: str, headers: Mapping[str, str]) -> list[str]:
        shown = list(parse_qs(urlsplit(path).query).get("token", []))
        try:
            cookies = SimpleCookie(headers.get("cookie", ""))
        except CookieError:
            return shown
        return [*shown, *([cookies[self.cookie].value] if self.cookie in cookies else [])]


@contextmanager
def guarding(gate: Gate, pictures: Asked) -> Iterator[None]:
    """Put a gate before the server that viser starts in this block.

    viser answers requests itself and has no place for a check of one's own: the function by which
    it starts to listen is replaced meanwhile. `Gate.is_shut` says afterwards whether it was called.

    Parameters
    ----------
    gate : Gate
    pictures : callable
        Given the address of a request that is let in; returns the SVG that is there once it is
        made, or None where viser is to answer.
    """
    import websockets.asyncio.server

    server: Any = websockets.asyncio.server
    serve = server.serve

    def guarded(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        def answer(connection: Any, request: Any) -> Any:
            why = gate.refusal(request.path, dict(request.headers.raw_items()))
            if why is not None:
                return _response(HTTPStatus.FORBIDDEN, f"{why}\n", "text/plain")
            picture = pictures(request.path)
            if picture is not None:
                return _picture(picture)
            response = process_request(connection, request) if process_request else None
            if response is not None:
                if gate.carries_token(request.path):
                    response.headers["Set-Cookie"] = gate.cookie_header
                if "Connection" not in response.headers:
                    response.headers["Connection"] = "close"
            return response

        gate.is_shut = True
        return serve(*arguments, process_request=answer, **options)

    server.serve = guarded
    try:
        yield
    finally:
        server.serve = serve


async def _picture(made: Future[str | None]) -> Any:
    """Return the response with a picture, which may have to be made."""
    svg = await asyncio.wrap_future(made)
    if svg is None:
        return _response(HTTPStatus.NOT_FOUND, "There is no such picture.\n", "text/plain")
    return _response(
        HTTPStatus.OK, svg, "image/svg+xml",
        {
            "Cache-Control": f"private, max-age={PICTURES_KEPT_S}, immutable",
            "Content-Security-Policy": "default-src 'none'",  # no script, should one get into it
        },
    )  # fmt: skip


def _response(
    status: HTTPStatus, text: str, kind: str, more: Mapping[str, str] | None = None
) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    body = text.encode()
    headers = Headers(
        {
            "Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body)),
            "X-Content-Type-Options": "nosniff",
            "Connection": "close",  # websockets answers one request of a connection, and no other
            **(more or {}),
        }
    )  # fmt: skip
    return Response(status, status.phrase, headers, body)
