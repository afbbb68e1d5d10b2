"""A Viser server behind the checks of access.py: the one place that reaches into how Viser starts its server."""

from __future__ import annotations

import contextlib
import gzip
import io
import logging
import threading
from collections.abc import Callable, Generator
from http import HTTPStatus
from typing import Any

import viser
import websockets.asyncio.server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from dashboards.panels.markup import html
from dashboards.viser_app.access import Access, Granted, Refused, TokenGiven, is_loopback
from workbench.errors import Failed

Process = Callable[[ServerConnection, Request], Any]

_STARTING = threading.Lock()


class CannotGuard(Failed):
    """This Viser starts its server in a way that goes past the checks: better no dashboard than an open one."""

    def __init__(self) -> None:
        super().__init__(
            f"Viser {viser.__version__} starts its server in a way that the dashboard's checks do not reach. "
            "Install the version that constraints.txt names."
        )


def guarded_server(access: Access, *, port: int, label: str, head: str = "") -> viser.ViserServer:
    """A running Viser server that asks `access` before it answers anything, pages and WebSockets alike.

    Args:
        access: the rules.
        port: 0 for any free one.
        label: the page's title in Viser's own messages.
        head: a script that runs in the page before Viser's own.

    Raises:
        CannotGuard: the checks could not be put in place; nothing is left running.
    """
    with contextlib.redirect_stdout(io.StringIO()):
        with _each_request_checked(access, head) as places:
            server = viser.ViserServer(host=access.host, port=port, label=label, verbose=False)
        if not places:
            server.stop()
            raise CannotGuard
    return server


@contextlib.contextmanager
def _each_request_checked(access: Access, head: str) -> Generator[list[str]]:
    """While it is open, servers that Viser starts check each request; yields where that was done.

    Viser offers no way to see a request before it is answered. It does start its server by
    `websockets.asyncio.server.serve(..., process_request=...)`, the hook that websockets has for this; for the moment
    of starting, that name stands for one that puts our check before Viser's. Servers of others are left alone.
    """
    original = websockets_server.serve
    places: list[str] = []
    # Headers and addresses hold the token; websockets writes both into its log at level DEBUG, whoever asks for that.
    quiet = logging.getLogger("websockets.server.dashboard")
    quiet.setLevel(logging.INFO)

    def serve(handler: Any, *args: Any, **options: Any) -> Any:
        module = str(getattr(handler, "__module__", ""))
        if not module.startswith("viser."):
            return original(handler, *args, **options)
        places.append(module)
        options["process_request"] = _checked(access, options.get("process_request"), head)
        options["logger"] = quiet
        return original(handler, *args, **options)

    with _STARTING:
        websockets_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield places
        finally:
            websockets_server.serve = original


def _checked(access: Access, answer: Process | None, head: str) -> Process:
    """Viser's answer to a request, given only where access is granted."""
    pages: dict[bytes, bytes] = {}

    def process(connection: ServerConnection, request: Request) -> Any:
        page = not _opens_websocket(request)
        verdict = access.judge(request.path, request.headers, page=page)
        if isinstance(verdict, Refused):
            return _kept_private(connection.respond(verdict.status, verdict.words + "\n"))
        if isinstance(verdict, Granted):
            if page and is_loopback(str(connection.remote_address[0])):
                request.headers.pop("Accept-Encoding", None)  # packing takes longer than the way within a machine
            response = answer(connection, request) if answer is not None else None
            if not isinstance(response, Response):
                return response
            _put_first(response, head, pages)
            return _kept_private(response)
        return _handed_over(connection.respond(HTTPStatus.OK, _entrance(verdict.query)), verdict, access)

    return process


def _put_first(response: Response, script: str, pages: dict[bytes, bytes]) -> None:
    """Puts a script before all others of a page.

    Args:
        response: what Viser answers; left alone unless it is an HTML page.
        script: JavaScript.
        pages: pages that were changed before, by Viser's body: it always answers with the same.
    """
    given, packed = bytes(response.body or b""), response.headers.get("Content-Encoding") == "gzip"
    if not script or not response.headers.get("Content-Type", "").startswith("text/html"):
        return
    if given not in pages:
        page = gzip.decompress(given) if packed else given
        changed = page.replace(b"<head>", b"<head><script>" + script.encode() + b"</script>", 1)
        pages[given] = gzip.compress(changed, compresslevel=1) if packed else changed
    response.body = pages[given]
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(pages[given]))


def _opens_websocket(request: Request) -> bool:
    return any(value.strip().lower() == "websocket" for value in request.headers.get_all("Upgrade"))


def _entrance(query: str) -> str:
    """A page that goes on to the dashboard at once, from an address of its own: a strict cookie is then sent."""
    target = f"./?{query}"
    return html(
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta http-equiv="refresh" content="0;url={}">'
        '<title>LIOS workbench</title><a href="{}">Dashboard</a></html>\n',
        target,
        target,
    )


def _handed_over(response: Response, given: TokenGiven, access: Access) -> Response:
    """The entrance, with the token in a cookie that no script and no other website's request can use."""
    del response.headers["Content-Type"]
    response.headers["Content-Type"] = "text/html; charset=utf-8"
    response.headers["Set-Cookie"] = f"{given.cookie}={access.token}; Path=/; HttpOnly; SameSite=Strict"
    return _kept_private(response)


def _kept_private(response: Response) -> Response:
    """With headers that keep the address out of Referer and caches, and the page from other servers and frames."""
    response.headers["Referrer-Policy"] = "no-referrer"
    response.headers["Cache-Control"] = "no-store"
    response.headers["X-Content-Type-Options"] = "nosniff"
    response.headers["Content-Security-Policy"] = "connect-src 'self' blob: data:; frame-ancestors 'self'"
    return response
