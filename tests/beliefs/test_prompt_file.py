"""Prompt files: what they say, and one line for each that says something else."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.beliefs.asking.prompt_file import MAX_BYTES, read_prompt
from workbench.errors import FileMissing, MalformedFile

HEAD = "model: m\nendpoint: http://127.0.0.1:1/v1\n"
BODY = "Where is {item}?\n{containers}"


def written(folder: Path, text: str, name: str = "rooms.prompt") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


def test_a_prompt_is_read_with_where_to_ask(tmp_path: Path) -> None:
    more = "# by hand\ntemperature: 0.3\nmax_tokens: 50\ntimeout_s: 2.5\nkey_env: OURS\n"
    prompt, endpoint = read_prompt(written(tmp_path, f'{HEAD}{more}---\n{BODY} as {{"a|1": 1}}\n'))
    assert (prompt.stem, prompt.model, prompt.temperature, prompt.max_tokens) == ("rooms", "m", 0.3, 50)
    assert prompt.text == BODY + ' as {"a|1": 1}'
    assert (endpoint.url, endpoint.timeout_s, endpoint.key_env) == ("http://127.0.0.1:1/v1", 2.5, "OURS")
    assert endpoint.file == "rooms.prompt"


def test_the_usual_key_goes_over_tls_alone(tmp_path: Path) -> None:
    assert read_prompt(written(tmp_path, f"{HEAD}---\n{BODY}"))[1].key_env == ""
    https = HEAD.replace("http://127.0.0.1:1", "https://example.org")
    assert read_prompt(written(tmp_path, f"{https}---\n{BODY}"))[1].key_env == "OPENAI_API_KEY"


def test_the_name_changes_with_all_that_shapes_the_answer_and_with_nothing_else(tmp_path: Path) -> None:
    def name(text: str) -> str:
        return read_prompt(written(tmp_path, text))[0].name

    plain = name(f"{HEAD}---\n{BODY}")
    assert plain.startswith("chat-rooms@")
    changed = {
        name(f"{HEAD}---\n{BODY}!"),
        name(f"{HEAD}temperature: 1\n---\n{BODY}"),
        name(f"{HEAD}max_tokens: 9\n---\n{BODY}"),
        name(HEAD.replace("model: m", "model: n") + f"---\n{BODY}"),
    }
    assert len(changed | {plain}) == 5
    assert name(HEAD.replace(":1/", ":2/") + f"timeout_s: 3\n---\n{BODY}") == plain


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{HEAD}{BODY}", "no line '---'"),
        (f"model: m\n---\n{BODY}", "it has no endpoint"),
        (f"endpoint: http://a/v1\n---\n{BODY}", "it has no model"),
        (f"{HEAD}colour: red\n---\n{BODY}", "line 3 is 'colour: red'. Its keys are model, endpoint"),
        (f"{HEAD}nothing\n---\n{BODY}", "line 3 is 'nothing'"),
        (f"{HEAD}temperature: hot\n---\n{BODY}", "its temperature is 'hot'"),
        (f"{HEAD}timeout_s: nan\n---\n{BODY}", "its timeout_s is 'nan'"),
        (f"{HEAD}max_tokens: 0\n---\n{BODY}", "its max_tokens is '0'"),
        (f"{HEAD}---\nWhere is it?", r"does not use \{item\} and \{containers\}"),
        (f"model: m\nendpoint: file:///etc/passwd\n---\n{BODY}", "its endpoint is 'file:///etc/passwd'"),
        (f"{HEAD}---\n{BODY}{'x' * MAX_BYTES}", "longer than"),
    ],
)
def test_what_is_no_prompt_is_one_line(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(MalformedFile, match=words) as told:
        read_prompt(written(tmp_path, text))
    assert "\n" not in str(told.value)


def test_no_file_and_no_text_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(FileMissing):
        read_prompt(tmp_path / "rooms.prompt")
    (tmp_path / "rooms.prompt").write_bytes(b"\xff\xfe")
    with pytest.raises(MalformedFile, match="not UTF-8"):
        read_prompt(tmp_path / "rooms.prompt")
