"""A WebSocket relay in front of the Foxglove SDK's server: checks of clients, and the protocol's old name.

The SDK answers every web page that a browser shows, and knows the protocol by its new name alone: foxglove-sdk 0.30.3
refuses `foxglove.websocket.v1` with HTTP 400, for which npm's @foxglove/ws-protocol 0.8.0 asks, and Lichtblick before
its pull request 819 of December 2025; the rest of the protocol is the same. The relay takes both names, checks Host
and Origin, and is alone in trusting the certificate of the SDK's server, which no browser trusts.
"""

from __future__ import annotations

import asyncio
import ipaddress
import ssl
import threading
from collections.abc import Sequence
from contextlib import suppress
from http import HTTPStatus
from typing import final
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from workbench.errors import Failed, InputError

SDK = Subprotocol("foxglove.sdk.v1")
OLD = Subprotocol("foxglove.websocket.v1")
APPS = ("https://app.foxglove.dev",)
"""Origins of viewers in the browser that may connect without being named."""
DESKTOP_SCHEMES = ("file", "app", "lichtblick", "foxglove", "vscode-webview")
"""Schemes of the pages of desktop programs; no website can have one of them."""
PLAYBACK_STATE = 5
"""Opcode that the protocol did not have under its old name."""
MAX_REQUEST_BYTES = 1 << 20
START_S = 10.0
CLOSE_S = 0.5
"""Seconds that closing a connection waits for the other side: its reply may queue behind frames that are no longer
read."""


class CannotServe(InputError):
    """Nothing can listen there."""

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"Cannot listen on {host}:{port}: {reason}. Choose another --port (0 takes any free one).")


class RelayBroke(Failed):
    """The relay did not start in time."""

    def __init__(self) -> None:
        super().__init__(f"The viewers' server did not start within {START_S:.0f} s.")


@final
class Relay:
    """Listens for viewers and passes their frames to the SDK's server and back. Runs in its own thread.

    Args:
        host, port: where to listen; port 0 takes any free one.
        upstream_port: of the SDK's server on loopback.
        root_pem: the authority of its certificate.
        origins: further origins that may connect, such as "https://viewer.example.org".

    Raises:
        CannotServe: the address is in use or not of this machine.
    """

    def __init__(self, host: str, port: int, *, upstream_port: int, root_pem: bytes, origins: Sequence[str]) -> None:
        self._host, self._port = host, port
        self._upstream = f"wss://localhost:{upstream_port}"
        self._trust = ssl.create_default_context(cadata=root_pem.decode("ascii"))
        self._origins = (*APPS, *(origin.rstrip("/").lower() for origin in origins))
        self._loop = asyncio.new_event_loop()
        self._started = threading.Event()
        self._stop = asyncio.Event()
        self._trouble: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="lios-viewers", daemon=True)
        self._thread.start()
        if not self._started.wait(START_S):
            raise RelayBroke
        if self._trouble is not None:
            self._thread.join()
            raise CannotServe(host, port, self._trouble.strerror or str(self._trouble)) from self._trouble

    @property
    def port(self) -> int:
        return self._port

    def close(self) -> None:
        """Ends all connections; safe to call twice."""
        with suppress(RuntimeError):  # the loop is closed already
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join()

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._serve())

    async def _serve(self) -> None:
        try:
            server = await serve(
                self._pass_frames,
                self._host,
                self._port,
                subprotocols=[SDK, OLD],
                process_request=self._checked,
                max_size=MAX_REQUEST_BYTES,
                compression=None,
                close_timeout=CLOSE_S,
            )
        except OSError as error:
            self._trouble = error
            self._started.set()
            return
        async with server:
            self._port = next(iter(server.sockets)).getsockname()[1]
            self._started.set()
            await self._stop.wait()

    def _checked(self, connection: ServerConnection, request: Request) -> Response | None:
        """A refusal, or None where the viewer may connect."""
        if not all(is_allowed(origin, self._origins) for origin in request.headers.get_all("Origin")):
            words = "This page may not connect. lios serve --origin allows the origin of another viewer.\n"
            return connection.respond(HTTPStatus.FORBIDDEN, words)
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or not names_this_server(hosts[0], self._host):
            return connection.respond(HTTPStatus.FORBIDDEN, "Use the address that lios printed, or an IP address.\n")
        return None

    async def _pass_frames(self, viewer: ServerConnection) -> None:
        try:
            upstream = await connect(
                self._upstream,
                ssl=self._trust,
                subprotocols=[SDK],
                max_size=None,
                compression=None,
                proxy=None,
                close_timeout=CLOSE_S,
            )
        except (OSError, InvalidHandshake):
            await viewer.close(1011, "the log's server is gone")
            return
        async with upstream:
            directions = [
                asyncio.ensure_future(_copy(upstream, viewer, old=viewer.subprotocol == OLD)),
                asyncio.ensure_future(_copy(viewer, upstream, old=False)),
            ]
            await asyncio.wait(directions, return_when=asyncio.FIRST_COMPLETED)
            for direction in directions:
                direction.cancel()
            await asyncio.gather(*directions, return_exceptions=True)
        await viewer.close()


async def _copy(
    source: ServerConnection | ClientConnection, target: ServerConnection | ClientConnection, *, old: bool
) -> None:
    with suppress(ConnectionClosed):
        async for frame in source:
            if not (old and isinstance(frame, bytes) and frame[:1] == bytes([PLAYBACK_STATE])):
                await target.send(frame)


def is_allowed(origin: str, origins: Sequence[str]) -> bool:
    """Whether the page of an origin may connect: a named one, a page of this machine's servers, or a desktop program.

    Args:
        origin: the field Origin of a request; native programs send none and are not asked.
        origins: allowed origins in small letters, without a slash at the end.
    """
    wanted = origin.strip().lower()
    if wanted in origins:
        return True
    try:
        parts = urlsplit(wanted)
        return parts.scheme in DESKTOP_SCHEMES or (
            parts.scheme in ("http", "https") and _is_local(parts.hostname or "")
        )
    except ValueError:
        return False


def names_this_server(host: str, listening: str) -> bool:
    """Whether a request's Host is an address rather than a name that anyone could have pointed at this machine."""
    try:
        name = urlsplit(f"//{host.strip().lower()}").hostname or ""
    except ValueError:
        return False
    if name == listening.lower() or name == "localhost":
        return True
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        return False
    return address.is_loopback or not _is_local(listening)


def _is_local(name: str) -> bool:
    if name == "localhost":
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False
