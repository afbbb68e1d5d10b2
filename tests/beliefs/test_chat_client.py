"""Requests to an endpoint: one line for each way in which it can fail, and the key where it belongs."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest
from chat_server import ChatServer, Reply, chat_server, completion, held

from workbench.beliefs.asking.chat_client import MAX_REPLY_BYTES, complete
from workbench.beliefs.asking.prompt_file import ChatEndpoint, Prompt
from workbench.beliefs.guarded_estimator import EstimatorFailed

PROMPT = Prompt(stem="rooms", model="toy-1", text="{item} {containers}", temperature=0.5, max_tokens=7)


def at(server: ChatServer | str, *, timeout_s: float = 60.0, key_env: str = "") -> ChatEndpoint:
    url = server if isinstance(server, str) else server.url
    return ChatEndpoint(url=url, timeout_s=timeout_s, key_env=key_env, file="rooms.prompt")


def test_it_sends_what_the_prompt_says_and_returns_the_text() -> None:
    with chat_server(lambda _: completion("in the fridge")) as server:
        assert complete(PROMPT, at(server), "Where?") == "in the fridge"
    assert server.asked == [
        {
            "model": "toy-1",
            "messages": [{"role": "user", "content": "Where?"}],
            "temperature": 0.5,
            "max_tokens": 7,
        }
    ]


def always(status: int, body: bytes = b"", **headers: str) -> Callable[[dict[str, Any]], Reply]:
    return lambda _: (status, {name.replace("_", "-"): value for name, value in headers.items()}, body)


FAULTS: dict[str, tuple[Callable[[dict[str, Any]], Reply], str]] = {
    "no JSON": (always(200, b"<html>"), "does not answer with a chat completion"),
    "no choices": (always(200, b'{"choices": []}'), "does not answer with a chat completion"),
    "no text": (
        always(200, json.dumps({"choices": [{"message": {"content": None}}]}).encode()),
        "does not answer with",
    ),
    "nested": (always(200, b"[" * 100_000), "does not answer with"),
    "no key": (always(401), r"refuses the key \(401\)\. Name its key by key_env in rooms\.prompt"),
    "forbidden": (always(403), "refuses the key"),
    "too many": (always(429, Retry_After="0"), r"turns requests away as too many \(429\)\. Try later"),
    "broken": (always(500, b"out of\nmemory\x1b[31m", Retry_After="0"), "status 500: out of memory"),
    "moved": (always(307, Location="http://127.0.0.1:1/"), "status 307: nothing"),
    "endless": (always(200, b"x" * (MAX_REPLY_BYTES + 10)), f"more than {MAX_REPLY_BYTES} bytes"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_endpoint_is_one_line(fault: str) -> None:
    reply, words = FAULTS[fault]
    with chat_server(reply) as server, pytest.raises(EstimatorFailed, match=words) as told:
        complete(PROMPT, at(server), "Where?")
    assert_one_line(told.value)


def assert_one_line(error: EstimatorFailed) -> None:
    line = str(error)
    assert line.startswith("estimator 'chat-rooms@")
    assert "\n" not in line
    assert line.isprintable()


def test_an_answer_that_comes_too_late_is_one_line() -> None:
    given_up = threading.Event()
    words = r"did not answer within 0\.3 s. Raise timeout_s in rooms\.prompt"
    with chat_server(held(given_up)) as server:
        try:
            with pytest.raises(EstimatorFailed, match=words) as told:
                complete(PROMPT, at(server, timeout_s=0.3), "Where?")
        finally:
            given_up.set()
    assert_one_line(told.value)


def test_an_endpoint_that_is_down_is_one_line() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{taken.getsockname()[1]}/v1"
        with pytest.raises(
            EstimatorFailed, match=r"cannot be reached \(.*\)\. Start it, or correct endpoint in rooms"
        ):
            complete(PROMPT, at(url), "Where?")


def test_what_does_not_speak_http_is_one_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(1 << 16)
                connection.sendall(b"SSH-2.0-OpenSSH_9.6\r\n\r\n")

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(EstimatorFailed, match="does not speak HTTP"):
            complete(PROMPT, at(f"http://127.0.0.1:{server.getsockname()[1]}"), "Where?")


def test_a_reply_that_dribbles_does_not_hold_it_beyond_the_limit() -> None:
    """Whoever waits for all of it gets a reply, which is not a chat completion."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def dribble() -> None:
            connection, _ = server.accept()
            with connection, suppress(OSError):
                connection.recv(1 << 16)
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 400\r\n\r\n")
                for _ in range(400):
                    connection.sendall(b"x")
                    time.sleep(0.05)

        threading.Thread(target=dribble, daemon=True).start()
        with pytest.raises(EstimatorFailed, match=r"did not answer within 0\.4 s"):
            complete(PROMPT, at(f"http://127.0.0.1:{server.getsockname()[1]}", timeout_s=0.4), "Where?")


def test_a_request_that_is_turned_away_for_the_moment_is_made_again() -> None:
    replies = iter([(503, {"Retry-After": "0"}, b""), (429, {"Retry-After": "0"}, b""), completion("there")])
    with chat_server(lambda _: next(replies)) as server:
        assert complete(PROMPT, at(server), "Where?") == "there"
    assert len(server.asked) == 3


def test_the_key_is_sent_where_it_is_named_and_said_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OUR_KEY", "sk-secret")
    with chat_server(lambda _: completion("x")) as server:
        complete(PROMPT, at(server, key_env="OUR_KEY"), "Where?")
        complete(PROMPT, at(server), "Where?")
    assert server.keys == ["Bearer sk-secret", ""]
    with chat_server(always(401, b"sk-secret")) as server, pytest.raises(EstimatorFailed) as told:
        complete(PROMPT, at(server, key_env="OUR_KEY"), "Where?")
    assert "sk-secret" not in str(told.value)
    assert "Set OUR_KEY to a key" in str(told.value)


def test_a_key_that_no_header_can_carry_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OUR_KEY", "a\nb")
    with chat_server() as server, pytest.raises(EstimatorFailed, match="OUR_KEY holds no key"):
        complete(PROMPT, at(server, key_env="OUR_KEY"), "Where?")
    assert server.asked == []
