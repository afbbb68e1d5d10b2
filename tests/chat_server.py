"""A small OpenAI-compatible endpoint on loopback, for tests: it answers as told, and keeps what it is asked."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

Reply = tuple[int, dict[str, str], bytes]
"""Status, headers and body."""


@dataclass(eq=False)
class ChatServer:
    """A running endpoint.

    Attributes:
        reply: what it answers to a request's body.
        asked: the bodies of all requests so far. keys: their Authorization headers.
        url: its base.
    """

    reply: Callable[[dict[str, Any]], Reply]
    url: str = ""
    asked: list[dict[str, Any]] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)


def completion(text: str) -> Reply:
    """A chat completion with that text."""
    body = {"choices": [{"index": 0, "message": {"role": "assistant", "content": text}}]}
    return 200, {"Content-Type": "application/json"}, json.dumps(body).encode()


def by_name_length(body: dict[str, Any]) -> Reply:
    """A model with opinions: a container's probability follows from its name's and the question's length alone."""
    question = body["messages"][0]["content"]
    containers = re.findall(r"^(\S+\|\S+): \w+ in \w+$", question, flags=re.MULTILINE)
    opinion = {c: round((7 * len(c) + 3 * k + len(question)) % 17 / 17, 3) for k, c in enumerate(containers)}
    return completion(f"Certainly!\n```json\n{json.dumps(opinion)}\n```")


@contextmanager
def chat_server(reply: Callable[[dict[str, Any]], Reply] = by_name_length) -> Generator[ChatServer]:
    """Serves on a free port of 127.0.0.1 until the block ends."""
    server = ChatServer(reply)

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            server.asked.append(body)
            server.keys.append(self.headers.get("Authorization", ""))
            status, headers, data = server.reply(body) if self.path == "/v1/chat/completions" else (404, {}, b"")
            try:
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name, value)
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)
            except OSError:
                pass  # the client has given up

        def log_message(self, format: str, *args: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as http:
        server.url = f"http://127.0.0.1:{http.server_address[1]}/v1"
        thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        thread.start()
        try:
            yield server
        finally:
            http.shutdown()
            thread.join()


def held(until: threading.Event) -> Callable[[dict[str, Any]], Reply]:
    """A reply that comes late: when somebody sets an event, or after a minute."""

    def reply(body: dict[str, Any]) -> Reply:
        until.wait(60)
        return by_name_length(body)

    return reply


def write_prompt(path: Path, server: ChatServer | str, *, seen: bool = False, more: str = "") -> Path:
    """A prompt file for an endpoint.

    Args:
        seen: the question says what was seen.
        more: further lines of its head.
    """
    url = server if isinstance(server, str) else server.url
    told = "Seen:\n{seen}\n" if seen else ""
    path.write_text(
        f"model: toy-1\nendpoint: {url}\n{more}---\nWhere is a {{item}}?\n\n{{containers}}\n\n{told}Answer in JSON.\n"
    )
    return path
