"""`lios evaluate select`: a pool is made once, campaigns draw from it, and a table says who paid least."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from replayers.evaluation.selection_experiment import (
    FULL_INFORMATION,
    OURS,
    all_checks,
    campaigns,
    check_eliminations,
    selector_rows,
)
from replayers.evaluation.selection_pool import PoolTrial, read_pool, write_pool
from replayers.selection.trial_costs import PriorCosts, TrialCosts
from workbench.cli import run as lios
from workbench.errors import BadValue, MalformedFile


def drawn_pool(count: int) -> tuple[PoolTrial, ...]:
    """Tasks with drawn costs; b is the best by 15; each log is exact for its own strategy and wide for others."""
    rng = np.random.default_rng(0)
    pool: list[PoolTrial] = []
    for number in range(count):
        true = rng.uniform(30, 60) + np.array([15.0, 0.0, 25.0]) + rng.uniform(0, 10, size=3)
        seen: list[TrialCosts] = []
        for driven in range(3):
            width = np.where(np.arange(3) == driven, 0.0, rng.uniform(0, 30, size=3))
            lower, upper = np.maximum(true - width, 0), true + width
            apart = upper[:, None] - lower[None, :]
            np.fill_diagonal(apart, 0.0)
            seen.append(
                TrialCosts(
                    log=f"house {number}", strategies=("a", "b", "c"), driven="abc"[driven], lower=lower,
                    upper=upper, estimate=np.clip(true + rng.normal(0, width / 4), lower, upper),
                    max_difference=apart, limit=400.0,
                )
            )  # fmt: skip
        pool.append(
            PoolTrial(house=f"h{number}", scenario="find", seed=0, true=tuple(true.tolist()), seen=tuple(seen))
        )
    return tuple(pool)


def test_intervals_pay_less_than_bandits() -> None:
    pool = drawn_pool(30)
    made = list(campaigns(pool, trials=20, seeds=range(6)))
    rows = selector_rows(made, seed=0)
    regret = {row.selector: row.regret.value for row in rows}
    assert regret["intervals"] < 0.5 * min(regret["ucb1"], regret["thompson"])
    share = rows[0].share_of["ucb1"]
    assert share is not None
    assert share.value == pytest.approx(regret["intervals"] / regret["ucb1"])
    assert share.lower < share.value < share.upper < 1
    again = list(campaigns(pool, trials=20, seeds=range(6)))
    assert [c.driven for c in again] == [c.driven for c in made]


def test_full_information_follows_the_leader_and_is_no_competitor() -> None:
    pool = drawn_pool(8)
    made = next(c for c in campaigns(pool, trials=8, seeds=[0]) if c.selector == FULL_INFORMATION)
    order = np.random.default_rng((0, 0)).permutation(8)
    true = np.array([pool[i].true for i in order])
    assert list(made.driven[1:]) == [int(np.argmin(true[:t].mean(axis=0))) for t in range(1, 8)]


def test_full_information_knows_no_priors_and_ours_does() -> None:
    prior = PriorCosts(mean=np.array([10.0, 90.0, 90.0]), variance=4000.0)
    unproved = {"lower": np.zeros(3), "max_difference": np.full((3, 3), 99.0), "prior": prior}
    pool = [replace(t, seen=tuple(replace(s, **unproved) for s in t.seen)) for t in drawn_pool(3)]
    made = {c.selector: c for c in campaigns(pool, trials=3, seeds=[0])}
    assert made[OURS].driven[1:] == made["priors-alone"].driven[1:] == (0, 0)
    assert made["replays-alone"].driven[1:] == (1, 1)
    assert made[FULL_INFORMATION].driven[1:] == (1, 1)


def test_eliminations_are_checked_against_the_truth() -> None:
    check = check_eliminations(drawn_pool(10), trials=10, count=40, seed=0, sequences=5)
    assert check.wrong_by_proof == 0
    assert check.by_proof > 0.2


def test_pools_count_together_and_their_seeds_are_told_apart() -> None:
    pools = [drawn_pool(12), drawn_pool(12)[::-1]]
    made = [c for k, pool in enumerate(pools) for c in campaigns(pool, trials=10, seeds=range(4), number=k)]
    together, first = selector_rows(made, seed=0), selector_rows([c for c in made if c.pool == 0], seed=0)
    assert together[0].regret.clusters == 8
    assert first[0].regret.clusters == 4
    both = all_checks([check_eliminations(p, trials=5, count=7, seed=0, sequences=2) for p in pools])
    assert both.campaigns == 14


def test_an_elimination_that_is_wrong_is_found() -> None:
    pool = drawn_pool(10)
    liars = tuple(replace(trial, true=(trial.true[2], trial.true[0], trial.true[1])) for trial in pool)
    assert check_eliminations(liars, trials=10, count=20, seed=0, sequences=1).wrong_by_proof > 0


def test_a_campaign_needs_as_many_tasks_as_trials() -> None:
    with pytest.raises(BadValue, match="--trials"):
        next(campaigns(drawn_pool(3), trials=4, seeds=[0]))


def test_a_pool_is_kept_as_it_was(tmp_path: Path) -> None:
    pool = drawn_pool(3)
    prior = PriorCosts(mean=np.array([1.0, 2.0, 3.0]), variance=4.0)
    pool = (replace(pool[0], seen=tuple(replace(s, prior=prior) for s in pool[0].seen)), *pool[1:])
    write_pool(tmp_path / "pool.jsonl", pool)
    again = read_pool(tmp_path / "pool.jsonl")
    kept = again[0].seen[2].prior
    assert kept is not None
    assert (kept.mean.tolist(), kept.variance) == ([1.0, 2.0, 3.0], 4.0)
    assert again[1].seen[0].prior is None
    assert [t.true for t in again] == [t.true for t in pool]
    assert all(
        np.array_equal(x.max_difference, y.max_difference) and x.driven == y.driven
        for a, b in zip(again, pool, strict=True) for x, y in zip(a.seen, b.seen, strict=True)
    )  # fmt: skip
    (tmp_path / "pool.jsonl").write_text("{}")
    with pytest.raises(MalformedFile, match="--force"):
        read_pool(tmp_path / "pool.jsonl")


def test_an_interrupted_write_keeps_the_trials_from_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pool, path = drawn_pool(3), tmp_path / "pool.jsonl"
    write_pool(path, pool[:2])
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        write_pool(path, pool)
    assert len(read_pool(path)) == 2


RAISES = """
class Raises:
    name = "raises"

    def believe(self, knowledge, item_types):
        raise RuntimeError("boom")
