"""Replay of runs whose beliefs were asked for: from the answers in the log, exactly, and without who answered."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from chat_server import chat_server, write_prompt

import recorders
import replayers
from replayers.batch.verify import verify
from replayers.counterfactual.evidence import evidence_of
from replayers.counterfactual.logged_belief import by_answers
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.runs.run import Run, read
from workbench import cli
from workbench.beliefs.asking.chat import ChatQuestions
from workbench.errors import Unsupported

Lios = Callable[..., tuple[int, str, str]]

COSTLY = """
from test_answered_estimator import Slow


class Mine(Slow):
    name = "mine@1"
"""


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A working folder and a cache of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / "beliefs"))


@pytest.fixture
def lios(capsys: pytest.CaptureFixture[str]) -> Lios:
    def run(*words: str | Path) -> tuple[int, str, str]:
        code = cli.run([str(w) for w in words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def record_and_forget(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    seen: bool,
    strategy: str,
    number: int = 0,
    task: tuple[str, str] = ("find", "mug"),
) -> Run:
    """A run by a model whose server is gone and whose answers no cache holds."""
    log = folder / f"{strategy}-{number}.mcap"
    with chat_server() as server:
        prompt = write_prompt(folder / "rooms.prompt", server, seen=seen)
        end = recorders.record(log, house=f"houses:{number}", **{task[0]: task[1]}, strategy=strategy,
                               estimator=str(prompt), seed=number)  # fmt: skip
    assert end.status == "done"
    monkeypatch.setenv("LIOS_CACHE", "off")
    prompt.unlink()
    return read(log)


@pytest.mark.parametrize("seen", [False, True])
def test_a_self_replay_is_exact_without_the_model(
    seen: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record_and_forget(tmp_path, monkeypatch, seen=seen, strategy="conditioned-lios")
    (made,) = replayers.replay([run], ["conditioned-lios"])
    assert run.outcome is not None
    assert made.exact
    assert made.bounds is not None
    assert made.bounds.lower == pytest.approx(run.outcome.cost, abs=1e-5)
    assert verify(run).same


@pytest.mark.slow
@pytest.mark.parametrize("seen", [False, True])
def test_every_self_replay_is_exact(seen: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for strategy in ("pes-lios", "model-lios", "conditioned-lios"):
        for number in range(6):
            monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "cache"))
            run = record_and_forget(tmp_path, monkeypatch, seen=seen, strategy=strategy, number=number,
                                    task=("scenario", "deliver-3"))  # fmt: skip
            (made,) = replayers.replay([run], [strategy], settings=ReplaySettings(worlds=0))
            assert run.outcome is not None
            assert made.exact
            assert made.bounds is not None
            assert made.bounds.lower == pytest.approx(run.outcome.cost, abs=1e-5)
            assert verify(run).same


def test_beliefs_by_names_alone_serve_every_strategy_over_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record_and_forget(tmp_path, monkeypatch, seen=False, strategy="pes-greedy")
    made = replayers.replay([run], "all", settings=ReplaySettings(worlds=20))
    assert not made.failed
    assert all(one.bounds is not None for one in made)


def test_what_nobody_recorded_is_said_in_one_line_or_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lios: Lios
) -> None:
    with chat_server() as server:
        prompt = write_prompt(tmp_path / "sight.prompt", server, seen=True)
        assert lios("record", "--find", "mug", "-s", "pes-greedy", "--estimator", prompt)[0] == 0
        monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "empty"))
        asked = len(server.asked)
        code, _, err = lios("replay", "run.mcap", "-s", "conditioned-lios", "--worlds", "0")
        (line,) = err.splitlines()
        assert code == 2
        assert "nobody recorded its answer to 'Where is a" in line
        assert "--ask" in line
        assert len(server.asked) == asked
        code, _, err = lios("replay", "run.mcap", "-s", "conditioned-lios", "--worlds", "0", "--estimator", prompt)
        assert (code, len(server.asked)) == (2, asked), "naming it is no leave to ask"
        code, _, err = lios("replay", "run.mcap", "-s", "conditioned-lios", "--worlds", "0", "--budget", "3",
                            "--estimator", prompt, "--ask")  # fmt: skip
        assert code == 0, err
        assert len(server.asked) > asked


def test_whom_to_ask_is_never_the_logs_choice(tmp_path: Path, lios: Lios) -> None:
    with chat_server() as server:
        prompt = write_prompt(tmp_path / "sight.prompt", server, seen=True)
        assert lios("record", "--find", "mug", "--estimator", prompt)[0] == 0
        asked = len(server.asked)
        code, _, err = lios("replay", "run.mcap", "--ask")
        assert (code, len(server.asked)) == (2, asked)
        assert "--ask" in err
        assert "--estimator" in err
    run = read(tmp_path / "run.mcap")
    believer = by_answers(evidence_of(run))
    assert believer is not None
    assert isinstance(believer.asking, ChatQuestions)
    assert believer.asking.endpoint is None
    named = msgspec.structs.replace(run.info, estimator="sight.prompt")
    assert by_answers(evidence_of(replace(run, info=named))) is None


def test_strategies_that_go_by_distance_alone_need_no_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record_and_forget(tmp_path, monkeypatch, seen=True, strategy="conditioned-lios")
    (made,) = replayers.replay([run], ["opt-greedy"], settings=ReplaySettings(worlds=0))
    assert made.bounds is not None


def test_a_log_without_an_estimate_says_which_answer_it_lacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record_and_forget(tmp_path, monkeypatch, seen=True, strategy="conditioned-lios")
    prepared = prepare_log(run, ReplaySettings(worlds=10))
    assert (prepared.worlds is None) == any(note.startswith("no estimate: ") for note in prepared.notes)


def test_one_that_is_costly_as_a_whole_is_replayed_without_its_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine_and_costly.py").write_text(COSTLY)
    recorders.record("run.mcap", find="mug", estimator="mine_and_costly:Mine")
    (tmp_path / "mine_and_costly.py").unlink()
    monkeypatch.setenv("LIOS_CACHE", "off")
    run = read("run.mcap")
    assert len({a.question for a in run.answers}) == len(run.answers) > 1
    (made,) = replayers.replay([run], ["conditioned-lios"], settings=ReplaySettings(worlds=0))
    assert made.exact
    assert verify(run).same


def test_a_recorded_replay_holds_the_answers_and_is_replayed_itself(tmp_path: Path, lios: Lios) -> None:
    with chat_server() as server:
        prompt = write_prompt(tmp_path / "rooms.prompt", server, seen=True)
        assert lios("record", "--find", "mug", "--estimator", prompt)[0] == 0
    assert lios("replay", "run.mcap", "-s", "conditioned-lios", "-o", "kept", "--worlds", "0")[0] == 0
    (log,) = Path("kept").rglob("*.replay.mcap")
    assert {a.question for a in read(log).answers} == {a.question for a in read("run.mcap").answers}
    code, out, err = lios("replay", log, "-s", "conditioned-lios", "--worlds", "0", "--json")
    assert code == 0, err
    assert json.loads(out)["rows"][0]["exact"]


def test_an_answer_that_was_changed_in_the_log_is_not_believed_blindly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The recorded strategy then does something else, and nothing is claimed; or the answer is of no use."""
    run = record_and_forget(tmp_path, monkeypatch, seen=True, strategy="conditioned-lios")
    rubbish = tuple(msgspec.structs.replace(a, answer='{"Fridge": NaN}') for a in run.answers)
    with pytest.raises(Unsupported, match="holds no JSON object"):
        prepare_log(replace(run, answers=rubbish), ReplaySettings(worlds=0))
