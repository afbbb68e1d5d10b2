"""Candidates that differ in whose beliefs they follow: named, paired over the same worlds, and one of them driven."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from chat_server import chat_server, write_prompt

import recorders
import replayers
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.selection.campaign_logs import GroupBy, trial_groups
from replayers.selection.candidates import estimators_named, named_estimators, replay_candidates
from workbench import cli
from workbench.errors import BadValue
from workbench.plugins import NameOrigin


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "cache"))


def test_every_strategy_by_every_estimator_is_a_candidate_over_the_same_worlds(tmp_path: Path) -> None:
    recorders.record("run.mcap", find="mug", strategy="pes-lios", estimator="fcnn")
    settings = ReplaySettings(worlds=10, estimator_origin=NameOrigin.USER)
    made = replay_candidates("run.mcap", "pes-lios,conditioned-lios", ("counts", "fcnn"), settings=settings)
    names = [r.strategy for r in made]
    assert names == [
        "pes-lios by counts", "conditioned-lios by counts", "pes-lios by fcnn", "conditioned-lios by fcnn",
    ]  # fmt: skip
    assert len({r.draws for r in made}) == 1
    assert all(len(r.drawn) == 10 for r in made)
    (group,) = trial_groups(made, names, GroupBy.SCENARIO).groups
    (trial,) = group.trials
    assert trial.driven == "pes-lios by fcnn"
    assert trial.drawn is not None
    assert trial.exact[names.index("pes-lios by fcnn")]


def test_prompts_are_candidates_and_nobody_is_asked_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with chat_server() as server:
        a, b = (write_prompt(tmp_path / f"{name}.prompt", server, more=more) for name, more in
                (("short", "max_tokens: 9\n"), ("long", "max_tokens: 99\n")))  # fmt: skip
        recorders.record("run.mcap", find="mug", strategy="conditioned-lios", estimator=str(a))
        asked = len(server.asked)
        wanted = ["select", "run.mcap", "-s", "conditioned-lios", "--estimator", f"{a},{b}", "--worlds", "5"]
        assert cli.run([*wanted, "--json"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "only conditioned-lios by chat-short can be replayed. conditioned-lios by chat-long: " in line
        assert "--ask" in line
        assert len(server.asked) == asked
        assert cli.run([*wanted, "--json", "--ask"]) == 0
        assert len(server.asked) > asked
    (group,) = json.loads(capsys.readouterr().out)["groups"]
    rows = {row["strategy"]: row for row in group["after"][0]["rows"]}
    assert set(rows) == {"conditioned-lios by chat-short", "conditioned-lios by chat-long"}
    assert rows["conditioned-lios by chat-short"]["driven"] == 1


def test_estimators_are_called_by_the_least_that_tells_them_apart(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    one = write_prompt(tmp_path / "a.prompt", "http://127.0.0.1:1/v1")
    two = write_prompt(tmp_path / "other" / "a.prompt", "http://127.0.0.1:1/v1", seen=True)
    same = write_prompt(tmp_path / "other" / "a.b.prompt", "http://127.0.0.1:1/v1").rename(
        tmp_path / "other/c.prompt"
    )
    alone, pair = named_estimators(["counts", str(one)]), named_estimators([str(one), str(two), str(same)])
    assert [b.label for b in alone] == ["counts", "chat-a"]
    assert [b.label for b in pair] == [pair[0].name, pair[1].name, "chat-c"]


@pytest.mark.parametrize("text", ["", " , ", "log,counts", "counts,first"])
def test_lists_that_name_no_candidates_are_one_line(text: str) -> None:
    with pytest.raises(BadValue, match="--estimator"):
        estimators_named(text)


def test_logs_of_two_estimators_are_apart_unless_all_follow_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("counts", "fcnn"):
        recorders.record(f"{name}.mcap", find="mug", strategy="pes-lios", estimator=name)
    wanted = ["select", "counts.mcap", "fcnn.mcap", "-s", "pes-lios,conditioned-lios", "--worlds", "5"]
    assert cli.run(wanted) == 0
    shown = capsys.readouterr()
    assert "find, in simulation, beliefs of counts: 1 trial in 1 place" in shown.out
    assert "The logs hold the beliefs of counts, fcnn: " in shown.err
    assert cli.run([*wanted, "--json"]) == 0
    groups = json.loads(capsys.readouterr().out)["groups"]
    assert {g["beliefs"]: [row["driven"] for row in g["after"][-1]["rows"]] for g in groups} == {
        "counts": [1, 0],
        "fcnn": [1, 0],
    }
    assert cli.run([*wanted, "--json", "--estimator", "fcnn"]) == 0
    (group,) = json.loads(capsys.readouterr().out)["groups"]
    assert group["beliefs"] is None
    driven = {row["strategy"]: row["driven"] for row in group["after"][-1]["rows"]}
    assert driven == {"pes-lios": 1, "conditioned-lios": 0}, "who followed the beliefs of counts drove no candidate"


def test_a_memory_is_of_the_trial_and_not_another_estimator(tmp_path: Path) -> None:
    memory = "+memory-"
    recorders.record("first.mcap", find="mug", strategy="pes-lios", estimator="fcnn")
    recorders.record("again.mcap", find="mug", strategy="pes-lios", estimator="fcnn", memory=["first.mcap"])
    assert memory in replayers.read("again.mcap").info.estimator
    logs = ["first.mcap", "again.mcap"]
    for named in (("log",), ("fcnn",)):
        settings = ReplaySettings(worlds=0, estimator_origin=NameOrigin.USER)
        made = replay_candidates(logs, "pes-lios,conditioned-lios", named, settings=settings)
        (group,) = trial_groups(made, ("pes-lios", "conditioned-lios"), GroupBy.SCENARIO).groups
        assert [trial.driven for trial in group.trials] == ["pes-lios", "pes-lios"]