"""


def test_an_estimator_that_raises_is_told_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raising_estimator.py").write_text(RAISES)
    wish = ["evaluate", "select", "--scenario", "find", "-s", "greedy,lios", "--pool", "2", "-n", "2", "-o", "out"]
    assert lios([*wish, "--estimator", "raising_estimator:Raises"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "boom" in line
    assert not (tmp_path / "out").exists()


BREAKS = """
from workbench.planning.tasks import goal_types


class Breaks:
    name = "breaks"

    def relevant_types(self, task):
        return goal_types(task.goal)

    def decide(self, view):
        raise RuntimeError("no idea")
"""


def test_a_planner_that_breaks_is_told_and_again_when_the_pool_is_reused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "breaking_planner.py").write_text(BREAKS)
    wish = [
        "evaluate",
        "select",
        "--scenario",
        "find",
        "-s",
        "greedy,breaking_planner:Breaks",
        "--pool",
        "2",
        "-n",
        "2",
    ]
    for _ in range(2):
        assert lios([*wish, "--seeds", "2", "--proofs", "2", "--worlds", "2", "-o", "out"]) == 0
        said = capsys.readouterr().err
        assert "breaking_planner:Breaks broke on 2 of 2 tasks, each counted as failed: it raised" in said
        assert "no idea" in said


@pytest.mark.slow
def test_the_command_drives_and_measures(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    wish = ["evaluate", "select", "--scenario", "find", "-s", "greedy,lios", "--pool", "2", "-n", "2", "--seeds", "2",
            "--proofs", "5", "--worlds", "5", "-o", str(tmp_path / "out")]  # fmt: skip
    assert lios([*wish, "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["eliminations"]["wrong_by_proof"] == 0
    names = ["intervals", "lower-bounds", "ucb1", "thompson", "random", "replays-alone", "priors-alone"]
    assert [row["selector"] for row in first["rows"]] == [*names, "full-information"]
    assert [row["selector"] for row in first["rows"] if row["reference"]] == ["full-information"]
    assert (tmp_path / "out" / "regret.png").exists()
    assert lios([*wish, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == first  # from the pool that was kept
    assert [row["pool"] for row in first["pools"]] == [0]
    assert lios([*wish, "--pools", "2"]) == 0
    shown = capsys.readouterr().out
    assert "pool by pool" in shown
    assert "(full-information)" in shown
    assert (tmp_path / "out" / "pool-1.jsonl").exists()
    assert lios([*wish[:-4], "-s", "greedy,model-lios", "-o", str(tmp_path / "out")]) == 2


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("-s", "lios", "two or more"),
        ("-s", "lios,oracle", "knows the whole house"),
        ("--scenario", "party", "party"),
        ("--trials", "81", "the 80 tasks of --pool"),
        ("-o", __file__, "a folder is needed"),
    ],
)
def test_bad_input_is_one_line(option: str, value: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["evaluate", "select", option, value, "--dry-run"]) == 2
    assert words in capsys.readouterr().err.strip().splitlines()[-1]
