"""`lios record` with estimators from outside: what they break is one line with exit code 2, and nothing is lost."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from chat_server import chat_server, write_prompt

from replayers.runs.run import read
from workbench import cli

Lios = Callable[..., tuple[int, str, str]]

MODULE = """
from test_guarded_estimator import *


class Tired(Fine):
    calls = 0

    def believe(self, knowledge, item_types):
        self.calls += 1
        if self.calls > 2:
            raise RuntimeError("too tired")
        return super().believe(knowledge, item_types)


class Nameless(Fine):
    name = " "


class TwoLines(Fine):
    name = "two\\nlines"
"""


@pytest.fixture
def lios(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Lios:
    (tmp_path / "cases_of_estimators.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / "beliefs"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "cache"))

    def run(*words: str | Path) -> tuple[int, str, str]:
        code = cli.run([str(w) for w in words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("Raises", "it raised RuntimeError: no idea"),
        ("NaN", "is nan; it must be within [0, 1]"),
        ("Turned", "it must be of shape"),
    ],
)
def test_an_estimator_that_breaks_is_one_line(kind: str, words: str, lios: Lios, tmp_path: Path) -> None:
    code, _, err = lios(
        "record", "--find", "mug", "--estimator", f"cases_of_estimators:{kind}", "-o", "run.mcap", "--json"
    )
    (line,) = [line for line in err.splitlines() if line.startswith("lios:")]
    assert code == 2
    assert "estimator 'fine'" in line
    assert words in line
    run = read(tmp_path / "run.mcap")
    assert run.complete
    assert run.outcome is not None
    assert run.outcome.status == "estimator-failed"


@pytest.mark.parametrize("kind", ["Nameless", "TwoLines"])
def test_an_estimator_without_a_name_of_one_line_is_refused(kind: str, lios: Lios, tmp_path: Path) -> None:
    code, _, err = lios("record", "--find", "mug", "--estimator", f"cases_of_estimators:{kind}", "-o", "run.mcap")
    assert code == 2
    assert "it must be one line of text" in err
    assert not (tmp_path / "run.mcap").exists()


def test_what_was_driven_until_it_broke_is_in_the_log(lios: Lios, tmp_path: Path) -> None:
    code, _, err = lios("record", "--scenario", "deliver-3", "-s", "opt-greedy",
                        "--estimator", "cases_of_estimators:Tired", "-o", "run.mcap")  # fmt: skip
    run = read(tmp_path / "run.mcap")
    assert code == 2
    assert "What was recorded until then is in run.mcap" in err
    assert len(run.plans) == len(run.beliefs) == 2
    assert run.actions
    assert run.complete


def test_the_answers_of_a_language_model_are_in_the_log_each_once(lios: Lios, tmp_path: Path) -> None:
    with chat_server() as server:
        prompt = write_prompt(tmp_path / "rooms.prompt", server)
        code, _, err = lios("record", "--find", "mug", "--estimator", prompt, "-o", "run.mcap")
    run = read(tmp_path / "run.mcap")
    assert code == 0, err
    assert len(run.plans) > len(run.answers) == len(server.asked) > 0
    assert [a.question for a in run.answers] == [body["messages"][0]["content"] for body in server.asked]
    assert {(a.estimator, a.model) for a in run.answers} == {(run.info.estimator, "toy-1")}
    assert all(a.seconds > 0 and "json" in a.answer for a in run.answers)
    assert all(belief.estimator == run.info.estimator for belief in run.beliefs)
    log = (tmp_path / "run.mcap").read_bytes()
    assert server.url.encode() not in log, "where it was asked is nobody's business"


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("seen", [False, True])
def test_the_same_run_is_recorded_again_without_asking(seen: bool, lios: Lios, tmp_path: Path) -> None:
    with chat_server() as server:
        prompt = write_prompt(tmp_path / "rooms.prompt", server, seen=seen)
        assert lios("record", "--find", "mug", "--estimator", prompt, "-o", "one.mcap")[0] == 0
        asked = len(server.asked)
    assert lios("record", "--find", "mug", "--estimator", prompt, "-o", "two.mcap")[0] == 0, "the server is gone"
    one, two = read(tmp_path / "one.mcap"), read(tmp_path / "two.mcap")
    assert len(one.answers) == asked
    assert (one.answers, one.actions, one.beliefs) == (two.answers, two.actions, two.beliefs)


@pytest.mark.parametrize(
    ("status", "words"), [(401, "refuses the key"), (429, "too many"), (500, "status 500"), (0, "cannot be reached")]
)
def test_an_endpoint_that_fails_is_one_line(status: int, words: str, lios: Lios, tmp_path: Path) -> None:
    with chat_server(lambda _: (status, {"Retry-After": "0"}, b"")) as server:
        where = server if status else "http://127.0.0.1:9/v1"
        prompt = write_prompt(tmp_path / "rooms.prompt", where)
        code, _, err = lios("record", "--find", "mug", "--estimator", prompt, "-o", "run.mcap")
    (line,) = [line for line in err.splitlines() if line.startswith("lios:")]
    assert code == 2
    assert words in line
    assert read(tmp_path / "run.mcap").complete


def test_a_prompt_that_is_none_is_one_line_and_no_file(lios: Lios, tmp_path: Path) -> None:
    (tmp_path / "rooms.prompt").write_text("Where is it?")
    code, _, err = lios("record", "--find", "mug", "--estimator", "rooms.prompt", "-o", "run.mcap")
    assert code == 2
    assert "no line '---'" in err
    assert not (tmp_path / "run.mcap").exists()
