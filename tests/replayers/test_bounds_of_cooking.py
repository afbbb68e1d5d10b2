"""Where no upper bound is known, none is said: in memory infinite, in JSON null, in words "no upper bound"."""

from __future__ import annotations

from math import inf, isinf
from pathlib import Path

import msgspec
import numpy as np
import pytest
from sample_logs import write_toy_log
from toy import COUNTER, DESK
from toy_logs import Even, delivered, task_of, toy_evidence

from replayers.batch.compare import UNDECIDED, compare
from replayers.batch.store import StoredReplay, read_replay, replay_key, to_stored, write_replay
from replayers.counterfactual.bounds.bounds import Bounds, Budget, OuterReason
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.relevance import Assumptions, relevance_of
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_on
from replayers.counterfactual.results import Proof
from replayers.counterfactual.run_tree import RunTree
from replayers.counterfactual.strategy_traits import search_traits
from replayers.counterfactual.tree.options import TreeOptions
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, Delivered, Goal
from workbench.worlds.house import ItemType, LocationId

LOG = Path(__file__).parents[2] / "logs" / "breakfast.mcap"
BOILED = Delivered(item_type=ItemType("Egg"), at=LocationId(DESK), properties=("boiled",))


def bounded(folder: Path, goal: Goal, *, segments: int) -> Bounds:
    evidence, planner = toy_evidence(folder, task_of(goal)), strategy("opt-greedy")
    tree = RunTree(
        evidence,
        planner,
        Even(),
        relevance_of(evidence, planner.relevant_types(evidence.task), Assumptions()),
        TreeOptions(merge=True, traits=search_traits(planner, goal)),
    )
    return bounds_of(tree, budget=Budget(segments=segments, finish=segments))


@pytest.mark.parametrize("goal", [BOILED, AllOf(parts=(BOILED, delivered("Pencil", COUNTER)))])
def test_a_cook_whose_worlds_were_not_all_followed_has_none(tmp_path: Path, goal: Goal) -> None:
    early, whole = (bounded(tmp_path, goal, segments=n) for n in (0, 100_000))
    assert early.upper == inf
    assert early.upper_proof is Proof.NONE
    assert not early.exact
    assert early.lower <= whole.lower + 1e-6
    assert {reason.kind for reason in early.why_outer} >= {OuterReason.BUDGET, OuterReason.DETOURS}
    if whole.complete:
        assert whole.upper_proof is Proof.EXACT
        assert whole.upper < inf


@pytest.fixture(scope="module")
def kept() -> tuple[StoredReplay, ...]:
    prepared = prepare_log(read(LOG), ReplaySettings(worlds=20))
    names = ("opt-greedy", "pes-greedy", "conditioned-lios")
    made = [replay_on(prepared, name) for name in names]
    return tuple(to_stored(prepared, m, key=replay_key("", m.strategy, prepared.settings)) for m in made)


@pytest.mark.ci
def test_an_upper_bound_of_a_breakfast_is_near_what_was_found_or_is_none(kept: tuple[StoredReplay, ...]) -> None:
    bounds = [replay.bounds for replay in kept if replay.bounds is not None]
    assert {isinf(b.upper) for b in bounds} == {True, False}, "the log decides one of them, and not the others"
    for b in bounds:
        assert isinf(b.upper) == (b.upper_proof == "none")
        assert isinf(b.upper) or b.upper <= 3 * b.largest_found


@pytest.mark.ci
def test_notes_say_why_an_end_is_not_reached(kept: tuple[StoredReplay, ...]) -> None:
    for replay in kept:
        assert replay.bounds is not None
        reached = replay.bounds.lower_proof == replay.bounds.upper_proof == "exact"
        said = [note for note in replay.notes if note.startswith(f"the bounds of {replay.strategy} are outer ones: ")]
        assert len(said) == (0 if reached else 1)


@pytest.mark.ci
def test_a_kept_replay_without_one_is_read_again(kept: tuple[StoredReplay, ...], tmp_path: Path) -> None:
    for number, replay in enumerate(kept):
        write_replay(tmp_path / f"{number}.replay.json", replay)
        assert read_replay(tmp_path / f"{number}.replay.json") == replay
        assert b"nfinity" not in (tmp_path / f"{number}.replay.json").read_bytes()


@pytest.mark.ci
def test_who_has_none_is_better_than_nobody_for_certain(kept: tuple[StoredReplay, ...]) -> None:
    first = next(replay for replay in kept if replay.bounds is not None and isinf(replay.bounds.upper))
    pairs = compare(kept, rng=np.random.default_rng(0))
    ours = [pair for pair in pairs if first.strategy in (pair.a, pair.b)]
    assert ours
    for pair in ours:
        apart = pair.differences[0]
        unbounded = apart.most if pair.a == first.strategy else -apart.least
        assert unbounded == inf
        assert apart.verdict in (UNDECIDED, "wins" if pair.b == first.strategy else "loses")
        assert not np.isnan([apart.least, apart.most]).any()


@pytest.mark.ci
def test_commands_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    asked = ["replay", str(LOG), "-s", "opt-greedy,pes-greedy", "--worlds", "20"]
    assert lios([*asked, "--json"]) == 0
    rows = msgspec.json.decode(capsys.readouterr().out)["rows"]
    assert [row["upper"] for row in rows] == [None, None]
    assert [row["upper_proof"] for row in rows] == ["none", "none"]
    assert lios([*asked, "-o", str(out)]) == 0
    assert "no upper bound" in " ".join(capsys.readouterr().out.split())
    assert lios(["compare", str(out), "--json"]) == 0
    pair = msgspec.json.decode(capsys.readouterr().out)["rows"][0]
    assert pair["difference_lower"] is None or pair["difference_upper"] is None
    assert lios(["compare", str(out)]) == 0


def test_a_delivery_keeps_its_bound(tmp_path: Path) -> None:
    made = replay_on(prepare_log(read(write_toy_log(tmp_path / "toy.mcap")), ReplaySettings(worlds=0)), "opt-greedy")
    assert made.bounds is not None
    assert made.bounds.upper < inf
