"""One request to an OpenAI-compatible endpoint (POST /chat/completions), with the standard library alone.

Redirects are not followed, since the key would go with them; the answer is bounded in size and time.
"""

from __future__ import annotations

import http.client
import json
import os
import ssl
import time
from contextlib import closing
from typing import Any
from urllib.parse import urlsplit

from workbench.beliefs.asking.prompt_file import ChatEndpoint, Prompt
from workbench.beliefs.guarded_estimator import EstimatorFailed

MAX_REPLY_BYTES = 1 << 20
MAX_TRIES = 3
"""Of a request that the endpoint turns away for the moment (429, 5xx)."""
USUAL_WAIT_S, MAX_WAIT_S = 2.0, 30.0
"""Between two tries, whatever Retry-After says."""
BLOCK = 1 << 16


def complete(prompt: Prompt, endpoint: ChatEndpoint, question: str) -> str:
    """The text of the first choice that the model answers with.

    Raises:
        EstimatorFailed: down, slow, refused, or something else than a chat completion; one line says which.
    """
    deadline = time.monotonic() + endpoint.timeout_s
    body = json.dumps(
        {
            "model": prompt.model,
            "messages": [{"role": "user", "content": question}],
            "temperature": prompt.temperature,
            "max_tokens": prompt.max_tokens,
        }
    ).encode()
    tries = 1
    status, wait_s, reply = _post(prompt, endpoint, body, deadline)
    while (status == 429 or status >= 500) and tries < MAX_TRIES and time.monotonic() + wait_s < deadline:
        time.sleep(wait_s)
        tries += 1
        status, wait_s, reply = _post(prompt, endpoint, body, deadline)
    if status != 200:
        raise _refused(prompt, endpoint, status, reply)
    return _content(prompt, endpoint, reply)


def _post(prompt: Prompt, endpoint: ChatEndpoint, body: bytes, deadline: float) -> tuple[int, float, bytes]:
    """Status, seconds to wait before another try, and body of one reply."""
    try:
        parts = urlsplit(endpoint.url)
        left = max(0.1, deadline - time.monotonic())
        kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        with closing(kind(parts.hostname or "", parts.port, timeout=left)) as connection:
            connection.request("POST", f"{parts.path}/chat/completions", body, _headers(prompt, endpoint))
            reply = connection.getresponse()
            data = _read(reply, connection, deadline)
            return reply.status, _wait_s(reply.getheader("Retry-After")), data
    except TimeoutError:
        raise _failed(
            prompt, endpoint, f"did not answer within {endpoint.timeout_s:g} s", "Raise timeout_s in"
        ) from None
    except ssl.SSLError as error:
        raise _failed(prompt, endpoint, f"offers no valid TLS ({error.reason})", "Correct endpoint in") from None
    except OSError as error:
        why = f"cannot be reached ({error.strerror or error})"
        raise _failed(prompt, endpoint, why, "Start it, or correct endpoint in") from None
    except (http.client.HTTPException, ValueError) as error:
        why = f"does not speak HTTP ({type(error).__name__})"
        raise _failed(prompt, endpoint, why, "Correct endpoint in") from None


def _read(reply: http.client.HTTPResponse, connection: http.client.HTTPConnection, deadline: float) -> bytes:
    """The body, up to MAX_REPLY_BYTES and to the deadline: a server that sends slowly cannot stall the caller."""
    blocks: list[bytes] = []
    while sum(map(len, blocks)) <= MAX_REPLY_BYTES:
        left = deadline - time.monotonic()
        if left <= 0:
            raise TimeoutError
        if connection.sock is not None:
            connection.sock.settimeout(left)
        block = reply.read1(BLOCK)
        if not block:
            break
        blocks.append(block)
    return b"".join(blocks)


def _headers(prompt: Prompt, endpoint: ChatEndpoint) -> dict[str, str]:
    headers = {"Content-Type": "application/json", "Accept": "application/json"}
    if endpoint.key_env:
        key = os.environ.get(endpoint.key_env, "").strip()
        if not key.isascii() or not key.isprintable():
            raise EstimatorFailed(
                prompt.name, f"the environment variable {endpoint.key_env} holds no key", "Set it again"
            )
        if key:
            headers["Authorization"] = f"Bearer {key}"
    return headers


def _refused(prompt: Prompt, endpoint: ChatEndpoint, status: int, reply: bytes) -> EstimatorFailed:
    if status in (401, 403):
        fix = (
            f"Set {endpoint.key_env} to a key" if endpoint.key_env else f"Name its key by key_env in {endpoint.file}"
        )
        return EstimatorFailed(prompt.name, f"{endpoint.url} refuses the key ({status})", fix)
    if status == 429:
        why = f"{endpoint.url} turns requests away as too many (429)"
        return EstimatorFailed(prompt.name, why, "Try later: answers so far are kept")
    said = " ".join(reply[:2000].decode("utf-8", "replace").split())[:120]
    printable = "".join(ch for ch in said if ch.isprintable())
    return _failed(
        prompt, endpoint, f"answers with status {status}: {printable or 'nothing'}", "Correct model or endpoint in"
    )


def _content(prompt: Prompt, endpoint: ChatEndpoint, reply: bytes) -> str:
    if len(reply) > MAX_REPLY_BYTES:
        raise _failed(prompt, endpoint, f"answers with more than {MAX_REPLY_BYTES} bytes", "Lower max_tokens in")
    try:
        made: Any = json.loads(reply)
        content: object = made["choices"][0]["message"]["content"]
    except (ValueError, KeyError, IndexError, TypeError, RecursionError):
        content = None
    if not isinstance(content, str):
        raise _failed(prompt, endpoint, "does not answer with a chat completion", "Correct endpoint in")
    return content


def _failed(prompt: Prompt, endpoint: ChatEndpoint, why: str, fix: str) -> EstimatorFailed:
    return EstimatorFailed(prompt.name, f"{endpoint.url} {why}", f"{fix} {endpoint.file}")


def _wait_s(retry_after: str | None) -> float:
    """What Retry-After says in seconds, at most MAX_WAIT_S; USUAL_WAIT_S where it is absent or a date."""
    is_seconds = (
        retry_after is not None and retry_after.isascii() and retry_after.isdecimal() and len(retry_after) < 6
    )
    return min(MAX_WAIT_S, float(retry_after)) if is_seconds and retry_after else USUAL_WAIT_S
