"""A web server on loopback for tests: it sends ranges, and counts requests and bytes; it can also behave badly."""

from __future__ import annotations

import re
import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path


@dataclass
class WebServer:
    """What it serves, how, and what it has served.

    Attributes:
        ranges: whether it sends parts of files, and says so.
        breaks_at: it closes the connection at this byte of a file.
        status: it answers all requests with this error.
        held_until: answers about files wait until so many are waiting at the same time, or 60 s.
        bytes_sent: bytes of files, counted before they go out, so that a client that has them finds them counted.
        most_at_once: how many requests were open at the same time.
    """

    folder: Path
    port: int = 0
    ranges: bool = True
    breaks_at: int | None = None
    status: int | None = None
    held_until: int = 0
    requests: int = 0
    bytes_sent: int = 0
    at_once: int = 0
    most_at_once: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)
    enough: threading.Event = field(default_factory=threading.Event)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"


class _Quiet(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128

    def handle_error(self, request: object, client_address: object) -> None:
        """A client that went away is no news."""


class _Handler(BaseHTTPRequestHandler):
    told: WebServer
    protocol_version = "HTTP/1.1"

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def do_GET(self) -> None:
        self._answer(body=True)

    def log_message(self, format: str, *args: object) -> None:
        """Says nothing."""

    def _answer(self, *, body: bool) -> None:
        with self.told.lock:
            self.told.requests += 1
            self.told.at_once += 1
            self.told.most_at_once = max(self.told.most_at_once, self.told.at_once)
            if self.told.at_once >= self.told.held_until:
                self.told.enough.set()
        try:
            if self.told.held_until and Path(self.path).suffix:
                self.told.enough.wait(60)
            self._send(body=body)
        finally:
            with self.told.lock:
                self.told.at_once -= 1

    def _send(self, *, body: bool) -> None:
        path = self.told.folder / self.path.strip("/")
        if self.told.status is not None or not path.exists():
            self.send_response(self.told.status or 404)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        if path.is_dir():
            names = sorted(p.name + "/" * p.is_dir() for p in path.iterdir())
            page = "".join(f'<a href="{name}">{name}</a>' for name in names).encode()
            self._head(200, len(page), "text/html")
            if body:
                self.wfile.write(page)
            return
        self._send_file(path, body=body)

    def _send_file(self, path: Path, *, body: bool) -> None:
        size = path.stat().st_size
        asked = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", "")) if self.told.ranges else None
        start = int(asked[1]) if asked else 0
        end = min(int(asked[2]) + 1 if asked and asked[2] else size, size)
        content_range = f"bytes {start}-{end - 1}/{size}"
        self._head(206 if asked else 200, end - start, "application/octet-stream", content_range)
        if not body:
            return
        with path.open("rb") as stream:
            stream.seek(start)
            data = stream.read(end - start)
        if self.told.breaks_at is not None and end > self.told.breaks_at:
            data = data[: max(self.told.breaks_at - start, 0)]
            self.close_connection = True
        with self.told.lock:
            self.told.bytes_sent += len(data)
        self.wfile.write(data)

    def _head(self, status: int, length: int, kind: str, content_range: str = "") -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(length))
        self.send_header("Accept-Ranges", "bytes" if self.told.ranges else "none")
        if status == 206:
            self.send_header("Content-Range", content_range)
        self.end_headers()


@contextmanager
def web_server(folder: Path) -> Generator[WebServer]:
    """Serves a folder, and lists it and those in it as pages of links."""
    told = WebServer(folder)

    server = _Quiet(("127.0.0.1", 0), type("_Handler", (_Handler,), {"told": told}))
    told.port = server.server_address[1]
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    try:
        yield told
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
