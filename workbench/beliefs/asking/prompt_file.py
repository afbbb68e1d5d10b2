"""Prompt files: how a language model is asked where things are, as text that can be edited.

Lines "key: value", a line "---", and then the prompt, in which {item}, {containers} and {seen} are filled in.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Final

import msgspec

from workbench.errors import FileMissing, MalformedFile
from workbench.files import plain_file_name

SUFFIX: Final = ".prompt"
RULE: Final = "---"
MAX_BYTES: Final = 1 << 16
KEYS: Final = ("model", "endpoint", "key_env", "temperature", "max_tokens", "timeout_s")
ITEM, CONTAINERS, SEEN = "{item}", "{containers}", "{seen}"


class Prompt(msgspec.Struct, frozen=True, kw_only=True):
    """A prompt and what else shapes the answer; the part that a log keeps.

    Attributes:
        stem: of the file's name.
        model: as the endpoint calls it.
        text: with {item}, {containers} and, where answers should follow what was seen, {seen}.
    """

    stem: str
    model: str
    text: str
    temperature: float = 0.0
    max_tokens: int = 1000

    @property
    def name(self) -> str:
        """The estimator's name, with a hash of all that shapes the answer."""
        shaping = (self.model, self.text, self.temperature, self.max_tokens)
        return f"chat-{self.stem}@{hashlib.sha256(repr(shaping).encode()).hexdigest()[:8]}"

    @property
    def names_alone(self) -> bool:
        """Whether what was seen is no part of the question."""
        return SEEN not in self.text


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatEndpoint:
    """Where to ask; no part of it is in a log.

    Attributes:
        url: the base of an OpenAI-compatible service, such as http://127.0.0.1:11434/v1.
        key_env: the environment variable that holds the key; empty for none.
        timeout_s: the longest that one answer may take.
        file: the prompt file, for errors.
    """

    url: str
    key_env: str = ""
    timeout_s: float = 60.0
    file: str = ""


def read_prompt(path: Path) -> tuple[Prompt, ChatEndpoint]:
    """Reads a prompt file.

    Raises:
        FileMissing: there is none.
        MalformedFile: it lacks something, or holds something else.
    """
    try:
        data = path.read_bytes()[: MAX_BYTES + 1]
    except (FileNotFoundError, IsADirectoryError):
        raise FileMissing(path) from None
    except OSError as error:
        raise MalformedFile(path, f"it cannot be read ({error.strerror})", "Check its permissions") from None
    if len(data) > MAX_BYTES:
        raise MalformedFile(path, f"it is longer than {MAX_BYTES} bytes", "Shorten the prompt")
    try:
        text = data.decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise MalformedFile(path, "it is not UTF-8 text", "Save it as UTF-8") from None
    head, rule, body = text.partition(f"\n{RULE}\n")
    if not rule:
        raise MalformedFile(path, f"it has no line {RULE!r} between its settings and the prompt", "Put one in")
    return _checked(path, _settings(path, head), body.strip())


def _settings(path: Path, head: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for number, line in enumerate(head.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        key, colon, value = line.partition(":")
        key = key.strip()
        if not colon or key not in KEYS:
            raise MalformedFile(path, f"line {number} is {line.strip()[:60]!r}", f"Its keys are {', '.join(KEYS)}")
        found[key] = value.strip()
    return found


def _checked(path: Path, given: Mapping[str, str], body: str) -> tuple[Prompt, ChatEndpoint]:
    for key in ("model", "endpoint"):
        if not given.get(key):
            raise MalformedFile(path, f"it has no {key}", f"Add a line '{key}: ...'")
    if ITEM not in body or CONTAINERS not in body:
        raise MalformedFile(path, f"its prompt does not use {ITEM} and {CONTAINERS}", "Put both in")
    url = given["endpoint"].rstrip("/")
    if not url.startswith(("http://", "https://")):
        raise MalformedFile(path, f"its endpoint is {url[:60]!r}", "Give http://HOST:PORT/v1 or https://HOST/v1")
    prompt = Prompt(
        stem=plain_file_name(path.name.removesuffix(SUFFIX)) or "prompt",
        model=given["model"],
        text=body,
        temperature=_number(path, given, "temperature", 0.0),
        max_tokens=int(_number(path, given, "max_tokens", 1000, minimum=1)),
    )
    key_env = given.get("key_env", "OPENAI_API_KEY" if url.startswith("https://") else "")
    timeout_s = _number(path, given, "timeout_s", 60.0, minimum=0.1)
    return prompt, ChatEndpoint(url=url, key_env=key_env, timeout_s=timeout_s, file=path.name)


def _number(path: Path, given: Mapping[str, str], key: str, default: float, *, minimum: float = 0.0) -> float:
    text = given.get(key, "")
    try:
        value = float(text) if text else default
    except ValueError:
        value = float("nan")
    if not isfinite(value) or not minimum <= value <= 1e6:
        raise MalformedFile(path, f"its {key} is {text[:40]!r}", f"Give a number of at least {minimum:g}")
    return value
