"""Who may enter: a token in the address, then a cookie; foreign hosts and origins stay out.

viser asks nobody for anything. The gate sits in front of it on the same port, as a wrapper around
the function with which the web server answers a request before any WebSocket is opened.
"""

import hmac
from collections.abc import Callable
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

Answer = Callable[[Any, Request], Response | None]
"""Answers a request on a connection; None lets a WebSocket be opened."""

_own_hosts = frozenset({"127.0.0.1", "localhost"})
_hint = "Open the link with ?token=... that was printed when the robot was started."


class Gate:
    """Lets a request through to `inside` if it comes from this page and knows the token."""

    def __init__(self, token: str, inside: Answer) -> None:
        self._token = token
        self._inside = inside

    def __call__(self, connection: Any, request: Request) -> Response | None:
        """Refuse with 401 or 403, set the cookie with 303, or pass on."""
        host = _only(request.headers, "Host")
        if host is None or host.rsplit(":", 1)[0] not in _own_hosts:
            return _refuse(HTTPStatus.FORBIDDEN, "This page answers to 127.0.0.1 alone.")
        if not _same_origin(request.headers, host):
            return _refuse(HTTPStatus.FORBIDDEN, "Another site may not talk to the robot.")
        cookie = f"incognita-{connection.local_address[1]}"
        if self._is_token(_cookie_value(request.headers, cookie)):
            return _sealed(self._inside(connection, request))
        if self._is_token(_token_in_address(request.path)):
            return _welcome(cookie, self._token)
        return _refuse(HTTPStatus.UNAUTHORIZED, _hint)

    def _is_token(self, candidate: str) -> bool:
        return hmac.compare_digest(candidate.encode(), self._token.encode())


def _only(headers: Headers, name: str) -> str | None:
    """The header's value; None if it is missing or stands more than once."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else None


def _same_origin(headers: Headers, host: str) -> bool:
    """Browsers name the origin of every WebSocket; programs without one need the cookie anyway."""
    origins = headers.get_all("Origin")
    return all(urlsplit(origin).netloc == host for origin in origins)


def _cookie_value(headers: Headers, name: str) -> str:
    try:
        cookies = SimpleCookie("; ".join(headers.get_all("Cookie")))
    except CookieError:
        return ""
    return cookies[name].value if name in cookies else ""


def _token_in_address(path: str) -> str:
    return parse_qs(urlsplit(path).query).get("token", [""])[0]


def _welcome(cookie: str, token: str) -> Response:
    """Keep the token in a cookie and take it out of the address bar."""
    headers = Headers()
    headers["Location"] = "/"
    headers["Set-Cookie"] = f"{cookie}={token}; HttpOnly; SameSite=Strict; Path=/"
    return _response(HTTPStatus.SEE_OTHER, headers, b"")


def _refuse(status: HTTPStatus, reason: str) -> Response:
    return _response(
        status, Headers({"Content-Type": "text/plain; charset=utf-8"}), reason.encode()
    )


def _response(status: HTTPStatus, headers: Headers, body: bytes) -> Response:
    headers["Content-Length"] = str(len(body))
    headers["Referrer-Policy"] = "no-referrer"
    return Response(status.value, status.phrase, headers, body)


def _sealed(response: Response | None) -> Response | None:
    """No other page may frame this one: a hidden frame could make a person click STOP or Send."""
    if response is not None:
        response.headers["X-Frame-Options"] = "DENY"
    return response
